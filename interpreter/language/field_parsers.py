"""Fields whose values are read by functions of their own: amounts, several texts, lists, what is varied.

And what the values of a call are together: objects that refuse them, and fields of which one is to be given.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from softmark.grammar import tree
from softmark.interpreter.language import sweep_values, units
from softmark.interpreter.language.compiled_scene import rigid
from softmark.interpreter.language.coordinate_conditions import EVERYWHERE
from softmark.interpreter.language.expression_evaluation import COORDINATES, Bad, Place, Quantity, VectorValue, describe
from softmark.interpreter.language.field_schema import Constructor, Field
from softmark.ranges import Unfit
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.call_binding import Binder, Bound

Read = Callable[["Binder", Field, tree.Expression, Place], Any]


def amount(binder: Binder, field: Field, node: tree.Expression, place: Place) -> Quantity:
    """A quantity of any dimension: what it must be, others decide. Raises Bad."""
    if isinstance(node, tree.String | tree.List | tree.Compare | tree.Vector):
        raise binder.wrong(field, node, place)
    value = binder.compiler.scope.evaluator(binder.module, place).value(node)
    if isinstance(value, VectorValue):
        raise binder.wrong(field, node, place)
    binder.within(replace(field, dimension=value.dimension), node, place, value.value)
    return value


def amounts(binder: Binder, field: Field, node: tree.Expression, place: Place) -> VectorValue:
    """One amount, or several of one dimension in a list. Raises Bad."""
    if isinstance(node, tree.List):
        found: VectorValue = binder.value(replace(field, form="list", dimension=None), node, place)
        if not found.values:
            raise binder.wrong(field, node, place)
        return found
    one = amount(binder, field, node, place)
    return VectorValue((one.value,), one.dimension)


def files(binder: Binder, field: Field, node: tree.Expression, place: Place) -> tuple[str, ...]:
    """One file or several. Raises Bad."""
    one = replace(field, form="file")
    return tuple(binder.value(one, item, place) for item in _several(binder, field, node, place))


def texts(binder: Binder, field: Field, node: tree.Expression, place: Place) -> tuple[str, ...]:
    """One text or several. Raises Bad."""
    one = replace(field, form="text")
    return tuple(binder.value(one, item, place) for item in _several(binder, field, node, place))


def points(binder: Binder, field: Field, node: tree.Expression, place: Place) -> tuple[tuple[float, float], ...]:
    """Points of a plane; the unit of the list holds for each that has none. Raises Bad."""
    if not isinstance(node, tree.List):
        raise binder.wrong(field, node, place)
    return tuple(_point(binder, field, item, node.unit, place) for item in node.items)


def _point(
    binder: Binder, field: Field, item: tree.Expression, unit: tree.Unit | None, place: Place
) -> tuple[float, float]:
    item = _in_unit(item, unit)
    if isinstance(item, tree.String | tree.Compare | tree.List):
        raise binder.wrong(field, item, place)
    value = binder.compiler.scope.evaluator(binder.module, place).value(item)
    if not isinstance(value, VectorValue) or len(value.values) != 2:
        found = f"{len(value.values)} coordinates" if isinstance(value, VectorValue) else describe(item)
        raise place.fail("E207", item.span, f"expected a point of two coordinates, found {found}",
                         "not a point of a plane", field.meaning)  # fmt: skip
    binder.dimension(field, item, place, value)
    for component in value.values:
        binder.within(field, item, place, component)
    return value.values[0], value.values[1]


def _several(binder: Binder, field: Field, node: tree.Expression, place: Place) -> Sequence[tree.Expression]:
    """One, or those of a list without a unit that is not empty; nothing stands there twice. Raises Bad."""
    if not isinstance(node, tree.List):
        return (node,)
    if node.unit is not None or not node.items:
        raise binder.wrong(field, node, place)
    known: set[str] = set()
    for item in node.items:
        if isinstance(item, tree.String):
            if item.value in known:
                raise place.fail("E211", item.span, f"`{item.value}` is given twice", "the second", "keep one of them")
            known.add(item.value)
    return node.items


def vectors(binder: Binder, field: Field, node: tree.Expression, place: Place) -> tuple[tuple[float, ...], ...]:
    """Vectors in a list; the unit behind its bracket is that of all components without one. Raises Bad."""
    if not isinstance(node, tree.List) or not node.items:
        raise binder.wrong(field, node, place)
    one = replace(field, form="vector")
    return tuple(binder.value(one, _in_unit(item, node.unit), place) for item in node.items)


def _in_unit(item: tree.Expression, unit: tree.Unit | None) -> tree.Expression:
    return replace(item, unit=unit) if isinstance(item, tree.Vector) and item.unit is None else item


def pairs(binder: Binder, field: Field, node: tree.Expression, place: Place) -> tuple[tuple[int, int], ...]:
    """Pairs of whole numbers in a list. Raises Bad."""
    if not isinstance(node, tree.List) or node.unit is not None or not node.items:
        raise binder.wrong(field, node, place)
    one, found = replace(field, form="integer"), []
    for item in node.items:
        if not isinstance(item, tree.Vector) or item.unit is not None or len(item.items) != 2:
            raise binder.wrong(field, item, place)
        first, second = (binder.value(one, number, place) for number in item.items)
        found.append((first, second))
    return tuple(found)


def each(binder: Binder, field: Field, node: tree.Expression, place: Place) -> tuple[float, ...]:
    """One quantity, or several in a list. Raises Bad."""
    if isinstance(node, tree.List):
        found: VectorValue = binder.value(replace(field, form="list"), node, place)
        if not found.values:
            raise binder.wrong(field, node, place)
        return found.values
    return (binder.value(replace(field, form="quantity"), node, place),)


@dataclass(frozen=True)
class FieldsOf:
    """What of the expressions of a declaration is read from files."""

    binder: Binder
    place: Place

    def vary(self, node: tree.Expression) -> bool:
        """Whether coordinates or fields enter an expression."""
        parts = (part for part, _ in tree.walk(node))
        return any(self.known(part) or (isinstance(part, tree.Name) and part.text in COORDINATES) for part in parts)

    def known(self, part: tree.Expression | tree.Argument) -> bool:
        """Whether it is a field: a call that makes one, or the name of one that is declared."""
        if isinstance(part, tree.Call):
            return part.function.text in self.binder.vocabulary.get("field", {})
        return isinstance(part, tree.Name) and self.names(part, "field")

    def names(self, part: tree.Name, kind: str) -> bool:
        """Whether it is the name of a declaration of a kind."""
        symbol = self.binder.compiler.table.symbols.get(self.binder.module.prefix + part.text)
        return symbol is not None and isinstance(symbol.node, tree.Declare) and symbol.node.kind == kind

    def made(self, part: tree.Expression) -> Any:
        """The field itself. Raises Bad."""
        if isinstance(part, tree.Call):
            return self.binder.call("field", part, outermost=False)[1]
        if not isinstance(part, tree.Name):
            raise TypeError("a field is a call or a name")
        return self.binder.compiler.named(part, "field", self.binder.module, self.place).thing


def profile(binder: Binder, field: Field, node: tree.Expression, place: Place) -> Any:
    """A constant that varies in space, None of one that does not. Raises Bad."""
    fields = FieldsOf(binder, place)
    if not fields.vary(node):
        return None
    from softmark.interpreter.language import profile_syntax  # of no scene whose constants are numbers

    found = profile_syntax.profile(node, binder.compiler.scope.evaluator(binder.module, place), fields, field)
    binder.dimension(field, node, place, VectorValue((), found.dimension))
    return found


def fibres(binder: Binder, field: Field, node: tree.Expression, place: Place) -> Any:
    """A direction, three expressions of the coordinates that make one, or a rule. Raises Bad."""
    declared = FieldsOf(binder, place)
    if isinstance(node, tree.Call) or (isinstance(node, tree.Name) and declared.names(node, "fibres")):
        return binder.value(replace(field, form="value"), node, place)
    if not (isinstance(node, tree.Vector) and declared.vary(node)):
        return binder.value(replace(field, form="direction"), node, place)
    if len(node.items) != 3 or node.unit is not None:
        raise binder.wrong(field, node, place)
    from softmark.interpreter.language import profile_syntax
    from softmark.interpreter.language.spatial_profiles import Streams

    evaluator = binder.compiler.scope.evaluator(binder.module, place)
    parts = [profile_syntax.profile(item, evaluator, declared, field) for item in node.items]
    for item, part in zip(node.items[1:], parts[1:], strict=True):
        if part.dimension != parts[0].dimension:
            raise place.fail("E204", item.span, "the components of a direction are of one dimension",
                             f"not {units.named(parts[0].dimension)}", "write zero with its unit: `(-y, x, 0 mm)`"
                             )  # fmt: skip
    return Streams((parts[0], parts[1], parts[2]))


FORMS: Mapping[str, Read] = {
    "amount": amount,
    "amounts": amounts,
    "files": files,
    "texts": texts,
    "points": points,
    "target": sweep_values.target,
    "targets": sweep_values.targets,
    "variants": sweep_values.variants,
    "vectors": vectors,
    "pairs": pairs,
    "each": each,
    "fibres": fibres,
}


# ------------------------------------------------------------------ together


def made(
    binder: Binder, constructor: Constructor, values: Mapping[str, Any], bound: Mapping[str, Bound], node: tree.Call
) -> Any:
    """The object. Raises Bad where its values do not go together."""
    try:
        return constructor.cls(**values)
    except Unfit as wrong:
        value, place = bound.get(wrong.field, (node.function, binder.place))
        raise place.fail("E352", value.span, wrong.problem, wrong.short, wrong.remedy) from None


def either(binder: Binder, constructor: Constructor, bound: Mapping[str, Bound], node: tree.Call) -> bool:
    """Report fields of which one is to be given, where none is or more; whether there are any."""
    broken = False
    for names in getattr(constructor.cls, "either", ()):
        given = [name for name in names if name in bound]
        told = " or ".join(f"`{name}`" for name in names)
        if not given:
            fields = [f for name in names if (f := constructor.field(name)) is not None]
            meanings = "; ".join(f.meaning + binder.unit_hint(f) for f in fields)
            binder.place.fail("E351", node.function.span, f"`{constructor.name}` needs {told}", "incomplete", meanings)
        elif len(given) > 1:
            value, place = bound[given[-1]]
            problem = f"`{constructor.name}` takes {told}, not both"
            place.fail("E351", value.span, problem, "one follows from the other", f"leave out `{given[-1]}`")
        broken |= len(given) != 1
    return broken


def whole(binder: Binder, constructor: Constructor, bound: Mapping[str, Bound]) -> dict[str, Any]:
    """The fields that a support of a rigid body need not be given: there is no part of it to select."""
    given = bound.get("body")
    if constructor.kind != "support" or given is None or "where" in bound or not isinstance(given[0], tree.Name):
        return {}
    try:
        known = rigid(binder.compiler.named(given[0], "body", binder.module, given[1]))
    except Bad:
        known = True  # of one that is wrong itself no more is said
    return {"where": EVERYWHERE} if known else {}
