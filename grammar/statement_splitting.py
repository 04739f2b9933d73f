"""Splitting of the tokens of a text into declarations before parsing, so that errors affect only one declaration."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from softmark.grammar.lexer import Token

MAX_NESTING = 100  # brackets within brackets
OPENERS = {"LPAR": "RPAR", "LSQB": "RSQB", "LBRACE": "RBRACE"}
CLOSERS = frozenset(OPENERS.values())
WORDS = frozenset({"SOFTMARK", "SCENE", "USE", "PARAM", "EXPECT"})  # reserved words that open a declaration
# after one of these at the end of a line, a declaration goes on
UNFINISHED = frozenset({"SIGN", "TIMES", "CIRCUMFLEX", "COMPARE", "EQUAL", "RANGE", "AND", "OR", "NOT", "IN", "AS"})


@dataclass(slots=True)
class Chunk:
    """Tokens of one declaration, the brackets that it leaves open, and the first bracket that is nested too deeply."""

    tokens: list[Token] = field(default_factory=list)
    unclosed: list[Token] = field(default_factory=list)
    too_deep: Token | None = None

    def add(self, token: Token) -> None:
        """Append a token and count the brackets; a closing bracket without an opening one is not counted."""
        self.tokens.append(token)
        if token.kind in OPENERS:
            self.unclosed.append(token)
            if len(self.unclosed) > MAX_NESTING and not self.too_deep:
                self.too_deep = token
        elif token.kind in CLOSERS and self.unclosed:
            self.unclosed.pop()


def declarations(tokens: Sequence[Token]) -> Iterator[Chunk]:
    """Yield the tokens of each declaration of a text."""
    chunk = Chunk()
    for i, token in enumerate(tokens):
        if chunk.tokens and _starts_next_chunk(chunk, tokens, i):
            yield chunk
            chunk = Chunk()
        chunk.add(token)
    if chunk.tokens:
        yield chunk


def single_chunk(tokens: Sequence[Token]) -> Chunk:
    """Return all tokens as the chunk of one declaration."""
    chunk = Chunk()
    for token in tokens:
        chunk.add(token)
    return chunk


def _starts_next_chunk(chunk: Chunk, tokens: Sequence[Token], i: int) -> bool:
    last = chunk.tokens[-1]
    if last.line == tokens[i].line:
        return False
    return starts_declaration(tokens, i) or not (chunk.unclosed or last.kind in UNFINISHED)


def starts_declaration(tokens: Sequence[Token], i: int) -> bool:
    """Return whether `tokens[i:]` look like the start of a declaration: a reserved word, or `NAME NAME =`."""
    if tokens[i].kind in WORDS:
        return True
    three = tokens[i : i + 3]
    return [token.kind for token in three] == ["NAME", "NAME", "EQUAL"] and three[0].line == three[2].line
