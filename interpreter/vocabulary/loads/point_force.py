"""Force at one material point."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

from softmark.interpreter.vocabulary.loads.load import AMPLITUDE, NOTHING, Load, Reason, SolidAction, Vector3
from softmark.records import dataclass

if TYPE_CHECKING:
    from collections.abc import Callable

    from softmark.interpreter.vocabulary.loads.load import BodySize, IndependentForces, SolidForces
    from softmark.solvers.energies.energy import Energy, Floats


@dataclass(frozen=True)
class PointLoad(SolidAction):
    """Force with constant direction at one material point."""

    dead = conservative = True

    at: Vector3  # m
    force: Vector3  # N

    @property
    def points(self) -> tuple[tuple[str, Vector3], ...]:
        """Point of the undeformed body at which the force acts, m, with the name of its field."""
        return (("at", self.at),)

    @property
    def vector(self) -> Vector3:
        """Force vector, N."""
        return self.force

    def solid_energy(self, solid: SolidForces) -> Energy:
        """Return the energy of the force on the cell that contains its point."""
        return solid.point_force(self.at, self.force)

    def independent_forces(self, check: IndependentForces) -> tuple[Floats, float]:
        """Return the nodal forces (n, 3), N, of the load, and their uncertainty, N.

        The local coordinates of the point are computed independently of the solver.
        """
        return check.point_force(self.at, self.force)

    def size(self, body: BodySize) -> float:
        """Return the magnitude of the force, N."""
        return math.hypot(*self.force)

    def on_rigid_body(self, mass: Callable[[], float]) -> tuple[Vector3, Vector3 | None, Vector3] | None:
        """Return the force, N, and its point on the rigid body, m."""
        return self.force, self.at, NOTHING

    def axial_fault(self, body: str) -> Reason | None:
        """Return the reason why a body of revolution cannot carry a point force; never None."""
        return (
            "",
            "acts at a point of a body of revolution",
            "not axisymmetric",
            "use `traction` on a part of its edge, which acts all around",
        )


@dataclass(frozen=True)
class PointForce(Load):
    """A force at one material point, with constant direction.

    In a solid the displacement right at a point force grows without bound as the mesh is refined, so evaluate results
    at some distance. On a beam a point off the axis moves with its cross-section: the force is eccentric. On a free
    rigid body the force stays at its material point; in a static analysis it presses a rigid body that is free to move
    in one direction.
    """

    strength = "vector"

    body: Annotated[str, "body", "the body that is loaded"]
    at: Annotated[Vector3, "m", "point, by its undeformed coordinates"]
    vector: Annotated[Vector3, "N", "force vector"]
    amplitude: Annotated[Any | None, "amplitude", AMPLITUDE] = None

    @property
    def action(self) -> PointLoad:
        """Action of the load: a force at one material point."""
        return PointLoad(self.at, self.vector)
