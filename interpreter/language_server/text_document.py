"""State of a scene's text in an editor, with its analysis and the conversion of positions.

Each result is computed on first use and cached. The protocol counts lines from 0 and columns in UTF-16 code units;
spans count lines and columns from 1 in code points, offsets from 0.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from lsprotocol.types import Position, Range

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.grammar.lexer import BREAK, Token, lex
from softmark.grammar.tree import Comment, Span, Tree
from softmark.interpreter.language.compiled_scene import Scene
from softmark.interpreter.language.compiler import compile_scene
from softmark.interpreter.language.field_schema import Vocabulary
from softmark.interpreter.language.name_scope import Scope
from softmark.interpreter.language.parameter_evaluation import evaluate_parameters
from softmark.interpreter.language.scene_sources import LARGEST, ModuleTable
from softmark.interpreter.validation.constructor_registry import CATALOGUE
from softmark.interpreter.validation.scene_loader import check_scene

CHECKING = threading.RLock()  # one check at a time


@dataclass(frozen=True)
class Document:
    """Text with its `file`, None if it has none, and its `folder`, in which named files are searched.

    `version` is the editor's number of this state. `snippets` is true if the editor supports placeholders in
    completions. `vocabulary` has all constructors, including those of the editor's plugins.
    """

    text: str
    folder: Path
    file: Path | None = None
    version: int | None = None
    snippets: bool = False
    address: str = ""  # the URI by which an editor knows it
    earlier: Scene | None = field(default=None, compare=False, repr=False)  # scene of an earlier state, if compiled
    vocabulary: Vocabulary = field(default_factory=lambda: CATALOGUE, compare=False, repr=False)

    @property
    def uri(self) -> str:
        """URI by which the editor identifies the document."""
        return self.address or (self.file.absolute().as_uri() if self.file else "untitled:scene")

    @cached_property
    def source(self) -> Source:
        """Source text with its name for messages."""
        return Source(str(self.file) if self.file else "<text>", self.text)

    @property
    def is_too_large(self) -> bool:
        """Return whether the text exceeds the size limit of a scene, so that it is refused without further checks."""
        return len(self.text) > LARGEST

    @cached_property
    def tokens(self) -> list[Token]:
        """Tokens of the text, including invalid ones."""
        return [] if self.is_too_large else lex(self.text).tokens

    @property
    def comments(self) -> list[Comment]:
        """Comments of the text."""
        return [] if self.is_too_large else lex(self.text).comments

    @cached_property
    def tree(self) -> Tree:
        """Syntax tree of the declarations without syntax errors."""
        modules = self.table.modules
        return modules[0].tree if modules else Tree(())

    @cached_property
    def compiled(self) -> tuple[Scene, list[Diagnostic]]:
        """Scene as far as it can be compiled, and the diagnostics of compilation."""
        return compile_scene(self.source, self.folder, self.file, (), self.vocabulary)

    @property
    def read(self) -> Scene | None:
        """Compiled scene of this state, or that of an earlier state if this one is not compiled yet.

        It is meant for requests that must not wait.
        """
        return self.compiled[0] if "compiled" in self.__dict__ else self.earlier

    @property
    def known(self) -> Scene:
        """Compiled scene of this or an earlier state; if there is none, the text is compiled now."""
        return self.read or self.compiled[0]

    @property
    def check_result(self) -> tuple[Scene | None, list[Diagnostic]]:
        """Compiled scene, None if it has errors, and all diagnostics of `dsl check`; computed once, by any thread."""
        with CHECKING:
            return self._checked

    @cached_property
    def _checked(self) -> tuple[Scene | None, list[Diagnostic]]:
        scene, found = self.compiled
        return check_scene(scene, list(found))

    @property
    def available_diagnostics(self) -> list[Diagnostic]:
        """All diagnostics of `dsl check`, or those of compilation until the former are known.

        It is meant for requests that must not wait.
        """
        return self._checked[1] if "_checked" in self.__dict__ else self.compiled[1]

    @cached_property
    def table(self) -> ModuleTable:
        """Table of all readable names of the scene and of the scenes that it uses."""
        table = self.compiled[0].table
        return ModuleTable(self.vocabulary) if table is None else table

    @cached_property
    def scope(self) -> Scope:
        """Scope of the names, with the values of all valid parameters."""
        scope = Scope(self.table.with_diagnostics([]))
        evaluate_parameters(scope, {})
        return scope

    @cached_property
    def starts(self) -> list[int]:
        """Offsets of the first characters of the lines."""
        import re

        return [0, *(m.end() for m in re.finditer(BREAK, self.text))]

    def offset(self, position: Position) -> int:
        """Return the offset of a position; positions beyond a line or the text count as its end."""
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
        """Return the position (line and character) of an offset in the text."""
        from bisect import bisect_right

        line = bisect_right(self.starts, offset) - 1
        before = self.text[self.starts[line] : offset]
        return Position(line, len(before) + sum(ord(c) > 0xFFFF for c in before))

    def range(self, span: Span) -> Range:
        """Return the line and character range, as in the protocol, of a span of offsets."""
        return Range(self.position(span.start), self.position(span.end))
