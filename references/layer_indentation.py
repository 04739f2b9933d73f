"""A rigid sphere, cone or punch that is pressed into a layer of any thickness without friction."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.half_space_indentation import SamePlace
from softmark.references.reference_base import About, Reference
from softmark.references.straight_cantilever import Refused

if TYPE_CHECKING:
    from softmark.references.half_space_indentation import Array
    from softmark.references.indentation import Pressed
    from softmark.references.layer_integral_equation import Layer


@dataclass(frozen=True)
class InLayer(SamePlace):
    """What a layer says. SI units."""

    @property
    def layer(self) -> Layer:
        """It, pressed as deep."""
        return self.pressed.layer

    @property
    def push(self) -> float:
        """The force into the body, N."""
        return self.layer.push

    @property
    def radius(self) -> float:
        """Of contact, m."""
        return self.layer.radius

    @property
    def area(self) -> float:
        """Of contact, m^2."""
        return self.layer.area

    @property
    def largest_pressure(self) -> float:
        """Pa."""
        return self.layer.largest_pressure

    def pressure(self, r: Array) -> Array:
        """At distances from the axis (n,), m: Pa."""
        return self.layer.pressure(r)

    @property
    def off(self) -> dict[str, float]:
        """By how much, relative, its force may be off: `depth` and `sides` as of a half-space."""
        return {name: own for name, own in self.pressed.off.items() if name != "thickness"}

    @property
    def estimated_error(self) -> float:
        """m, of the depth at which it has its force: rounding."""
        return 1e-10 * abs(self.layer.depth)


@dataclass(frozen=True)
class PressedLayer(Reference):
    """A rigid sphere, cone or flat punch that is pressed into a layer of any thickness: force, area and pressure.

    In small strain and without friction, by an integral equation that is solved to rounding: for any Poisson's ratio,
    for a layer that is bonded to what it lies on (its far face fixed) or slides on it (held along its normal alone),
    and for a radius of contact of up to six times the thickness. Where the layer is thick it is what `hertz` and
    `sneddon` say; of spheres on incompressible layers `dimitriadis` is a series for it. Free sides and large strain are
    left out; how much the force may be off for a side that is near and a depth that is not small is in the report
    (`off`).

    It takes what `hertz` takes but cylinders. Metrics `force`, `contact_area`, `contact_pressure` and
    `pressure_along` may be held against it.
    Source: Lebedev and Ufliand 1958, PMM 22, 442-450; Hayes, Keer, Herrmann and Mockros 1972, J. Biomech. 5, 541-551.
    """

    body: Annotated[Any, "body", "the layer"]

    about: ClassVar[About] = "pressed"
    with_forces: ClassVar[bool] = True
    with_displacements: ClassVar[bool] = False
    means: ClassVar[str] = "integral equation"
    source: ClassVar[str] = "Lebedev and Ufliand 1958, PMM 22, 442-450; Hayes et al. 1972, J. Biomech. 5, 541-551"
    error_meaning: ClassVar[str] = "of the depth at which it has its force, m: rounding"

    def must_hold(self, pressed: Pressed) -> None:
        """Raises Refused where an assumption is broken, as far as a look tells."""
        pressed.must_slip_freely()
        pressed.must_be_shallow()
        if pressed.kind == "cylinder":
            raise Refused("what presses is a cylinder", "use `hertz_line(...)`")
        pressed.must_be_wide()

    def solve(self, pressed: Pressed) -> InLayer:
        """What it says. Raises Refused where an assumption is broken."""
        self.must_hold(pressed)
        return InLayer(pressed.half_space)
