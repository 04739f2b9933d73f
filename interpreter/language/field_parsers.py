"""Parsers of fields with a syntax of their own: amounts, lists of texts, points or vectors, sweep targets.

The module also checks whole calls: values that do not fit together, and alternatives of which exactly one must be
given.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from softmark.grammar import tree
from softmark.interpreter.language import sweep_values, units
from softmark.interpreter.language.compiled_scene import is_rigid
from softmark.interpreter.language.coordinate_conditions import EVERYWHERE
from softmark.interpreter.language.expression_evaluation import (
    COORDINATES,
    EvaluationError,
    Quantity,
    SourceErrors,
    VectorValue,
    describe_expression,
)
from softmark.interpreter.language.field_schema import Constructor, Field
from softmark.ranges import InvalidCombination
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.call_binding import Binder, Bound

Read = Callable[["Binder", Field, tree.Expression, SourceErrors], Any]


def parse_amount(binder: Binder, field: Field, node: tree.Expression, place: SourceErrors) -> Quantity:
    """Parse a quantity of any dimension; validation checks the dimension later. Raises EvaluationError."""
    if isinstance(node, tree.String | tree.List | tree.Compare | tree.Vector):
        raise binder.report_wrong_form(field, node, place)
    value = binder.compiler.scope.evaluator(binder.module, place).value(node)
    if isinstance(value, VectorValue):
        raise binder.report_wrong_form(field, node, place)
    binder.within(replace(field, dimension=value.dimension), node, place, value.value)
    return value


def parse_amounts(binder: Binder, field: Field, node: tree.Expression, place: SourceErrors) -> VectorValue:
    """Parse one amount, or a list of amounts of one dimension. Raises EvaluationError."""
    if isinstance(node, tree.List):
        found: VectorValue = binder.value(replace(field, form="list", dimension=None), node, place)
        if not found.values:
            raise binder.report_wrong_form(field, node, place)
        return found
    one = parse_amount(binder, field, node, place)
    return VectorValue((one.value,), one.dimension)


def parse_files(binder: Binder, field: Field, node: tree.Expression, place: SourceErrors) -> tuple[str, ...]:
    """Parse one file name or a list of them. Raises EvaluationError."""
    one = replace(field, form="file")
    return tuple(binder.value(one, item, place) for item in _parse_items(binder, field, node, place))


def parse_texts(binder: Binder, field: Field, node: tree.Expression, place: SourceErrors) -> tuple[str, ...]:
    """Parse one text or a list of them. Raises EvaluationError."""
    one = replace(field, form="text")
    return tuple(binder.value(one, item, place) for item in _parse_items(binder, field, node, place))


def parse_points(
    binder: Binder, field: Field, node: tree.Expression, place: SourceErrors
) -> tuple[tuple[float, float], ...]:
    """Parse a list of points of a plane, each with two coordinates. Raises EvaluationError.

    A unit behind the list applies to each point without a unit of its own.
    """
    if not isinstance(node, tree.List):
        raise binder.report_wrong_form(field, node, place)
    return tuple(_parse_point(binder, field, item, node.unit, place) for item in node.items)


def _parse_point(
    binder: Binder, field: Field, item: tree.Expression, unit: tree.Unit | None, place: SourceErrors
) -> tuple[float, float]:
    item = _with_list_unit(item, unit)
    if isinstance(item, tree.String | tree.Compare | tree.List):
        raise binder.report_wrong_form(field, item, place)
    value = binder.compiler.scope.evaluator(binder.module, place).value(item)
    if not isinstance(value, VectorValue) or len(value.values) != 2:
        found = f"{len(value.values)} coordinates" if isinstance(value, VectorValue) else describe_expression(item)
        raise place.error("E207", item.span, f"expected a point of two coordinates, found {found}",
                         "not a point of a plane", field.meaning)  # fmt: skip
    binder.dimension(field, item, place, value)
    for component in value.values:
        binder.within(field, item, place, component)
    return value.values[0], value.values[1]


def _parse_items(binder: Binder, field: Field, node: tree.Expression, place: SourceErrors) -> Sequence[tree.Expression]:
    """Return the items of a list as expressions, or a single expression as a sequence of one.

    The list must not be empty, and must have no unit behind it and no equal items. Raises EvaluationError.
    """
    if not isinstance(node, tree.List):
        return (node,)
    if node.unit is not None or not node.items:
        raise binder.report_wrong_form(field, node, place)
    known: set[str] = set()
    for item in node.items:
        if isinstance(item, tree.String):
            if item.value in known:
                raise place.error("E211", item.span, f"`{item.value}` is given twice", "the second", "keep one of them")
            known.add(item.value)
    return node.items


def parse_vectors(
    binder: Binder, field: Field, node: tree.Expression, place: SourceErrors
) -> tuple[tuple[float, ...], ...]:
    """Parse a list of vectors. Raises EvaluationError.

    The unit behind the bracket applies to all components without a unit.
    """
    if not isinstance(node, tree.List) or not node.items:
        raise binder.report_wrong_form(field, node, place)
    one = replace(field, form="vector")
    return tuple(binder.value(one, _with_list_unit(item, node.unit), place) for item in node.items)


def _with_list_unit(item: tree.Expression, unit: tree.Unit | None) -> tree.Expression:
    return replace(item, unit=unit) if isinstance(item, tree.Vector) and item.unit is None else item


def parse_components(binder: Binder, field: Field, node: tree.Expression, place: SourceErrors) -> tuple[int, ...]:
    """Parse one axis or a tuple of axes as their numbers, 0 to 2. Raises EvaluationError."""
    items = node.items if isinstance(node, tree.Vector | tree.List) else (node,)
    name = field.name
    help = f"write `{name} = z` or `{name} = (x, y)`; by default `{name}` is all three"
    if not items:
        raise place.error("E212", node.span, f"`{name}` names no component", "empty", help)
    found = []
    for item in items:
        if not isinstance(item, tree.Name) or item.text not in ("x", "y", "z"):
            problem = f"expected x, y or z, found {describe_expression(item)}"
            raise place.error("E212", item.span, problem, "not a component", help)
        found.append("xyz".index(item.text))
    return tuple(sorted(set(found)))


def parse_integer_pairs(
    binder: Binder, field: Field, node: tree.Expression, place: SourceErrors
) -> tuple[tuple[int, int], ...]:
    """Parse a list of pairs of whole numbers. Raises EvaluationError."""
    if not isinstance(node, tree.List) or node.unit is not None or not node.items:
        raise binder.report_wrong_form(field, node, place)
    one, found = replace(field, form="integer"), []
    for item in node.items:
        if not isinstance(item, tree.Vector) or item.unit is not None or len(item.items) != 2:
            raise binder.report_wrong_form(field, item, place)
        first, second = (binder.value(one, number, place) for number in item.items)
        found.append((first, second))
    return tuple(found)


def parse_quantities(binder: Binder, field: Field, node: tree.Expression, place: SourceErrors) -> tuple[float, ...]:
    """Parse one quantity, or a list of them. Raises EvaluationError."""
    if isinstance(node, tree.List):
        found: VectorValue = binder.value(replace(field, form="list"), node, place)
        if not found.values:
            raise binder.report_wrong_form(field, node, place)
        return found.values
    return (binder.value(replace(field, form="quantity"), node, place),)


@dataclass(frozen=True)
class DataFieldFinder:
    """Finder of data fields (values read from files) in the expressions of a declaration."""

    binder: Binder
    place: SourceErrors

    def varies_in_space(self, node: tree.Expression) -> bool:
        """Return whether coordinates or data fields occur in an expression."""
        parts = (part for part, _ in tree.walk(node))
        return any(self.known(part) or (isinstance(part, tree.Name) and part.text in COORDINATES) for part in parts)

    def known(self, part: tree.Expression | tree.Argument) -> bool:
        """Return whether a part of an expression is a data field: a call that reads one, or the name of one."""
        if isinstance(part, tree.Call):
            return part.function.text in self.binder.vocabulary.get("field", {})
        return isinstance(part, tree.Name) and self.is_name_of_kind(part, "field")

    def is_name_of_kind(self, part: tree.Name, kind: str) -> bool:
        """Return whether a name refers to a declaration of a kind."""
        symbol = self.binder.compiler.table.symbols.get(self.binder.module.prefix + part.text)
        return symbol is not None and isinstance(symbol.node, tree.Declare) and symbol.node.kind == kind

    def resolve_data_field(self, part: tree.Expression) -> Any:
        """Return the data field that a part of an expression refers to. Raises EvaluationError."""
        if isinstance(part, tree.Call):
            return self.binder.call("field", part, outermost=False)[1]
        if not isinstance(part, tree.Name):
            raise TypeError("a field is a call or a name")
        return self.binder.compiler.resolve_declaration(part, "field", self.binder.module, self.place).thing


def parse_profile(binder: Binder, field: Field, node: tree.Expression, place: SourceErrors) -> Any:
    """Parse a constant that varies in space; return None for a constant that does not. Raises EvaluationError."""
    fields = DataFieldFinder(binder, place)
    if not fields.varies_in_space(node):
        return None
    from softmark.interpreter.language import profile_syntax  # not imported for scenes with constant materials

    found = profile_syntax.read_profile(node, binder.compiler.scope.evaluator(binder.module, place), fields, field)
    binder.dimension(field, node, place, VectorValue((), found.dimension))
    return found


def parse_fibres(binder: Binder, field: Field, node: tree.Expression, place: SourceErrors) -> Any:
    """Parse a fibre direction: a vector, three expressions of the coordinates, or a rule. Raises EvaluationError."""
    declared = DataFieldFinder(binder, place)
    if isinstance(node, tree.Call) or (isinstance(node, tree.Name) and declared.is_name_of_kind(node, "fibres")):
        return binder.value(replace(field, form="value"), node, place)
    if not (isinstance(node, tree.Vector) and declared.varies_in_space(node)):
        return binder.value(replace(field, form="direction"), node, place)
    if len(node.items) != 3 or node.unit is not None:
        raise binder.report_wrong_form(field, node, place)
    from softmark.interpreter.language import profile_syntax
    from softmark.interpreter.language.spatial_profiles import DirectionProfile

    evaluator = binder.compiler.scope.evaluator(binder.module, place)
    parts = [profile_syntax.read_profile(item, evaluator, declared, field) for item in node.items]
    for item, part in zip(node.items[1:], parts[1:], strict=True):
        if part.dimension != parts[0].dimension:
            raise place.error("E204", item.span, "the components of a direction must have the same dimension",
                             f"not {units.dimension_name(parts[0].dimension)}",
                             "write zero with its unit: `(-y, x, 0 mm)`"
                             )  # fmt: skip
    return DirectionProfile((parts[0], parts[1], parts[2]))


FORMS: Mapping[str, Read] = {
    "amount": parse_amount,
    "amounts": parse_amounts,
    "files": parse_files,
    "texts": parse_texts,
    "points": parse_points,
    "components": parse_components,
    "target": sweep_values.read_sweep_target,
    "targets": sweep_values.read_sweep_targets,
    "variants": sweep_values.read_variants,
    "vectors": parse_vectors,
    "pairs": parse_integer_pairs,
    "each": parse_quantities,
    "fibres": parse_fibres,
}


# ------------------------------------------------------------------ checks of whole calls


def create_object(
    binder: Binder, constructor: Constructor, values: Mapping[str, Any], bound: Mapping[str, Bound], node: tree.Call
) -> Any:
    """Return the object that a call creates. Raises EvaluationError if its values do not fit together."""
    try:
        return constructor.cls(**values)
    except InvalidCombination as wrong:
        value, place = bound.get(wrong.field, (node.function, binder.place))
        raise place.error("E352", value.span, wrong.problem, wrong.short, wrong.remedy) from None


def check_alternatives(binder: Binder, constructor: Constructor, bound: Mapping[str, Bound], node: tree.Call) -> bool:
    """Report an error if none or several of a group of alternative fields are given; return whether there was one."""
    broken = False
    for names in getattr(constructor.cls, "either", ()):
        given = [name for name in names if name in bound]
        told = " or ".join(f"`{name}`" for name in names)
        if not given:
            fields = [f for name in names if (f := constructor.field(name)) is not None]
            each = (f"`{f.name}`, {re.split('[;,]', f.doc)[0]}{binder.unit_hint(f)}" for f in fields)
            meanings = f"give one of them: {'; or '.join(each)}"
            binder.place.error(
                "E351", node.function.span, f"`{constructor.name}` needs either {told}", "one is missing", meanings
            )
        elif len(given) > 1:
            value, place = bound[given[-1]]
            problem = f"`{constructor.name}` takes {told}, not both"
            place.error("E351", value.span, problem, "one follows from the other", f"remove `{given[-1]}`")
        broken |= len(given) != 1
    return broken


def default_selection(binder: Binder, constructor: Constructor, bound: Mapping[str, Bound]) -> dict[str, Any]:
    """Return the field `where` with its default for a support on a rigid body, which has no parts to select.

    For any other call the result is empty.
    """
    given = bound.get("body")
    if constructor.kind != "support" or given is None or "where" in bound or not isinstance(given[0], tree.Name):
        return {}
    try:
        known = is_rigid(binder.compiler.resolve_declaration(given[0], "body", binder.module, given[1]))
    except EvaluationError:
        known = True  # an invalid body is reported elsewhere
    return {"where": EVERYWHERE} if known else {}
