"""Division of a scene into words with the role of each, by the lexer of the language."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from softmark.grammar.lexer import FOREIGN_COMMENTS, JUNK, Token, lex
from softmark.interpreter.language_server.syntax_highlighting.highlighted_words import words

PLAIN = {"NUMBER": "number", "UNIT": "unit", "STRING": "string"}
BRACKETS = {"LPAR", "RPAR", "LSQB", "RSQB", "COMMA"}


class Part(NamedTuple):
    """Piece of a scene's text with its role, such as keyword or number."""

    start: int
    text: str
    role: str


def parts(text: str) -> list[Part]:
    """Return all words and comments of a text in order, without blanks; invalid characters have the role `error`."""
    lexed = lex(text)
    comments = [Part(c.span.start, c.text, "comment") for c in lexed.comments]
    return sorted([*comments, *_words(lexed.tokens)])


def _words(tokens: list[Token]) -> Iterator[Part]:
    for place, token in enumerate(tokens):
        following = tokens[place + 1] if place + 1 < len(tokens) else None
        before = tokens[place - 1] if place else None
        yield Part(token.start, token.text, _role(token, before, following))


def _role(token: Token, before: Token | None, following: Token | None) -> str:
    if token.kind in JUNK or token.kind in FOREIGN_COMMENTS:
        return "error"
    if token.kind in ("NAME", "PATH"):
        return _of_name(token, before, following.kind if following else "")
    if token.text in words().reserved:
        return "reserved"
    return PLAIN.get(token.kind) or ("bracket" if token.kind in BRACKETS else "operator")


def _of_name(token: Token, before: Token | None, following: str) -> str:
    own = words()
    first = before is None or before.line < token.line
    if first and token.text in own.kinds and following == "NAME":
        return "kind"
    if before is not None and before.kind in ("NAME", "PARAM", "AS"):
        return "declared"
    if following == "LPAR":
        return "constructor" if token.text in own.constructors else "function"
    if following == "EQUAL":
        return "field"
    return "constant" if token.text in own.constants else "name"
