"""Parameters that sweeps vary, and their values, each with its text and its place."""

from __future__ import annotations

from dataclasses import field, replace
from typing import TYPE_CHECKING

from softmark.grammar import source_layout, tree
from softmark.grammar.diagnostic import suggest_text
from softmark.grammar.tree import Expression, Span
from softmark.interpreter.language import parameter_overrides, units
from softmark.interpreter.language.compiled_scene import Location
from softmark.interpreter.language.expression_evaluation import EvaluationError, SourceErrors
from softmark.interpreter.language.parameter_overrides import Override
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.call_binding import Binder
    from softmark.interpreter.language.field_schema import Field


@dataclass(frozen=True)
class SweepTarget:
    """Parameter or field that a sweep varies.

    `name` is its name with the prefix of its scene, for a field `declared.field`.
    """

    name: str
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True)
class Variant:
    """One value of a sweep: its text with unit, as an override takes it, and its place."""

    text: str
    node: Expression = field(compare=False, repr=False)
    at: Location = field(compare=False, repr=False)


def read_sweep_target(
    binder: Binder, field: Field, node: tree.Expression, place: SourceErrors, written: str = ""
) -> SweepTarget:
    """Parse the target of a sweep; `written` is how the user writes the study, for messages. Raises EvaluationError."""
    if not isinstance(node, tree.Name):
        raise place.error("E207", node.span, f"expected {field.expected}, found a value",
                         "not a name", field.meaning)  # fmt: skip
    table = binder.compiler.table
    full = binder.module.prefix + node.text
    override = Override(full, node, place, node.span, written=written or "sweep({}, over = [...])")
    if not parameter_overrides.assign_overrides([override], table):
        raise EvaluationError
    owner = full if full in table.symbols else full.rpartition(".")[0]
    binder.compiler.scope.use(owner)
    return SweepTarget(full, node.span)


def read_sweep_targets(
    binder: Binder, field: Field, node: tree.Expression, place: SourceErrors
) -> tuple[SweepTarget, ...]:
    """Parse the parameters that a robustness study varies. Raises EvaluationError after checking all of them."""
    if not isinstance(node, tree.List) or node.unit is not None:
        help = (
            suggest_text(f"[{source_layout.format_on_one_line(node)}]")
            if isinstance(node, tree.Name)
            else field.meaning
        )
        raise place.error("E207", node.span, f"expected {field.expected}, found no list of names", "not a list", help)
    if not node.items:
        raise place.error("E512", node.span, "the study varies nothing", "an empty list",
                         "name what to vary, or remove `over`, which varies every number")  # fmt: skip
    found = [_read_robustness_target(binder, field, item, place) for item in node.items]
    if None in found:
        raise EvaluationError
    return tuple(t for t in found if t is not None)


def _read_robustness_target(
    binder: Binder, field: Field, item: tree.Expression, place: SourceErrors
) -> SweepTarget | None:
    try:
        return read_sweep_target(binder, field, item, place, "robustness(over = [{}])")
    except EvaluationError:
        return None


def read_variants(binder: Binder, field: Field, node: tree.Expression, place: SourceErrors) -> tuple[Variant, ...]:
    """Parse the values of a sweep; the unit behind the bracket is added to each. Raises EvaluationError."""
    if not isinstance(node, tree.List):
        help = f"write `[{source_layout.format_on_one_line(node)}, ...]`"
        raise place.error("E207", node.span, f"expected {field.expected}, found no list", "not a list", help)
    if not node.items:
        raise place.error("E510", node.span, "the sweep has no values", "an empty list", "write `[10, 5, 2.5] mm`")
    names = [n.text for item in node.items for n, _ in tree.walk(item) if isinstance(n, tree.Name)]
    table = binder.compiler.table
    for name in names:
        if name in table.symbols:
            binder.compiler.scope.use(name)
    known: tuple[tree.Expression, tuple[Variant, ...]] | None = table.listed.get(id(node))
    if known is None or known[0] is not node:  # for instance in a copy of the table, with other list indices
        # each value is checked by compiling the whole scene again
        known = table.listed[id(node)] = (
            node,
            tuple(_read_sweep_value(binder, item, node.unit, place) for item in node.items),
        )
    return known[1]


def _read_sweep_value(binder: Binder, item: tree.Expression, unit: tree.Unit | None, place: SourceErrors) -> Variant:
    whole = item
    if unit is not None and _is_number_without_unit(binder, item, place):
        whole = with_unit(item, unit)
    return Variant(source_layout.format_on_one_line(whole), whole, Location(place.source, item.span))


def _is_number_without_unit(binder: Binder, item: tree.Expression, place: SourceErrors) -> bool:
    """Return whether a value in a list with a unit is a number without a unit of its own.

    Raises EvaluationError if it is not a number.
    """
    value = binder.compiler.scope.evaluator(binder.module, place).quantity(item)
    return value.dimension == units.NONE


def with_unit(item: tree.Expression, unit: tree.Unit) -> tree.Expression:
    """Return the expression with a unit: `10` as `10 mm`, `-10` as `-10 mm`, `2 * 5` as `2 * 5 * 1 mm`."""
    match item:
        case tree.Number(unit=None):
            return replace(item, unit=unit)
        case tree.Unary(operator="-" | "+", operand=tree.Number(unit=None) as number):
            return replace(item, operand=replace(number, unit=unit))
        case _:
            return tree.Binary("*", item, tree.Number(1.0, unit, "1", item.span), item.span)
