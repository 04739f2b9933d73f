"""Lexer that converts text to tokens by the terminals of `scene.lark`.

Text that no terminal matches becomes a token of a kind in `JUNK`. To add a terminal: one line in `scene.lark`. To
recognise one more foreign habit: one line in `JUNK`, and one in `common_slips.py`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache, lru_cache
from typing import NamedTuple

from softmark.grammar.parse_table import Terminal, load, reserved_words
from softmark.grammar.tree import Comment, Span

BREAK = r"\r\n|\n|\r"
BLANK = "[ \t\f\v\u00a0\u2009\u202f]*+"  # with the no-break and thin spaces that typesetters put before a unit
COMMENT = r"\#[^\r\n]*"
VALUE_ENDS = frozenset({"NUMBER", "RPAR", "RSQB"})  # tokens that a unit may follow
# Tried last, except foreign comments, whose `/` would be an operator. None includes a line break.
JUNK = {
    "UNCLOSED_STRING": r'"[^\r\n]*',
    "SINGLE_QUOTED": r"'[^'\r\n]*'?",
    "COLON": ":=?",
    "SEMICOLON": ";+",
    "LBRACE": r"\{",
    "RBRACE": r"\}",
    "FOREIGN_WORD": r"[^\W\d]\w*",
    "ILLEGAL": r"[^\x00-\x7f]+|[\x00-\x09\x0b\x0c\x0e-\x1f\x7f]+|&+|\|+|\.+|.",
}
FOREIGN_COMMENTS = {"SLASHES": r"//[^\r\n]*", "BLOCK_COMMENT": r"/\*(?:[\s\S]*?\*/|[\s\S]*)"}


class Token(NamedTuple):
    """Word of the text: its kind is the name of its terminal, its place is given as in `Span`."""

    kind: str
    text: str
    start: int
    line: int
    column: int

    @property
    def end(self) -> int:
        """Offset in the text after the last character."""
        return self.start + len(self.text)

    @property
    def span(self) -> Span:
        """Span of the token; for a foreign comment over several lines, the span of its first line."""
        length = len(self.text)
        if self.kind == "BLOCK_COMMENT":
            length = len(re.split(BREAK, self.text, maxsplit=1)[0])
        return Span(self.start, self.start + length, self.line, self.column, self.line, self.column + length)


class Lexed(NamedTuple):
    """Tokens and comments of a text, in order."""

    tokens: list[Token]
    comments: list[Comment]


@lru_cache(maxsize=4)  # cached: an editor needs the same tokens as the parser; the lists are never modified
def lex(text: str) -> Lexed:
    """Return the tokens and comments of a text; every character that is not blank belongs to exactly one of them."""
    plain, after_value, kinds = _compile_patterns()
    words = reserved_words()
    lexed = Lexed([], [])
    add = lexed.tokens.append
    position = line_start = 1 if text.startswith("\ufeff") else 0
    line, kind = 1, ""
    while found := (after_value if kind in VALUE_ENDS else plain)(text, position):
        group = found.lastindex or 0
        kind = kinds[group]
        start, position = found.span(group)
        if kind == "NEWLINE":
            line, line_start = line + 1, position
            continue
        word = found[group]
        if kind == "COMMENT":
            lexed.comments.append(_comment(word, start, line, start - line_start + 1))
            continue
        if kind == "NAME":
            kind = words.get(word, kind)
        add(Token(kind, word, start, line, start - line_start + 1))
        if kind == "BLOCK_COMMENT":
            for newline in re.finditer(BREAK, word):
                line, line_start = line + 1, start + newline.end()
    return lexed


def _comment(word: str, start: int, line: int, column: int) -> Comment:
    word = word.rstrip(" \t")
    return Comment(word, Span(start, start + len(word), line, column, line, column + len(word)))


Scan = Callable[[str, int], "re.Match[str] | None"]


@cache
def _compile_patterns() -> tuple[Scan, Scan, list[str]]:
    """Return a pattern for most positions, a pattern for positions of a unit, and the token kinds of their groups."""
    terminals = sorted(load().terminals, key=_terminal_sort_key)
    kinds = {"NEWLINE": BREAK, "COMMENT": COMMENT} | FOREIGN_COMMENTS
    kinds |= {t.name: t.pattern for t in terminals if not t.literal.isalpha() and t.name != "UNIT"} | JUNK
    unit = next(t.pattern for t in terminals if t.name == "UNIT")
    not_reserved = rf"(?!(?:{'|'.join(reserved_words())})\b)"
    rest = "|".join(f"({pattern})" for pattern in kinds.values())
    plain = re.compile(f"{BLANK}(?:((?!))|{rest})")
    after_value = re.compile(f"{BLANK}(?:({not_reserved}{unit})|{rest})")
    return plain.match, after_value.match, ["", "UNIT", *kinds]


def _terminal_sort_key(terminal: Terminal) -> tuple[int, bool, int]:
    return -terminal.priority, bool(terminal.literal), -len(terminal.literal)
