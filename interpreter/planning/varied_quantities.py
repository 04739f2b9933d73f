"""Quantities that a robustness study can vary: numbers, whole numbers, scaled vectors and choices, with their ranges.

To change the range of a field, edit its line in SPANS.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Literal, Self, cast

from softmark.interpreter.language import parameter_overrides, units
from softmark.interpreter.language.compiled_scene import Declared, Parameter, Scene
from softmark.interpreter.language.expression_evaluation import Quantity as Number
from softmark.interpreter.language.expression_evaluation import VectorValue
from softmark.interpreter.language.field_schema import Field, Interval
from softmark.interpreter.language.units import Dimension
from softmark.interpreter.planning import parameter_scale
from softmark.interpreter.planning.parameter_scale import ParameterScale
from softmark.interpreter.results.json_records import JsonRecord
from softmark.records import dataclass
from softmark.solvers.elements.plane import PLANE

Kind = Literal["gap", "factor", "integer", "choice", "reach"]
Value = float | str

# factors down and up from a field's value: wrong units, a slider or a bad guess
SPANS: dict[str, tuple[float, float]] = {
    "young": (1e-6, 1e6), "density": (1e-3, 1e3), "step": (1e-3, 1e3), "size": (1 / 16, 32.0),
    "tolerance": (1e-12, 1e12), "quality": (1e-6, 1e6), "angle": (1e-3, 10.0),
    "stiffness": (1e-6, 1e6), "permeability": (1e-6, 1e6),
}  # fmt: skip
SPAN = (1e-3, 1e3)  # default: loads, dampings, parameters without a range
DOUBLINGS = 64  # largest factor of a whole number
LOWEST = -0.99  # of Poisson's ratio: -1 is where the shear modulus is infinite
POISSONS = (0.0, -0.5, -0.9)  # stops on the way down

# fields that a study varies by default: (kind of declaration, field)
USUAL = (
    ("material", "young"), ("material", "poisson"), ("material", "density"), ("material", "bulk"),
    ("material", "limit"), ("material", "permeability"), ("load", "magnitude"), ("load", "vector"), ("load", "moment"),
    ("load", "tension"),
    ("support", "angle"), ("support", "stiffness"), ("support", "value"),
    ("contact", "friction"), ("contact", "distance"),
    ("model", "size"), ("model", "segments"), ("model", "precision"), ("model", "quality"), ("analysis", "tolerance"),
    ("analysis", "step"), ("analysis", "damping_mass"), ("analysis", "damping_stiffness"),
)  # fmt: skip


class Unwalkable(ValueError):
    """Error: a name is not a quantity that a study can vary; `help` lists possible quantities."""

    def __init__(self, reason: str, help: str = "") -> None:
        super().__init__(reason)
        self.help = help


@dataclass(frozen=True)
class WalkedQuantity(JsonRecord):
    """Quantity that a robustness study varies: its value in the scene, and its scales in both directions.

    The value of a vector is the factor that multiplies it.
    """

    name: str
    kind: Kind
    nominal: Value
    text: str  # readable text
    dimension: Dimension = units.NONE
    limits: tuple[float, float] | None = None
    options: tuple[str, ...] = ()
    vector: tuple[float, ...] = ()
    ladders: tuple[ParameterScale, ...] = ()

    @property
    def unit(self) -> str:
        """SI unit of the values."""
        return "1" if self.vector else units.si_unit(self.dimension)

    def written(self, value: Value) -> str:
        """Return the exact text of a value for an override."""
        if isinstance(value, str):
            return value
        unit = "" if self.dimension == units.NONE else units.si_unit(self.dimension)
        if self.vector:
            parts = ", ".join(_shortest_number(parameter_scale.round_to_six_digits(c * value)) for c in self.vector)
            return f"({parts}) {unit}".strip()
        number = str(int(value)) if self.kind == "integer" else _shortest_number(value)
        return f"{number} {unit}".strip()

    def override(self, value: Value) -> str:
        """Return the override `NAME=VALUE` that sets the quantity to a value."""
        return f"{self.name}={self.written(value)}"

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries of the quantity in the record of a study."""
        nominal = None if isinstance(self.nominal, str) else self.nominal
        return {"name": self.name, "unit": self.unit, "nominal": nominal, "text": self.text, "kind": self.kind,
                "limits": self.limits or None, "options": self.options}  # fmt: skip

    @classmethod
    def from_json(cls, own: Mapping[str, Any]) -> Self:
        """Return the quantity with these JSON entries; its scales are not in the JSON and stay empty."""
        text, unit = str(own.get("text") or ""), str(own.get("unit") or "1")
        nominal, kind = own.get("nominal"), cast("Kind", own.get("kind") or "reach")
        limits, options = own.get("limits"), tuple(own.get("options") or ())
        return cls(
            own["name"], kind, text if nominal is None else nominal, text, units.parse_unit(unit).dimension,
            tuple(limits) if limits else None, options,
        )  # fmt: skip


