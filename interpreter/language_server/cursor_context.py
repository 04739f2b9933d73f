"""Context of the cursor in a text: the current word, its declaration, and the open calls.

The module uses only tokens and no parser, since a declaration that is being written is incomplete.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from functools import cached_property

from softmark.grammar.lexer import Token
from softmark.grammar.statement_splitting import CLOSERS, OPENERS, UNFINISHED, Chunk, declarations
from softmark.interpreter.language.field_schema import Constructor, Field
from softmark.interpreter.language_server.text_document import Document

STRINGS = frozenset({"STRING", "UNCLOSED_STRING"})
NAMES = frozenset({"NAME", "PATH"})
SEPARATORS = frozenset({"COMMA", "SEMICOLON"})


@dataclass(frozen=True)
class OpenBracket:
    """Open bracket of a call of `function`, or of a group or a list.

    `place` is the number of arguments before the current one, `name` the current argument's name, if any, and `value`
    its tokens so far; `given` are the fields named in other arguments of the call.
    """

    opener: Token
    function: str
    constructor: Constructor | None
    place: int
    name: str
    value: tuple[Token, ...]
    given: frozenset[str]

    @property
    def field(self) -> Field | None:
        """Field that the current argument sets."""
        if self.constructor is None:
            return None
        if self.name:
            return self.constructor.field(self.name)
        return self.constructor.fields[self.place] if self.place < len(self.constructor.fields) else None


@dataclass(frozen=True)
class CursorContext:
    """Cursor position: the `word` that ends there, its `start`, and the preceding tokens of the declaration.

    `text` is the part of a quoted text before the cursor, None outside quotes.
    """

    document: Document
    offset: int
    start: int
    word: str
    before: tuple[Token, ...]
    text: str | None = None

    @cached_property
    def frames(self) -> tuple[OpenBracket, ...]:
        """Open brackets around the cursor, the innermost last."""
        found: list[OpenBracket] = []
        opened = _open_bracket_indices(self.before)[-DEEPEST:]
        for index in opened:
            later = _arguments_after_cursor(self) if index == opened[-1] else []
            found.append(_describe_open_bracket(self, index, found, later))
        return tuple(found)

    @property
    def kind(self) -> str:
        """Kind of the current declaration, which is its first word; empty at its start."""
        return self.before[0].text if self.before else ""

    @property
    def is_after_equals(self) -> bool:
        """True if the cursor is after `kind NAME =`."""
        return [t.kind for t in self.before[:3]] == ["NAME", "NAME", "EQUAL"]

    @property
    def own(self) -> str:
        """Name that the current declaration declares, empty if none."""
        return self.before[1].text if self.is_after_equals or (self.kind == "param" and len(self.before) > 1) else ""

    @property
    def call(self) -> OpenBracket | None:
        """Innermost open call around the cursor, or None."""
        return next((frame for frame in reversed(self.frames) if frame.function), None)


def find_cursor_context(document: Document, offset: int) -> CursorContext | None:
    """Return the context of a position, or None inside a comment."""
    comments = document.comments
    last = bisect_left(comments, offset, key=lambda c: c.span.start) - 1
    if last >= 0 and offset <= comments[last].span.end:
        return None
    tokens = document.tokens
    count = bisect_left(tokens, offset, key=lambda t: t.start)  # tokens that start before the position
    start, text = offset, None
    if count and (token := tokens[count - 1]).end >= offset:
        if token.kind in STRINGS and (offset < token.end or token.kind == "UNCLOSED_STRING"):
            start, text, count = token.start + 1, document.text[token.start + 1 : offset], count - 1
        elif _is_word(token):
            start, count = token.start, count - 1
        elif token.text == "." and count > 1 and tokens[count - 2].kind in NAMES:
            start, count = tokens[count - 2].start, count - 2  # `rod.`, before anything of the next word
    before = _declaration_tokens(tokens[max(0, count - LONGEST) : count], tokens[count - 1 : count], document, start)
    return CursorContext(document, offset, start, document.text[start:offset], before, text)


LONGEST, DEEPEST = 2000, 20  # maximum number of tokens and of open brackets that are searched backwards


def _is_word(token: Token) -> bool:
    return token.kind in ("UNIT", "FOREIGN_WORD", *NAMES) or token.text.isalpha()


def _declaration_tokens(tokens: list[Token], last: list[Token], document: Document, start: int) -> tuple[Token, ...]:
    """Return the tokens of the declaration that continues at an offset; empty if a new one starts there."""
    if not tokens:
        return ()
    chunk = Chunk()
    for chunk in declarations(tokens):  # noqa: B007, the last one counts
        pass
    ended = not (chunk.unclosed or last[0].kind in UNFINISHED)
    new_line = any(c in document.text[last[0].end : start] for c in "\r\n")
    return () if ended and new_line else tuple(chunk.tokens)


def _open_bracket_indices(tokens: tuple[Token, ...]) -> list[int]:
    """Return the indices of the opening brackets that are not closed."""
    found: list[int] = []
    for index, token in enumerate(tokens):
        if token.kind in OPENERS:
            found.append(index)
        elif token.kind in CLOSERS and found:
            found.pop()
    return found


def _describe_open_bracket(
    here: CursorContext, index: int, outer: list[OpenBracket], later: list[tuple[Token, ...]]
) -> OpenBracket:
    """Return the open bracket with an index, described as far as it is written."""
    tokens = here.before
    called = index and tokens[index].kind == "LPAR" and tokens[index - 1].kind in NAMES
    function = tokens[index - 1].text if called else ""
    arguments = _arguments(tokens[index + 1 :])
    *earlier, current = arguments
    name, value = _split_argument(current)
    named = [_split_argument(argument)[0] for argument in (*earlier, *later)]
    constructor = _constructor(here, function, outer) if function else None
    return OpenBracket(
        tokens[index], function, constructor, len(earlier), name, value, frozenset(n for n in named if n)
    )


def _arguments(tokens: tuple[Token, ...]) -> list[tuple[Token, ...]]:
    """Split the tokens of an open bracket at its commas, ignoring commas of inner brackets."""
    found: list[list[Token]] = [[]]
    depth = 0
    for token in tokens:
        depth += (token.kind in OPENERS) - (token.kind in CLOSERS)
        if token.kind in SEPARATORS and depth == 0:
            found.append([])
        else:
            found[-1].append(token)
    return [tuple(argument) for argument in found]


def _arguments_after_cursor(here: CursorContext) -> list[tuple[Token, ...]]:
    """Return the arguments after the cursor, up to the closing bracket or the end of the line."""
    tokens = here.document.tokens
    first = bisect_left(tokens, here.offset, key=lambda t: t.start)
    found, depth = [], 0
    for token in tokens[first : first + LONGEST]:
        depth += (token.kind in OPENERS) - (token.kind in CLOSERS)
        if depth < 0 or (here.before and token.line != here.before[-1].line and token.column == 1):
            break
        found.append(token)
    return _arguments(tuple(found))[1:]


def _split_argument(argument: tuple[Token, ...]) -> tuple[str, tuple[Token, ...]]:
    """Return the name of an argument, empty if none, and its value."""
    if len(argument) > 1 and argument[0].kind == "NAME" and argument[1].kind == "EQUAL":
        return argument[0].text, argument[2:]
    return "", argument


def _constructor(here: CursorContext, function: str, outer: list[OpenBracket]) -> Constructor | None:
    """Return the constructor that a call names.

    If several kinds have a constructor of this name, that of the expected kind is used, or else the first.
    """
    call = next((frame for frame in reversed(outer) if frame.function), None)
    field = call.field if call else None
    kind = field.kind if field else here.kind
    words = here.document.vocabulary
    made = words.constructor(kind, function) if kind in words else None
    return made or next(iter(words.find(function)), None)
