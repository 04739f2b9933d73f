"""Texts with marks: `<|>` is where the cursor is, `<[` and `]>` go around what is expected of an answer."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

from lsprotocol import types

from softmark.interpreter.language_server.text_document import Document


class Marked(NamedTuple):
    """A text without its marks, where the cursor is, and the ranges that were marked."""

    document: Document
    cursor: types.Position
    ranges: list[types.Range]

    @property
    def uri(self) -> str:
        """Of its file."""
        assert self.document.file is not None
        return self.document.file.as_uri()

    def asked(self, params: type[Any], **more: Any) -> Any:
        """The parameters of a request at the cursor."""
        return params(text_document=types.TextDocumentIdentifier(self.uri), position=self.cursor, **more)

    @property
    def opened(self) -> Any:
        """What is open: this text alone."""
        return SimpleNamespace(documents={self.uri: self.document})


def marked(text: str, folder: Path, name: str = "some.scene") -> Marked:
    """A text with marks, as a file of a folder, which need not exist; without a cursor that is at its start."""
    plain, places, opened, ranges = "", 0, list[int](), list[tuple[int, int]]()
    for part in re.split(r"(<\|>|<\[|\]>)", text):
        if part == "<|>":
            places = len(plain)
        elif part == "<[":
            opened.append(len(plain))
        elif part == "]>":
            ranges.append((opened.pop(), len(plain)))
        else:
            plain += part
    document = Document(plain, folder, folder / name)
    at = [types.Range(document.position(a), document.position(b)) for a, b in sorted(ranges)]
    return Marked(document, document.position(places), at)


def whole(document: Document) -> types.Range:
    """The range of a text."""
    return types.Range(types.Position(0, 0), document.position(len(document.text)))


def after(document: Document, edits: list[types.TextEdit]) -> str:
    """A text after changes."""
    text = document.text
    for edit in sorted(edits, key=lambda e: (e.range.start.line, e.range.start.character), reverse=True):
        text = text[: document.offset(edit.range.start)] + edit.new_text + text[document.offset(edit.range.end) :]
    return text
