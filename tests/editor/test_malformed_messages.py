"""Malformed messages of an editor: each is answered with an error (JSON-RPC 2.0, section 5.1), the next one is read."""

from __future__ import annotations

import io
import json
from typing import Any

import pytest

pytest.importorskip("pygls")

from softmark.interpreter.language_server import message_reader
from softmark.interpreter.language_server.message_reader import INVALID_REQUEST, MALFORMED, PARSE_ERROR, read_messages
from softmark.interpreter.language_server.server import serve

SOUND = b'{"jsonrpc": "2.0", "method": "initialized", "params": {}}'


def frame(body: bytes) -> bytes:
    return b"Content-Length: %d\r\n\r\n" % len(body) + body


def read(sent: bytes) -> list[dict[str, Any]]:
    return list(read_messages(io.BytesIO(sent)))


BODIES = {
    "cut": (b'{"jsonrpc": "2.0", ', PARSE_ERROR),
    "not UTF-8": (b"\xff\xfe{}", PARSE_ERROR),
    "nested": (b"[" * 100_000, PARSE_ERROR),
    "digits": (b'{"jsonrpc": "2.0", "id": ' + b"9" * 5000 + b"}", PARSE_ERROR),
    "a batch": (b'[{"jsonrpc": "2.0", "id": 1, "method": "shutdown"}]', INVALID_REQUEST),
    "null": (b"null", INVALID_REQUEST),
    "no version": (b'{"id": 4, "method": "shutdown"}', INVALID_REQUEST),
}
HEADERS = {
    "negative": b"Content-Length: -5\r\n\r\n",
    "no number": b"Content-Length: abc\r\n\r\n",
    "thousands of digits": b"Content-Length: " + b"9" * 5000 + b"\r\n\r\n",
}


@pytest.mark.parametrize("name", BODIES)
def test_a_malformed_body_is_an_error_and_the_next_message_is_read(name: str) -> None:
    body, code = BODIES[name]
    first, then = read(frame(body) + frame(SOUND))
    assert (first["method"], first["params"]["code"]) == (MALFORMED, code)
    assert first["params"]["answers"] == (4 if name == "no version" else None)
    assert then == json.loads(SOUND)


@pytest.mark.parametrize("name", HEADERS)
def test_a_malformed_length_is_an_error_and_the_next_message_is_read(name: str) -> None:
    first, then = read(HEADERS[name] + b"{}" + frame(SOUND))
    assert (first["method"], first["params"]["code"]) == (MALFORMED, INVALID_REQUEST)
    assert then == json.loads(SOUND)


def test_a_message_that_is_too_large_is_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(message_reader, "LARGEST", 100)
    monkeypatch.setattr(message_reader, "PIECE", 7)
    first, then = read(frame(b" " * 101) + frame(SOUND))
    assert "larger" in first["params"]["reason"]
    assert then == json.loads(SOUND)


@pytest.mark.parametrize(
    ("sent", "count"),
    [(b"", 0), (b"hello\n\n" + frame(SOUND), 1), (frame(SOUND) + frame(SOUND)[:-1], 1), (b"A" * 1_000_000, 0),
     (b"Content-Length: 99999999999999\r\n\r\n{}", 1), (b"Foo: 3\r\n\r\n{}" + frame(SOUND), 1),
     (b"content-length:%d\n\n" % len(SOUND) + SOUND, 1)],
    ids=["nothing", "junk before", "half a message", "no line", "huge", "no length", "another spelling"],
)  # fmt: skip
def test_streams_that_break_off(sent: bytes, count: int) -> None:
    assert len(read(sent)) == count


@pytest.mark.slow
@pytest.mark.long
def test_each_message_is_parsed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A text of 1 MB is parsed in 10 ms: twice would be felt at every key."""
    parsed: list[object] = []
    loads = json.loads

    def counted(body: Any, **options: Any) -> Any:
        parsed.append(body)
        return loads(body, **options)

    monkeypatch.setattr(json, "loads", counted)
    bodies = [b'{"jsonrpc": "2.0", "id": %d, "method": "$/unknown", "params": {}}' % i for i in range(3)]
    leave = b'{"jsonrpc": "2.0", "method": "exit"}'
    assert serve(io.BytesIO(b"".join(map(frame, [*bodies, leave]))), io.BytesIO()) == 1
    assert [body for body in parsed if body in (*bodies, leave)] == [*bodies, leave]  # others are tables of the grammar
