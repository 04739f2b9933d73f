"""Semantic tokens, which give the role of each word for highlighting: `textDocument/semanticTokens`.

Words of declarations with errors are classified only lexically: reserved words, numbers, texts, units and comments.
"""

from __future__ import annotations

from collections.abc import Iterator

from lsprotocol import types
from lsprotocol.types import SemanticTokenModifiers as Modifier
from lsprotocol.types import SemanticTokenTypes as Kind

from softmark.grammar import tree
from softmark.grammar.lexer import Token
from softmark.grammar.statement_splitting import WORDS
from softmark.grammar.tree import Span
from softmark.interpreter.language.expression_evaluation import CONSTANTS, COORDINATES
from softmark.interpreter.language_server.name_index import ALIAS, occurrences
from softmark.interpreter.language_server.text_document import Document

KINDS = [Kind.Keyword, Kind.Variable, Kind.Parameter, Kind.Namespace, Kind.Function, Kind.Property, Kind.EnumMember,
         Kind.Number, Kind.String, Kind.Type, Kind.Operator, Kind.Comment]  # fmt: skip
PLACES = {kind: place for place, kind in enumerate(KINDS)}
MODIFIERS = [Modifier.Declaration, Modifier.Readonly, Modifier.DefaultLibrary]
LEGEND = types.SemanticTokensLegend([str(kind.value) for kind in KINDS], [str(one.value) for one in MODIFIERS])
LOOKS = {  # roles by kind of token
    **dict.fromkeys([*WORDS, "AS", "IN", "AND", "OR", "NOT"], Kind.Keyword),
    **dict.fromkeys(["SIGN", "TIMES", "CIRCUMFLEX", "COMPARE", "EQUAL", "RANGE"], Kind.Operator),
    "NUMBER": Kind.Number, "STRING": Kind.String, "UNCLOSED_STRING": Kind.String, "UNIT": Kind.Type,
}  # fmt: skip
NAMED = frozenset({"NAME", "PATH", "UNIT"})  # kinds of tokens whose role depends on context
Role = tuple[Kind, int]  # a kind, and modifiers as bits


def colours(document: Document, params: types.SemanticTokensParams) -> types.SemanticTokens:
    """Return the semantic tokens of the whole text."""
    return types.SemanticTokens(_encode_tokens(document, _word_roles(document)))


def colours_between(document: Document, params: types.SemanticTokensRangeParams) -> types.SemanticTokens:
    """Return the semantic tokens of the lines of a range."""
    first, last = params.range.start.line + 1, params.range.end.line + 1
    return types.SemanticTokens(
        _encode_tokens(document, [w for w in _word_roles(document) if first <= w[0].line <= last])
    )


def _word_roles(document: Document) -> list[tuple[Span, Role]]:
    """Return the words with their roles, in the order of the text; none extends beyond its line."""
    meant = {**dict(reversed(list(_declaration_roles(document)))), **dict(_name_roles(document))}
    found = [pair for token in document.tokens for pair in _roles_of_token(token, meant)]
    found += [(comment.span, (Kind.Comment, 0)) for comment in document.tree.comments]
    return sorted((pair for pair in found if pair[0].line == pair[0].end_line), key=lambda pair: pair[0].start)


def _roles_of_token(token: Token, meant: dict[int, tuple[Span, Role]]) -> Iterator[tuple[Span, Role]]:
    """Yield the known roles of the parts of a token, or else its lexical role."""
    places = range(token.start, token.end) if token.kind in NAMED else ()
    parts = [meant[place] for place in places if place in meant]
    if parts:
        yield from parts
    elif (kind := LOOKS.get(token.kind)) is not None:
        yield token.span, (kind, 0)


def _declaration_roles(document: Document) -> Iterator[tuple[int, tuple[Span, Role]]]:
    """Yield roles of words in parsed declarations, by their offsets; the first role of an offset counts."""
    for node in document.tree.declarations:
        if isinstance(node, tree.Declare):
            yield node.kind_span.start, (node.kind_span, (Kind.Keyword, 0))
        for expression in tree.expressions(node):
            for part, _ in tree.walk(expression):
                yield from _roles_of_expression_part(part)


def _name_roles(document: Document) -> Iterator[tuple[int, tuple[Span, Role]]]:
    """Yield the names of the scene, by their offsets."""
    table = document.table
    for one in occurrences(table, table.modules[0]) if table.modules else ():
        kind = {ALIAS: Kind.Namespace, "param": Kind.Parameter}.get(one.target.kind, Kind.Variable)
        yield one.span.start, (one.span, (kind, _bits(Modifier.Declaration) if one.declares else 0))


def _roles_of_expression_part(part: tree.Expression | tree.Argument) -> Iterator[tuple[int, tuple[Span, Role]]]:
    """Yield roles in a part of an expression: constructors, functions, fields, and names that the scene lacks."""
    if isinstance(part, tree.Argument) and part.name_span is not None:
        yield part.name_span.start, (part.name_span, (Kind.Property, 0))
    elif isinstance(part, tree.Name):
        known = part.text in (*COORDINATES, *CONSTANTS)
        yield part.span.start, (part.span, (Kind.EnumMember, _bits(Modifier.Readonly) if known else 0))
    elif isinstance(part, tree.Call):
        span = part.function.span
        yield span.start, (span, (Kind.Function, _bits(Modifier.DefaultLibrary)))


def _bits(*modifiers: Modifier) -> int:
    return sum(1 << MODIFIERS.index(modifier) for modifier in modifiers)


def _encode_tokens(document: Document, words: list[tuple[Span, Role]]) -> list[int]:
    """Encode words as in the protocol, with five numbers each.

    These are line and column relative to the word before, length, kind, and modifiers.
    """
    plain = max(document.text, default="") <= "\uffff" and not document.text.startswith("\ufeff")
    numbers: list[int] = []
    line = column = 0
    for span, (kind, modifiers) in words:
        here, first, end = span.line - 1, span.column - 1, span.end_column - 1
        if not plain:  # the protocol counts columns differently
            first, end = document.position(span.start).character, document.position(span.end).character
        numbers += [here - line, first - (column if here == line else 0), end - first, PLACES[kind], modifiers]
        line, column = here, first
    return numbers