def _shortest_number(value: float) -> str:
    """Return the shortest text that reads back as this number; zero has no sign."""
    return repr(float(value) + 0.0).removesuffix(".0")


# ------------------------------------------------------------------ by name


def quantity_of(scene: Scene, name: str) -> WalkedQuantity:
    """Return the quantity with this name in a scene. Raises Unwalkable, and KeyError for an unknown name."""
    if name in scene.parameters:
        return _parameter_quantity(scene, scene.parameters[name])
    owner, _, attribute = name.rpartition(".")
    declared = scene.declared[owner]
    field = declared.constructor.field(attribute)
    if field is None:
        raise KeyError(name)
    value = declared.value(attribute)
    if field.form in ("choice", "flag") or (field.form == "value" and field.kind == "element"):
        return _choice_quantity(scene, name, field, value)
    if value is None:
        raise Unwalkable(f"`{name}` has no value in the scene", "give the field a value from which the study can start")
    if field.form == "integer":
        return _integer_quantity(name, int(value), field.interval)
    if field.form == "vector":
        return _vector_quantity(name, value, field.dimension or units.NONE)
    if field.form != "quantity":
        words = f"`{name}` is {field.expected}, and not a quantity"
        raise Unwalkable(words, "vary a number, a vector, a choice, or a parameter that the scene uses there")
    if field.varies and not isinstance(value, float | int):
        raise Unwalkable(f"`{name}` varies in space", "vary a parameter of its expression, such as a factor")
    if attribute == "poisson":
        return _poisson_quantity(name, float(value), None)
    return _logarithmic_quantity(
        name, float(value), field.dimension or units.NONE, SPANS.get(attribute, SPAN), field.interval
    )


def default_quantities(scene: Scene) -> Iterator[WalkedQuantity]:
    """Yield the quantities that a study varies by default: parameters with a range, and the fields listed in USUAL."""
    names = [n for n, p in scene.parameters.items() if "." not in n and p.interval is not None]
    for kind, attribute in USUAL:
        names += [f"{d.name}.{attribute}" for d in scene.of_kind(kind).values() if _has_attribute(d, attribute)]
    for name in names:
        try:
            yield quantity_of(scene, name)
        except Unwalkable:
            continue


def _has_attribute(declared: Declared, attribute: str) -> bool:
    given = attribute in declared.fields or attribute in ("precision", "tolerance")
    return given and declared.value(attribute) is not None


# ------------------------------------------------------------------ kinds of quantities


def _choice_quantity(scene: Scene, name: str, field: Field, value: Any) -> WalkedQuantity:
    """Return a quantity whose values are the choices of a field."""
    alike = (
        word for word in scene.vocabulary.words() if (word in PLANE) == (value in PLANE)
    )  # for bodies of the same kind
    options = ("yes", "no") if field.form == "flag" else field.options or tuple(alike)
    own = ("yes" if value else "no") if field.form == "flag" else str(value)
    return WalkedQuantity(name, "choice", own, own, options=tuple(options))


def _vector_quantity(name: str, value: tuple[float, ...], dimension: Dimension) -> WalkedQuantity:
    """Return a quantity that multiplies a vector by a factor."""
    if not any(value):
        raise Unwalkable(f"`{name}` is zero, and multiples of zero are zero", "give it a size to start from")
    return _quantity_with_scales(
        name, "factor", 1.0, units.format_vector(value, dimension), dimension, SPAN, vector=tuple(value)
    )


def _logarithmic_quantity(
    name: str, value: float, dimension: Dimension, span: tuple[float, float], interval: Interval | None
) -> WalkedQuantity:  # fmt: skip
    """Return a quantity with logarithmic scales, limited by its span in SPANS and by the range of its field."""
    if value == 0:
        help = "give it a size to start from, or vary a parameter with a range: `param a = 0 in 0 .. 10`"
        raise Unwalkable(f"`{name}` is zero, and multiples of zero are zero", help)
    low, high = sorted((value * span[0], value * span[1]))
    if interval is not None:
        low = max(low, interval.low) if not interval.low_open or low < interval.low else low
        high = min(high, interval.high) if not interval.high_open or high > interval.high else high
    return _quantity_with_scales(
        name, "factor", value, units.format_value(value, dimension), dimension, (low / value, high / value)
    )


def _quantity_with_scales(
    name: str, kind: Kind, value: float, text: str, dimension: Dimension, span: tuple[float, float],
    vector: tuple[float, ...] = (),
) -> WalkedQuantity:  # fmt: skip
    low, high = (parameter_scale.round_to_six_digits(value * f) for f in span)
    ways = (_same_sign_scale(value, high, "up"), _same_sign_scale(value, low, "down"))
    limits = (min(low, high), max(low, high))
    return WalkedQuantity(name, kind, value, text, dimension, limits, vector=vector,
                    ladders=tuple(w for w in ways if w is not None))  # fmt: skip


