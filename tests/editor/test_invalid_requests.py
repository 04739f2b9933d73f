"""Requests whose parameters are none of their method: each is answered with that error, and the server goes on."""

from __future__ import annotations

import io
import json
import subprocess
import sys
from typing import Any

import pytest

pytest.importorskip("pygls")
from softmark.interpreter.language_server.server import ClosingWriter

pytestmark = pytest.mark.slow

PLACE = {"textDocument": {"uri": "file:///a.scene"}, "position": {"line": 0, "character": 0}}
INVALID: list[Any] = [None, {}, [1], "text", {**PLACE, "position": "x"}, {**PLACE, "textDocument": 5}]


def frame(message: dict[str, Any]) -> bytes:
    body = json.dumps({"jsonrpc": "2.0", **message}).encode()
    return b"Content-Length: %d\r\n\r\n" % len(body) + body


def answers(output: bytes) -> dict[Any, dict[str, Any]]:
    found = {}
    while output:
        head, _, rest = output.partition(b"\r\n\r\n")
        size = int(head.partition(b"Content-Length: ")[2].split(b"\r\n")[0])
        message = json.loads(rest[:size])
        found[message.get("id")] = message
        output = rest[size:]
    return found


@pytest.mark.long
def test_invalid_parameters_are_answered() -> None:
    asked = [frame({"id": f"bad {i}", "method": "textDocument/hover", "params": p}) for i, p in enumerate(INVALID)]
    messages = [
        frame({"id": 1, "method": "initialize", "params": {"capabilities": {}, "processId": None, "rootUri": None}}),
        frame({"method": "initialized", "params": {}}),
        *asked,
        b"Content-Length: 4\r\n\r\n[1, ",
        frame({"id": 4, "method": "workspace/executeCommand", "params": {"command": "none"}}),
        frame(
            {
                "method": "textDocument/didOpen",
                "params": {
                    "textDocument": {
                        "uri": "file:///a%00.scene",
                        "languageId": "scene",
                        "version": 1,
                        "text": "param a = 1",
                    }
                },
            }
        ),
        frame({"method": "textDocument/didOpen", "params": {"bad": 1}}),
        frame({"id": 2, "method": "textDocument/hover", "params": PLACE}),
        frame({"id": 3, "method": "shutdown"}),
        frame({"method": "exit"}),
    ]
    code = "import sys; from softmark.interpreter.cli.main import main; sys.exit(main())"
    done = subprocess.run(
        [sys.executable, "-c", code, "lsp"], input=b"".join(messages), capture_output=True, timeout=120
    )
    assert done.returncode == 0, done.stderr.decode()
    found = answers(done.stdout)
    for i, parameters in enumerate(INVALID):
        assert found[f"bad {i}"]["error"]["code"] == -32602, parameters  # Invalid params, by JSON-RPC 2.0
    assert b'"code": -32700' in done.stdout  # Parse error, to nobody's number
    assert found[4]["error"]["code"] == -32602
    assert found[2]["result"] is None
    assert b"Traceback" not in done.stderr


def test_what_is_sent_after_the_end_is_dropped() -> None:
    """Diagnostics that a thread publishes while the server closes; before, a traceback on standard error."""
    outgoing = io.BytesIO()
    writer = ClosingWriter(outgoing)
    writer.write(b"before")
    assert outgoing.getvalue() == b"before"
    writer.close()
    writer.write(b"after")
