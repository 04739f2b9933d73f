"""Outline and folding ranges: `textDocument/documentSymbol`, `foldingRange`, `workspace/symbol`."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

from lsprotocol import types
from lsprotocol.types import FoldingRangeKind, SymbolKind

from softmark.grammar import tree
from softmark.grammar.statement_splitting import declarations
from softmark.interpreter.language_server.open_documents import OpenDocuments
from softmark.interpreter.language_server.text_document import Document

PARAGRAPH = 3  # minimum number of lines of a fold
KINDS = {  # icon of each kind in editors
    "use": SymbolKind.Module, "param": SymbolKind.Constant, "expect": SymbolKind.Boolean,
    "material": SymbolKind.Class, "shape": SymbolKind.Struct, "body": SymbolKind.Object, "region": SymbolKind.Array,
    "support": SymbolKind.Key, "contact": SymbolKind.Interface, "load": SymbolKind.Event,
    "analysis": SymbolKind.Operator, "model": SymbolKind.Function, "reference": SymbolKind.Enum,
    "probe": SymbolKind.Field, "metric": SymbolKind.Number, "study": SymbolKind.Method,
}  # fmt: skip


def symbols(document: Document, params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
    """Return every declaration with its kind and constructor, in the order of the text."""
    return [_symbol(document, node) for node in document.tree.declarations if _outline_name(node)]


def find_workspace_symbols(opened: OpenDocuments, params: types.WorkspaceSymbolParams) -> list[types.WorkspaceSymbol]:
    """Return the declarations of all open scenes whose names contain the letters of the query, in order."""
    return [
        types.WorkspaceSymbol(types.Location(uri, document.range(name[1])), name[0], _symbol_kind(node))
        for uri, document in opened.documents.items()
        for node in document.tree.declarations
        if (name := _outline_name(node)) and params.query.lower() in name[0].lower()
    ]


def folds(document: Document, params: types.FoldingRangeParams) -> list[types.FoldingRange]:
    """Return the folding ranges of a text, which may have errors.

    These are declarations and comments of several lines, and paragraphs below a comment.
    """
    found = {start: types.FoldingRange(start, end, kind=kind) for start, end, kind in _folds(document) if end > start}
    return [found[start] for start in sorted(found)]


def _symbol(document: Document, node: tree.Declaration) -> types.DocumentSymbol:
    name, at = _outline_name(node) or ("", node.span)
    return types.DocumentSymbol(name, _symbol_kind(node), document.range(node.span), document.range(at), _detail(node))


def _outline_name(node: tree.Declaration) -> tuple[str, tree.Span] | None:
    """Return the name of a declaration in an outline and its place; None for the version and the title."""
    match node:
        case tree.Use():
            return node.alias, node.alias_span
        case tree.Param() | tree.Declare():
            return node.name, node.name_span
        case tree.Expect():
            from softmark.grammar.source_layout import format_on_one_line

            return format_on_one_line(node.condition), node.condition.span
    return None


def _symbol_kind(node: tree.Declaration) -> SymbolKind:
    word = node.kind if isinstance(node, tree.Declare) else type(node).__name__.lower()
    return KINDS.get(word, SymbolKind.Variable)


def _detail(node: tree.Declaration) -> str:
    match node:
        case tree.Use():
            return f'use "{node.path}"'
        case tree.Declare(value=tree.Call() as call):
            return f"{node.kind}, {call.function.text}"
        case tree.Declare():
            return node.kind
        case tree.Param(value=tree.Number() as number):
            return f"{number.text} {number.unit.text}" if number.unit else number.text
    return type(node).__name__.lower()


# ------------------------------------------------------------------ folding


def _folds(document: Document) -> Iterator[tuple[int, int, FoldingRangeKind | None]]:
    """Yield first and last lines, from 0, of folding ranges; of several that start in a line the last counts."""
    spans = [(c.tokens[0].span, c.tokens[-1].span) for c in declarations(document.tokens)]
    own = [(first.line - 1, last.end_line - 1) for first, last in spans]
    comments = [(c.span.line - 1, c.span.line - 1) for c in document.tree.comments if _is_full_line(document, c)]
    yield from _paragraphs(comments, own)
    for lines in _consecutive_groups(comments):
        yield lines[0][0], lines[-1][0], FoldingRangeKind.Comment
    for first, last in own:
        yield first, last, FoldingRangeKind.Region


def _is_full_line(document: Document, comment: tree.Comment) -> bool:
    """Return whether a comment is alone on its line."""
    return not document.text[document.starts[comment.span.line - 1] : comment.span.start].strip("\ufeff \t\f\v")


def _consecutive_groups(lines: list[tuple[int, int]]) -> Iterator[list[tuple[int, int]]]:
    """Yield groups of consecutive lines without a gap."""
    for _, run in groupby(enumerate(lines), key=lambda pair: pair[1][0] - pair[0]):
        yield [line for _, line in run]


def _paragraphs(
    comments: list[tuple[int, int]], own: list[tuple[int, int]]
) -> Iterator[tuple[int, int, FoldingRangeKind | None]]:
    """Yield the lines below a comment, up to the next empty line or full-line comment."""
    starts = dict(own)
    for run in _consecutive_groups(comments):
        end = run[-1][0]
        while end + 1 in starts:
            end = starts[end + 1]
        if end - run[0][0] + 1 >= PARAGRAPH and end > run[-1][0]:
            yield run[-1][0], end, None
