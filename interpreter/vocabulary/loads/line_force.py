"""Line load: a force per undeformed length along a straight line."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

from softmark.interpreter.vocabulary.loads.load import AMPLITUDE, Action, Load, Reason, Vector3
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.vocabulary.loads.load import BodySize, IndependentForces, SolidForces
    from softmark.solvers.energies.energy import Energy, Floats


@dataclass(frozen=True)
class LineForce(Action):
    """Force per undeformed length along a straight line, with constant direction (a dead load)."""

    dead = conservative = True
    unsupported = (
        "load not supported",
        "use a traction on a strip; line forces are supported by `fem(...)` and beams",
    )

    begin: Vector3  # m
    end: Vector3  # m
    force: Vector3  # N/m

    @property
    def points(self) -> tuple[tuple[str, Vector3], ...]:
        """Both ends of the loaded line, m, each with the name of its field."""
        return ("from", self.begin), ("to", self.end)

    @property
    def vector(self) -> Vector3:
        """Force vector per length of the line, N/m."""
        return self.force

    def solid_energy(self, solid: SolidForces) -> Energy:
        """Return the energy of the force on the cells that the line crosses."""
        return solid.line_force(self.begin, self.end, self.force)

    def independent_forces(self, check: IndependentForces) -> tuple[Floats, float]:
        """Return the nodal forces (n, 3), N, of the load by adaptive quadrature, and their uncertainty, N."""
        return check.line_force(self.begin, self.end, self.force)

    def size(self, body: BodySize) -> float:
        """Return the magnitude of the whole force, N."""
        return math.dist(self.begin, self.end) * math.hypot(*self.force)

    def axial_fault(self, body: str) -> Reason | None:
        """Return the reason why a body of revolution cannot carry a line load; never None."""
        return (
            "",
            "acts along a line of a body of revolution",
            "not axisymmetric",
            "use `traction` on a part of its edge, which acts all around",
        )


@dataclass(frozen=True)
class LineLoad(Load):
    """A force per undeformed length along a straight line, with constant direction (a dead load).

    On a beam the line is the axis or a part of it. In a solid it lies inside the body or on its surface, and crosses
    cells from face to face. It is integrated exactly, so the resultant is the same on every mesh.

    In a solid the displacement at the line grows without bound as the mesh is refined, as the logarithm of the cell
    size, and the stress as its inverse (Flamant 1892; Kelvin): results there do not converge. Away from the line they
    do, by Saint-Venant's principle. A traction on a narrow strip converges everywhere.
    """

    strength = "vector"

    body: Annotated[str, "body", "the body that is loaded"]
    from_: Annotated[Vector3, "m", "start of the line, by undeformed coordinates"]
    to: Annotated[Vector3, "m", "end of the line"]
    vector: Annotated[Vector3, "N/m", "force per undeformed length"]
    amplitude: Annotated[Any | None, "amplitude", AMPLITUDE] = None

    @property
    def action(self) -> LineForce:
        """Action of the load: a force per undeformed length along the line."""
        return LineForce(self.from_, self.to, self.vector)
