"""One state of a scene's text as an editor has it: what is known of it, and where a place of it is in the protocol.

Everything of one state is found once, when it is first asked for. The protocol counts lines from 0 and columns in
UTF-16 code units; spans count lines and columns from 1 in code points, offsets from 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from lsprotocol.types import Position, Range

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.grammar.lex import BREAK, Token, lex
from softmark.grammar.parse import parse
from softmark.grammar.tree import Span, Tree
from softmark.interpreter.front.load import checked
from softmark.interpreter.language.scene import Scene


@dataclass(frozen=True)
class Document:
    """A text and where it is kept: `folder` is where files that it names are looked for, `file` None if it has none.

    `version` is what the editor counts its states by.
    """

    text: str
    folder: Path
    file: Path | None = None
    version: int | None = None

    @cached_property
    def source(self) -> Source:
        """The text as messages know it."""
        return Source(str(self.file) if self.file else "<text>", self.text)

    @cached_property
    def tokens(self) -> list[Token]:
        """Its words, also those that fit no terminal."""
        return lex(self.text)[0]

    @cached_property
    def tree(self) -> Tree:
        """Its declarations; those with an error of syntax are left out."""
        return parse(self.source)[0]

    @cached_property
    def checked(self) -> tuple[Scene | None, list[Diagnostic]]:
        """The compiled scene, None if it has errors, and all that `dsl check` says of it."""
        return checked(self.source, self.folder, self.file)

    @cached_property
    def starts(self) -> list[int]:
        """Offsets of the first characters of its lines."""
        import re

        return [0, *(m.end() for m in re.finditer(BREAK, self.text))]

    def offset(self, position: Position) -> int:
        """Offset of a position; beyond the end of a line it is that end, beyond the text the text's."""
        if position.line >= len(self.starts):
            return len(self.text)
        start = self.starts[position.line]
        last = position.line + 1 == len(self.starts)
        line = self.text[start : None if last else self.starts[position.line + 1]].rstrip("\r\n")
        units = 0
        for index, character in enumerate(line):
            if units >= position.character:
                return start + index
            units += 2 if ord(character) > 0xFFFF else 1
        return start + len(line)

    def position(self, offset: int) -> Position:
        """The position of an offset."""
        from bisect import bisect_right

        line = bisect_right(self.starts, offset) - 1
        before = self.text[self.starts[line] : offset]
        return Position(line, len(before) + sum(ord(c) > 0xFFFF for c in before))

    def range(self, span: Span) -> Range:
        """A span in the protocol."""
        return Range(self.position(span.start), self.position(span.end))
