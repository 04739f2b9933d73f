"""Remote stress: the traction of a uniform uniaxial stress on a part of the surface."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from softmark.interpreter.vocabulary.loads.load import AMPLITUDE, Load, Reason, SurfaceAction, Vector3
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.vocabulary.loads.load import BodySize, ExactBody, IndependentForces, SolidForces
    from softmark.solvers.energies.energy import Energy, Floats


@dataclass(frozen=True)
class RemoteStress(SurfaceAction):
    """Traction that a uniform uniaxial stress exerts on a part of the surface, per undeformed area (a dead load)."""

    dead = conservative = True

    where: Any  # a condition
    stress: float  # Pa
    direction: Vector3  # unit vector

    @property
    def tensor(self) -> tuple[Vector3, Vector3, Vector3]:
        """Rows of the stress tensor, Pa."""
        x, y, z = ((self.stress * a * self.direction[0], self.stress * a * self.direction[1],
                    self.stress * a * self.direction[2]) for a in self.direction)  # fmt: skip
        return x, y, z

    @property
    def vector(self) -> Vector3:
        """Direction of the stress, a unit vector."""
        return self.direction

    def solid_energy(self, solid: SolidForces) -> Energy:
        """Return the energy of the traction on a mesh."""
        return solid.area_forces(self.where, lambda dA: dA @ self.tensor, True)

    def independent_forces(self, check: IndependentForces) -> tuple[Floats, float]:
        """Return the nodal forces (n, 3), N, of the load by independent area integrals, and their uncertainty, N."""
        d = self.direction
        return check.area_forces(self.where, lambda dA: (self.stress * (dA @ d))[..., None] * d, linear=True)

    def traction_on(self, normal: Floats) -> tuple[Floats, float] | None:
        """Return the traction (3,), Pa, on a face with this normal, and no follower pressure."""
        return self.stress * float(normal @ self.direction) * (0.0 * normal + self.direction), 0.0

    def exact_resultant(self, body: ExactBody) -> tuple[Vector3 | None, float | None]:
        """Return the force, N, and the area, m^2, of the selected surface."""
        if (found := body.area(self.where)) is None:
            return None, None
        x, y, z = (sum(a * t for a, t in zip(found[1], row, strict=True)) for row in self.tensor)
        return (x, y, z), found[0]

    def size(self, body: BodySize) -> float:
        """Return the magnitude of the force on a face normal to the direction, N."""
        return abs(self.stress) * body.area(self.where)

    def axial_fault(self, body: str) -> Reason | None:
        """Return the reason why a stress oblique to the axis of a body of revolution is refused, or None."""
        if not (self.direction[0] and self.direction[1]):
            return None
        return (
            "direction",
            f"pulls `{body}`, a body of revolution, obliquely to its axis",
            "neither along x nor along y",
            "write `direction = +y` to pull along the axis, or `direction = +x` to pull outward all around",
        )

    def mirror_fault(self, axis: int, place: float, plane: str) -> Reason | None:
        """Return the reason why a stress oblique to a plane of symmetry is refused, or None."""
        if not 0.0 < abs(self.direction[axis]) < 1.0:
            return None
        return (
            "direction",
            f"pulls obliquely to the plane of symmetry `{plane}`",
            "its mirror image pulls in another direction",
            "pull along the plane or normal to it: `direction = +x`",
        )


@dataclass(frozen=True)
class RemoteStressLoad(Load):
    """Traction of a uniform remote stress along a direction, on a part of the surface.

    The force per undeformed area is T (d.n) d, with T the stress, d its direction and n the outward normal: it is
    largest where the surface faces along d and zero where it is parallel to d. Its direction stays constant (a dead
    load). On the whole surface of a body of one material it produces the uniform stress T d d. Several of them add up
    to any uniform stress: three equal ones along the axes are a hydrostatic tension, the opposite of a pressure. A
    facet that is only partly selected is loaded on exactly the selected part. Beams refuse it.
    """

    strength = "magnitude"

    body: Annotated[str, "body", "the body that is loaded"]
    where: Annotated[Any, "condition", "loaded part of its surface, by undeformed coordinates"]
    magnitude: Annotated[float, "Pa", "stress, positive in tension"]
    direction: Annotated[Vector3, "direction", "direction of the stress; `+x` and `-x` mean the same"]
    amplitude: Annotated[Any | None, "amplitude", AMPLITUDE] = None

    @property
    def action(self) -> RemoteStress:
        """Action of the load: the traction of a remote stress on the selected part."""
        return RemoteStress(self.where, self.magnitude, self.direction)
