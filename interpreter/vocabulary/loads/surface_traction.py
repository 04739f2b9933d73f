"""Traction: a force per undeformed area on a part of the surface."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

from softmark.interpreter.vocabulary.loads.load import AMPLITUDE, Load, SurfaceAction, Vector3
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.vocabulary.loads.load import BodySize, ExactBody, IndependentForces, SolidForces
    from softmark.solvers.energies.energy import Energy, Floats


@dataclass(frozen=True)
class SurfaceTraction(SurfaceAction):
    """Force per undeformed area on a part of the surface, with constant direction (a dead load)."""

    dead = conservative = True

    where: Any  # a condition
    traction: Vector3  # Pa

    @property
    def vector(self) -> Vector3:
        """Traction vector, force per undeformed area, Pa."""
        return self.traction

    def solid_energy(self, solid: SolidForces) -> Energy:
        """Return the energy of the traction on a mesh."""
        return solid.area_forces(self.where, lambda dA: (dA * dA).sum(axis=-1)[..., None] ** 0.5 * self.traction, False)

    def independent_forces(self, check: IndependentForces) -> tuple[Floats, float]:
        """Return the nodal forces (n, 3), N, of the load by independent area integrals, and their uncertainty, N."""
        x, y, z = self.traction
        return check.area_forces(self.where, lambda dA: (dA**2 @ (1.0, 1.0, 1.0))[..., None] ** 0.5 * (x, y, z))

    def traction_on(self, normal: Floats) -> tuple[Floats, float] | None:
        """Return the traction (3,), Pa, and a zero follower pressure."""
        return 0.0 * normal + self.traction, 0.0

    def exact_resultant(self, body: ExactBody) -> tuple[Vector3 | None, float | None]:
        """Return the force, N, and the area, m^2, of the selected surface."""
        if (found := body.area(self.where)) is None:
            return None, None
        x, y, z = self.traction
        return (found[0] * x, found[0] * y, found[0] * z), found[0]

    def size(self, body: BodySize) -> float:
        """Return the magnitude of the force, N."""
        return math.hypot(*self.traction) * body.area(self.where)


@dataclass(frozen=True)
class Traction(Load):
    """A force per undeformed area on a part of the surface, with constant direction (a dead load).

    A facet that is only partly selected is loaded on exactly the selected part. The report gives the resultant on the
    mesh and on the exact body.
    """

    strength = "vector"

    body: Annotated[str, "body", "the body that is loaded"]
    where: Annotated[Any, "condition", "loaded part of its surface, by undeformed coordinates"]
    vector: Annotated[Vector3, "Pa", "force per undeformed area"]
    amplitude: Annotated[Any | None, "amplitude", AMPLITUDE] = None

    @property
    def action(self) -> SurfaceTraction:
        """Action of the load: a force per undeformed area on the selected part."""
        return SurfaceTraction(self.where, self.vector)
