"""Frictionless indentation of a layer of any thickness by a rigid sphere, cone or punch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.half_space_indentation import ForceTheory
from softmark.references.reference_base import Reference
from softmark.references.straight_cantilever import NotApplicable

if TYPE_CHECKING:
    from softmark.references.half_space_indentation import Array
    from softmark.references.indentation import Indentation
    from softmark.references.layer_integral_equation import Layer


@dataclass(frozen=True)
class LayerContact(ForceTheory):
    """Solution of the indentation of a layer. SI units."""

    @property
    def layer(self) -> Layer:
        """Layer indented to the same depth, whose integral equation is solved."""
        return self.pressed.layer

    @property
    def push(self) -> float:
        """Force into the layer, N."""
        return self.layer.push

    @property
    def radius(self) -> float:
        """Contact radius, m."""
        return self.layer.radius

    @property
    def area(self) -> float:
        """Contact area, m^2."""
        return self.layer.area

    @property
    def largest_pressure(self) -> float:
        """Largest pressure, Pa."""
        return self.layer.largest_pressure

    def pressure(self, r: Array) -> Array:
        """Return the contact pressure (n,), Pa, at distances r from the axis (n,), m."""
        return self.layer.pressure(r)

    @property
    def relative_errors(self) -> dict[str, float]:
        """Estimated errors of the force: those of `HalfSpace.relative_errors` except `thickness`."""
        return {name: own for name, own in self.pressed.relative_errors.items() if name != "thickness"}

    @property
    def estimated_error(self) -> float:
        """Rounding error of the indentation depth for the given force, m."""
        return 1e-10 * abs(self.layer.depth)


@dataclass(frozen=True)
class PressedLayer(Reference):
    """Indentation of a layer of any thickness by a rigid sphere, cone or flat punch: force, area and pressure.

    It holds for small strain without friction, by an integral equation that is solved to rounding: for any Poisson's
    ratio, for a layer that is bonded to its base (its far face fixed) or slides on it (held along its normal only), and
    for a contact radius of up to six times the thickness. For a thick layer it agrees with `hertz` and `sneddon`; for
    spheres on incompressible layers `dimitriadis` is a series for it. Free sides and large strain are omitted; the
    errors of the force by a near side and a depth that is not small are in the report (`off`).

    It applies to the same cases as `hertz`, except cylinders. It can be compared with the metrics `force`,
    `contact_area`, `contact_pressure` and `pressure_along`.
    Source: Lebedev and Ufliand 1958, PMM 22, 442-450; Hayes, Keer, Herrmann and Mockros 1972, J. Biomech. 5, 541-551.
    """

    body: Annotated[Any, "body", "the layer"]

    problem_kind: ClassVar[str] = "indentation"
    with_displacements: ClassVar[bool] = False
    means: ClassVar[str] = "integral equation"
    source: ClassVar[str] = "Lebedev and Ufliand 1958, PMM 22, 442-450; Hayes et al. 1972, J. Biomech. 5, 541-551"
    error_meaning: ClassVar[str] = "rounding of the indentation depth at the given force, m"

    def must_hold(self, pressed: Indentation) -> None:
        """Raise NotApplicable if the case violates an assumption of the theory; checked before solving."""
        pressed.must_slip_freely()
        pressed.must_be_shallow()
        if pressed.kind == "cylinder":
            raise NotApplicable("the indenter is a cylinder", "use `hertz_line(...)`")
        pressed.must_be_wide()

    def solve(self, pressed: Indentation) -> LayerContact:
        """Return the solution. Raises NotApplicable if the case violates an assumption."""
        self.must_hold(pressed)
        return LayerContact(pressed.half_space)
