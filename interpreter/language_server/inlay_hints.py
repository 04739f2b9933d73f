"""Inlay hints, which editors show after parts of the text: `textDocument/inlayHint`.

They give the SI values of parameters and arguments written in another unit or as an expression, and the last results of
expectations and metrics (`measured_values.py`).
"""

from __future__ import annotations

from collections.abc import Iterator

from lsprotocol import types

from softmark.grammar import tree
from softmark.interpreter.language import units
from softmark.interpreter.language.expression_evaluation import EvaluationError, Evaluator
from softmark.interpreter.language.field_schema import Vocabulary
from softmark.interpreter.language_server.declared_names import format_in_si
from softmark.interpreter.language_server.measured_values import MeasuredHint, find_last_report
from softmark.interpreter.language_server.name_index import field_of, fields_of
from softmark.interpreter.language_server.text_document import Document

NUMBERS = frozenset({"quantity", "vector", "list", "each", "amount", "amounts", "integer"})  # forms with a value in SI
DIGITS = 6


def hints(document: Document, params: types.InlayHintParams) -> list[types.InlayHint]:
    """Return the inlay hints in the requested range of lines."""
    first, last = params.range.start.line, params.range.end.line
    nodes = [n for n in document.tree.declarations if n.span.line - 1 <= last and n.span.end_line - 1 >= first]
    found = [*_si_value_hints(document, nodes), *_result_hints(document, nodes)]
    return [hint for hint in found if first <= hint.position.line <= last]


# ------------------------------------------------------------------ values in SI


def _si_value_hints(document: Document, nodes: list[tree.Declaration]) -> Iterator[types.InlayHint]:
    """Yield hints such as `= 0.178 m` after values that are not written in SI units."""
    scope = document.scope  # with its own diagnostics, since those of the scene may be full
    table = scope.table
    if not table.modules:
        return
    evaluator = scope.evaluator(table.modules[0])
    for node in nodes:
        for expression in _numeric_expressions(node, table.vocabulary):
            if said := _si_value_text(expression, evaluator):
                at = document.position(expression.span.end)
                yield types.InlayHint(at, f"= {said}", padding_left=True, tooltip="in SI units")


def _numeric_expressions(node: tree.Declaration, vocabulary: Vocabulary) -> Iterator[tree.Expression]:
    """Yield the expressions of a declaration that have numeric values."""
    if isinstance(node, tree.Param):
        yield node.value
    elif isinstance(node, tree.Declare) and isinstance(node.value, tree.Call):
        yield from _numeric_arguments(node.value, vocabulary, node.kind)


def _numeric_arguments(node: tree.Call, vocabulary: Vocabulary, kind: str) -> Iterator[tree.Expression]:
    fields = fields_of(node, vocabulary, kind)
    for place, argument in enumerate(node.arguments):
        field = field_of(fields, argument, place)
        if field is None:
            continue
        if field.form in NUMBERS:
            yield argument.value
        elif isinstance(argument.value, tree.Call):
            yield from _numeric_arguments(argument.value, vocabulary, field.kind)


def _si_value_text(node: tree.Expression, evaluator: Evaluator) -> str:
    """Return the SI value of an expression; empty if it is written in SI units or cannot be evaluated."""
    if _is_plain_si_value(node):
        return ""
    try:
        value = evaluator.values(node) if isinstance(node, tree.List) else evaluator.value(node)
    except EvaluationError:
        return ""
    return format_in_si(value, DIGITS)


def _is_plain_si_value(node: tree.Expression) -> bool:
    """Return whether an expression consists of one or several numbers in SI units."""
    match node:
        case tree.Number():
            return _is_si_unit(node.unit)
        case tree.Unary(operand=operand):
            return _is_plain_si_value(operand)
        case tree.Vector() | tree.List():
            return _is_si_unit(node.unit) and all(_is_plain_si_value(item) for item in node.items)
    return False


def _is_si_unit(unit: tree.Unit | None) -> bool:
    if unit is None:
        return True
    try:
        return units.parse_unit(unit.text).factor == 1.0
    except units.UnitError:
        return True


# ------------------------------------------------------------------ measured values


def _result_hints(document: Document, nodes: list[tree.Declaration]) -> Iterator[types.InlayHint]:
    """Yield the last report's results of expectations and metrics, at the ends of their lines."""
    known = find_last_report(document) if any(isinstance(n, tree.Expect | tree.Declare) for n in nodes) else None
    if known is None:
        return
    for node in nodes:
        try:
            found = known.of(document, node)
        except (AttributeError, KeyError, TypeError, ValueError):  # malformed report of another program
            continue
        if found is not None:
            yield _end_of_line_hint(document, node, found)


def _end_of_line_hint(document: Document, node: tree.Declaration, found: MeasuredHint) -> types.InlayHint:
    at = document.position(document.starts[node.span.end_line - 1])
    end = document.position(document.offset(types.Position(at.line, 1_000_000)))
    more = types.MarkupContent(types.MarkupKind.Markdown, found.more)
    return types.InlayHint(end, f"  {found.text}", padding_left=True, tooltip=more)
