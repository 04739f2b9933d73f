"""Completion of units after a number, by the dimension that is expected there."""

from __future__ import annotations

from collections.abc import Iterator

from lsprotocol.types import CompletionItemKind as Kind

from softmark.grammar.lexer import Token
from softmark.grammar.statement_splitting import CLOSERS, OPENERS
from softmark.interpreter.help.display_units import common_units, describe_unit, units_of
from softmark.interpreter.language import units
from softmark.interpreter.language.expression_evaluation import FUNCTIONS
from softmark.interpreter.language.field_schema import Field
from softmark.interpreter.language.units import Dimension
from softmark.interpreter.language_server.completion_items import CompletionOffer
from softmark.interpreter.language_server.cursor_context import NAMES, CursorContext, OpenBracket
from softmark.interpreter.language_server.declared_names import dimension

WITH_DIMENSION = frozenset({"quantity", "vector", "list", "each", "points", "vectors"})  # forms of fields
PRODUCTS = frozenset({"TIMES", "CIRCUMFLEX"})


def follows_number(here: CursorContext) -> bool:
    """Return whether a unit may follow at the cursor, after a number, a vector or a list on the same line."""
    if not here.before or any(c in here.document.text[here.before[-1].end : here.start] for c in "\r\n"):
        return False
    last = here.before[-1]
    return last.kind == "NUMBER" or (last.kind in ("RPAR", "RSQB") and not _ends_call(here.before))


def _ends_call(tokens: tuple[Token, ...]) -> bool:
    """Return whether the bracket that ends the tokens is that of a call."""
    depth = 0
    for index in range(len(tokens) - 1, -1, -1):
        depth += (tokens[index].kind in CLOSERS) - (tokens[index].kind in OPENERS)
        if depth == 0:
            return index > 0 and tokens[index].kind == "LPAR" and tokens[index - 1].kind in NAMES
    return False


def units_at(here: CursorContext) -> Iterator[CompletionOffer]:
    """Yield the units of the expected dimension, or the usual units of all dimensions if any is allowed."""
    due = expected_dimension(here)
    for unit in units_of(due) if due is not None else (unit for unit, _ in common_units()):
        yield CompletionOffer(unit, Kind.Unit, describe_unit(unit))


def expected_dimension(here: CursorContext) -> Dimension | None:
    """Return the dimension that a number at the cursor must have, or None if any is allowed."""
    for frame in reversed(here.frames):
        if any(token.kind in PRODUCTS for token in frame.value):
            return None
        if frame.function and frame.constructor is None:
            if frame.function in FUNCTIONS and (taken := FUNCTIONS[frame.function][1]) is not None:
                return taken
            if frame.function not in ("abs", "min", "max"):
                return None
        elif frame.function:
            return _dimension_of_field(here, frame)
    return _dimension_of_statement(here)


def _dimension_of_field(here: CursorContext, frame: OpenBracket) -> Dimension | None:
    field = frame.field
    if field is None:
        return None
    if field.form in WITH_DIMENSION:
        return field.dimension
    if field.form == "condition":
        return units.LENGTH
    if field.form == "integer":
        return units.NONE
    return _dimension_of_study_target(here, frame, field) if field.form == "variants" else None


def _dimension_of_study_target(here: CursorContext, frame: OpenBracket, field: Field) -> Dimension | None:
    """Return the dimension of the parameter or field that a sweep varies."""
    tokens = here.before[here.before.index(frame.opener) + 1 :]
    name = next((t.text for t in tokens if t.kind in NAMES and t.text not in ("target", "over")), "")
    found = dimension(here.document, name)
    owner, _, own = name.rpartition(".")
    known = here.document.known.declared.get(owner)
    meant = known.constructor.field(own) if found is None and known is not None else None
    return found if meant is None else meant.dimension


def _dimension_of_statement(here: CursorContext) -> Dimension | None:
    """Return the dimension expected in a parameter or an expectation.

    For a parameter it is that of its value, for an expectation that of the other side of the comparison.
    """
    if any(token.kind in PRODUCTS for token in here.before):
        return None
    for token in here.before[2:] if here.kind == "param" else here.before[1:]:
        if token.kind == "UNIT":
            try:
                return units.parse_unit(token.text).dimension
            except units.UnitError:
                continue
        if token.kind in NAMES and (found := dimension(here.document, token.text)) is not None:
            return found
    return None
