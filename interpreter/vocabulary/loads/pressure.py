"""Pressure on a part of the surface, which follows the surface."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from softmark.interpreter.vocabulary.loads.load import AMPLITUDE, Load, SurfaceAction, Vector3
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.vocabulary.loads.load import BodySize, ExactBody, IndependentForces, SolidForces
    from softmark.solvers.energies.energy import Energy, Floats


@dataclass(frozen=True)
class PressureLoad(SurfaceAction):
    """Pressure on a part of the surface, positive inward, normal to the deformed surface (a follower load)."""

    where: Any  # a condition
    pressure: float  # Pa

    def solid_energy(self, solid: SolidForces) -> Energy:
        """Return the load on the deformed surface of a mesh, or on the undeformed one for small strain."""
        if solid.small:
            return solid.area_forces(self.where, lambda dA: -self.pressure * dA, True)
        return solid.follower_pressure(self.where, self.pressure)

    def independent_forces(self, check: IndependentForces) -> tuple[Floats, float]:
        """Return the nodal forces (n, 3), N, of the load by independent area integrals, and their uncertainty, N."""
        p = float(self.pressure)
        return check.area_forces(self.where, lambda dA: -p * dA, linear=True, deformed=not check.small)

    def traction_on(self, normal: Floats) -> tuple[Floats, float] | None:
        """Return a zero dead traction (3,), Pa, and the follower pressure, Pa."""
        return 0.0 * normal, float(self.pressure)

    def exact_resultant(self, body: ExactBody) -> tuple[Vector3 | None, float | None]:
        """Return the force, N, and the area, m^2, of the selected undeformed surface."""
        if (found := body.area(self.where)) is None:
            return None, None
        x, y, z = found[1]
        return (-self.pressure * x, -self.pressure * y, -self.pressure * z), found[0]

    def size(self, body: BodySize) -> float:
        """Return the pressure times the area, N."""
        return abs(self.pressure) * body.area(self.where)


@dataclass(frozen=True)
class Pressure(Load):
    """A pressure on a part of the surface that stays normal to the deformed surface (a follower load).

    Positive values push inward. In general it has no potential energy, so the tangent is not symmetric. Models with
    small strain apply it to the undeformed surface, as linear theory does. A facet that is only partly selected is
    loaded on exactly the selected part. The report gives the resultant on the undeformed mesh and on the exact body.
    """

    strength = "magnitude"

    body: Annotated[str, "body", "the body that is loaded"]
    where: Annotated[Any, "condition", "loaded part of its surface, by undeformed coordinates"]
    magnitude: Annotated[float, "Pa", "pressure, positive inward"]
    amplitude: Annotated[Any | None, "amplitude", AMPLITUDE] = None

    @property
    def action(self) -> PressureLoad:
        """Action of the load: a pressure normal to the deformed surface of the selected part."""
        return PressureLoad(self.where, self.magnitude)
