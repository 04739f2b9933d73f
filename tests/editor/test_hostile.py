"""Answers at the ends of unfinished and of hostile texts: nothing raises. Of all prefixes: benchmarks/editor.py."""

from __future__ import annotations

import json
import random
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("lsprotocol")

from editor_texts import SCENE, answers
from lsprotocol import types

from softmark.interpreter.language_server.open_documents import apply_change
from softmark.interpreter.language_server.text_document import Document
from softmark.scenes import ROOT

pytestmark = pytest.mark.slow

SAMPLE = 250
HOSTILE = {
    "nothing": "",
    "binary": "".join(map(chr, range(256))) * 4,
    "nested": "param a = " + "(" * 5000,
    "nested calls": "body a = " + "solid(box(" * 3000,
    "brackets": "material a = neo_hookean(" + "[(" * 2000 + ")]" * 2000,
    "long line": "param a = " + "1 + " * 20_000,
    "long name": "param " + "a" * 100_000 + " = ",
    "halves": 'param \ud835 = 3 \udc00m\nscene "\ud835',
    "beyond the first plane": 'scene "𝐱𝐲𝐳"\nparam 𝐱 = 3 ',
    "carriage returns": SCENE.replace("\n", "\r\n") + "\r\rparam a = 5 ",
    "form feeds": SCENE.replace("\n", "\f\n\v\u2028") + "param a = 5\u00a0",
    "open quotes": 'use "' + "../" * 200,
    "folders": 'use "/proc/self/',
    "a null in a name": 'body a = solid(tetrahedralized("a\0b',
    "a hundred errors": "param a = 60 mm\n" + "".join(f"param p{i} = q{i}\n" for i in range(150)),
    "dots": "expect a.b.c.d. < ..",
    "many": "param a = 1\n" * 3000,
    "circles": "param a = b\nparam b = a\nmodel m = pod(of = m, over = ",
    "marks": "# \ufeff\n\ufeffparam a = 5 ",
    "comment": "#" * 10_000,
}


def ask_all(text: str, folder: Path, file: Path | None = None) -> None:
    document = Document(text, folder, file, snippets=True)
    for answer in answers(document).values():
        answer()


def test_the_ends_of_unfinished_scenes() -> None:
    pick = random.Random(17)
    files = sorted(ROOT.rglob("*.scene"))
    for _ in range(SAMPLE):
        file = pick.choice(files)
        text = file.read_text(encoding="utf-8")
        ask_all(text[: pick.randrange(len(text) + 1)], file.parent, file)


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_texts(name: str, tmp_path: Path) -> None:
    ask_all(HOSTILE[name], tmp_path)


@pytest.mark.parametrize("breaks", ["\n", "\r\n", "\r"])
def test_changes_of_parts_come_to_the_same_text(breaks: str) -> None:
    pick = random.Random(3)
    pieces = ["a", "𝐱", "é", breaks, "\f", "\u2028", "", "param "]
    text = "".join(pick.choice(pieces) for _ in range(60))
    for _ in range(300):
        document = Document(text, Path())
        start, end = sorted(pick.randrange(len(text) + 1) for _ in range(2))
        if "\r\n" in (text[start - 1 : start + 1], text[end - 1 : end + 1]):
            continue  # no place of the protocol is between these
        new = pick.choice(pieces)
        at = types.Range(document.position(start), document.position(end))
        expected = text[:start] + new + text[end:]
        text = apply_change(document, types.TextDocumentContentChangePartial(range=at, text=new))
        assert text == expected


@pytest.mark.parametrize(("asked", "status"), [("shutdown", 0), (None, 1)])
def test_the_exit_status_is_that_of_the_protocol(asked: str | None, status: int) -> None:
    pytest.importorskip("pygls")
    said = [{"id": 1, "method": "initialize", "params": {"processId": None, "rootUri": None, "capabilities": {}}}]
    said += [{"id": 2, "method": asked}] if asked else []
    bodies = [json.dumps({"jsonrpc": "2.0", **one}) for one in (*said, {"method": "exit"})]
    sent = "".join(f"Content-Length: {len(body)}\r\n\r\n{body}" for body in bodies).encode()
    command = [sys.executable, "-m", "softmark.interpreter", "lsp"]
    assert subprocess.run(command, input=sent, capture_output=True, timeout=60).returncode == status