def _same_sign_scale(value: float, limit: float, direction: parameter_scale.Direction) -> ParameterScale | None:
    return parameter_scale.logarithmic_ladder(value, limit, direction) if limit * value > 0 else None


def _integer_quantity(name: str, value: int, interval: Interval | None) -> WalkedQuantity:
    """Return a quantity whose values are whole numbers."""
    if value < 1:
        raise Unwalkable(f"`{name}` is {value}, so doubling gives no other value", "start from one or more")
    low, high = 1, value * DOUBLINGS
    if interval is not None:
        low, high = max(low, int(interval.low)), int(min(high, interval.high))
    ways = (parameter_scale.doubling_ladder(value, high, "up"), parameter_scale.doubling_ladder(value, low, "down"))
    return WalkedQuantity(name, "integer", float(value), str(value), limits=(float(low), float(high)),
                    ladders=tuple(w for w in ways if w is not None))  # fmt: skip


def _poisson_quantity(name: str, value: float, interval: Interval | None) -> WalkedQuantity:
    """Return Poisson's ratio nu as a varied quantity, with one scale upward and one downward.

    Upward steps divide the distance 0.5 - nu to incompressibility, by decades. Downward steps are linear and include
    zero and the negative values POISSONS.
    """
    low = max(LOWEST, interval.low) if interval else LOWEST
    high = min(parameter_scale.INCOMPRESSIBLE, interval.high) if interval else parameter_scale.INCOMPRESSIBLE
    ways = (
        parameter_scale.poisson_ladder(value, high),
        parameter_scale.linear_ladder(value, low, "down", POISSONS) if low < value else None,
    )
    return WalkedQuantity(name, "gap", value, f"{value:g}", limits=(low, high),
                    ladders=tuple(w for w in ways if w is not None))  # fmt: skip


# ------------------------------------------------------------------ parameters


def _parameter_quantity(scene: Scene, parameter: Parameter) -> WalkedQuantity:
    """Return a parameter of the scene as a quantity."""
    value, name, interval = parameter.value, parameter.name, parameter.interval
    if isinstance(value, VectorValue):
        return _vector_quantity(name, value.values, value.dimension)
    if not isinstance(value, Number):
        raise Unwalkable(f"`{name}` is not a number", "vary a number, a vector or a choice")
    if value.dimension == units.NONE and _is_poisson(scene, name, value.value):
        return _poisson_quantity(name, value.value, interval)
    if (
        value.dimension == units.NONE
        and value.value == int(value.value)
        and _is_whole_number_required(scene, name, value.value)
    ):
        return _integer_quantity(name, int(value.value), interval)
    if interval is None:
        return _logarithmic_quantity(name, value.value, value.dimension, SPAN, None)
    return _number_quantity(name, value.value, value.dimension, interval)


def _number_quantity(name: str, value: float, dimension: Dimension, interval: Interval) -> WalkedQuantity:
    """Return a quantity with scales to both ends of a range: logarithmic if possible, linear otherwise."""
    ways: list[ParameterScale | None] = []
    ends: tuple[tuple[parameter_scale.Direction, float], ...] = (("up", interval.high), ("down", interval.low))
    for direction, end in ends:
        if end == value:
            continue
        if value == 0:
            ways.append(parameter_scale.decades_from_zero(end, direction))
        elif end * value > 0:
            ways.append(parameter_scale.logarithmic_ladder(value, end, direction))
        else:
            ways.append(parameter_scale.linear_ladder(value, end, direction))
    kind: Kind = "reach" if value == 0 else "factor"
    return WalkedQuantity(name, kind, value, units.format_value(value, dimension) if value else "0", dimension,
                    (interval.low, interval.high), ladders=tuple(w for w in ways if w is not None))  # fmt: skip


def _compile_with_value(scene: Scene, name: str, value: float) -> tuple[Scene, list[Any]]:
    """Return the scene compiled with another value of a parameter, and the errors of that scene."""
    from softmark.interpreter.language.compiler import recompile

    override = parameter_overrides.read_override(f"{name}={_shortest_number(value)}", [])
    return recompile(scene, [override] if override else [])


def _is_poisson(scene: Scene, name: str, value: float) -> bool:
    """Return whether a parameter is Poisson's ratio of a material, by compiling the scene with another value."""
    own = {n: d.thing.poisson for n, d in scene.declared.items() if d.value("poisson") == value}
    if not own or not -1 < value < parameter_scale.INCOMPRESSIBLE:
        return False
    changed = value - 1e-3 * (parameter_scale.INCOMPRESSIBLE - value)
    other, _ = _compile_with_value(scene, name, changed)
    return any(other.declared[n].value("poisson") == changed for n in own if n in other.declared)


def _is_whole_number_required(scene: Scene, name: str, value: float) -> bool:
    """Return whether a parameter must be a whole number: whether a value half a unit larger is refused."""
    return any(d.code == "E204" for d in _compile_with_value(scene, name, value + 0.5)[1])
