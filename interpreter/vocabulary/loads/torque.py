"""Torque: a moment on a part of the surface, without a resultant force."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from softmark.interpreter.language.coordinate_conditions import EVERYWHERE
from softmark.interpreter.vocabulary.loads.load import AMPLITUDE, NOTHING, Load, Reason, SurfaceAction, Vector3
from softmark.records import dataclass

if TYPE_CHECKING:
    from collections.abc import Callable

    from softmark.interpreter.vocabulary.loads.load import ExactBody, IndependentForces, SolidForces
    from softmark.solvers.energies.energy import Energy, Floats


@dataclass(frozen=True)
class MomentLoad(SurfaceAction):
    """Moment on a part of the surface, without a resultant force, with constant size and direction."""

    where: Any  # a condition
    moment: Vector3  # N m

    @property
    def moment_vector(self) -> Vector3 | None:
        """Moment vector of the load, N m."""
        return self.moment

    def solid_energy(self, solid: SolidForces) -> Energy:
        """Return the load on the selected part of the surface of a mesh."""
        return solid.surface_moment(self.where, self.moment)

    def independent_forces(self, check: IndependentForces) -> tuple[Floats, float]:
        """Return the nodal forces (n, 3), N, of the load by independent area integrals, and their uncertainty, N."""
        return check.surface_moment(self.where, self.moment)

    def exact_resultant(self, body: ExactBody) -> tuple[Vector3 | None, float | None]:
        """Return None for the force, since a moment has none, and the area of the selected surface, m^2."""
        return (None, None) if (found := body.area(self.where)) is None else (NOTHING, found[0])

    def on_rigid_body(self, mass: Callable[[], float]) -> tuple[Vector3, Vector3 | None, Vector3] | None:
        """Return the moment on a whole rigid body, N m."""
        return NOTHING, None, self.moment

    def plane_fault(self, revolved: bool) -> Reason | None:
        """Return the reason why a plane body cannot carry a moment; never None."""
        return (
            "",
            "is a moment, which plane bodies do not support",
            "not for plane bodies",
            "rotate an edge with `rotated(..., axis = +z)`",
        )


@dataclass(frozen=True)
class Torque(Load):
    """A moment on a part of the surface without a resultant force; its size and direction in space stay constant.

    On a solid it is a traction about the centre of the part, t = c x (x - centre) per undeformed area, with x the
    current position. The vector c is computed so that the moment is exactly the given one and the resultant force is
    zero, however the part rotates and deforms. Models with small strain use the undeformed part. On a beam it is the
    moment on a whole end section, a boundary condition of Simo-Reissner theory. Under rotations about several axes such
    a moment has no potential energy, so the tangent is not symmetric (Argyris, Dunne and Scharpf 1978). The report
    gives the resultant and the area. On a free rigid body, without `where`, it acts on the whole body.
    """

    strength = "moment"

    body: Annotated[str, "body", "the body that is loaded"]
    moment: Annotated[Vector3, "N*m", "moment vector, right-hand rule"]
    where: Annotated[Any, "condition", "loaded part of its surface, by undeformed coordinates; omit it for a"
                     " rigid body"] = EVERYWHERE  # fmt: skip
    amplitude: Annotated[Any | None, "amplitude", AMPLITUDE] = None

    @property
    def action(self) -> MomentLoad:
        """Action of the load: a moment on the selected part, without a resultant force."""
        return MomentLoad(self.where, self.moment)
