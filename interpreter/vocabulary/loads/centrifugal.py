"""Centrifugal load: the force on a body at rest in a frame that rotates about a fixed axis."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, Self

from softmark.interpreter.vocabulary.loads.load import AMPLITUDE, NOTHING, Load, Matrix3, Reason, SolidAction, Vector3
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.vocabulary.loads.load import BodySize, IndependentForces, SolidForces
    from softmark.solvers.energies.energy import Energy, Floats

ON_AXIS = 1e-9  # relative to the place of a plane, or m at the origin: rounding of the place of an axis


@dataclass(frozen=True)
class CentrifugalForce(SolidAction):
    """Force per mass w |w| r, with w the angular velocity and r the current distance vector from the axis.

    The sign of w counts only for a load that is scaled to a negative fraction of its size.
    """

    conservative = True
    exclusive = True
    in_dynamics = "points that move in a rotating frame also have a Coriolis force, which this load does not include"

    axis: Vector3  # unit vector
    through: Vector3  # m
    speed: float  # rad/s

    @property
    def gradient(self) -> Matrix3:
        """Change of the force per mass with the position, 1/s^2: w^2 (I - axis axis^T)."""
        w, n = self.speed * abs(self.speed), self.axis
        x, y, z = ((w * ((i == 0) - n[i] * n[0]), w * ((i == 1) - n[i] * n[1]), w * ((i == 2) - n[i] * n[2]))
                   for i in range(3))  # fmt: skip
        return x, y, z

    @property
    def constant(self) -> Vector3:
        """Force per mass at the origin of coordinates, m/s^2."""
        x, y, z = (-sum(a * p for a, p in zip(row, self.through, strict=True)) for row in self.gradient)
        return x, y, z

    def solid_energy(self, solid: SolidForces) -> Energy:
        """Return the energy of the load on a mesh."""
        return solid.mass_forces(self.constant, self.gradient)

    def independent_forces(self, check: IndependentForces) -> tuple[Floats, float]:
        """Return the nodal forces (n, 3), N, of the force per mass -w x (w x r), and their uncertainty, N."""
        from softmark.solvers.mesh.shape import cross

        a, b, c = self.axis
        w = self.speed * a, self.speed * b, self.speed * c
        sign = math.copysign(1.0, self.speed)

        def force(r: Vector3) -> Vector3:
            x, y, z = cross(w, cross(w, r))
            return -sign * x, -sign * y, -sign * z

        x, y, z = force(self.through)
        unit = force((1.0, 0.0, 0.0)), force((0.0, 1.0, 0.0)), force((0.0, 0.0, 1.0))
        return check.mass_forces((-x, -y, -z), unit)

    def size(self, body: BodySize) -> float:
        """Return the order of magnitude of the load, N: the force on the body's mass at its size from the axis."""
        return body.mass() * self.speed**2 * body.length()

    def plane_fault(self, revolved: bool) -> Reason | None:
        """Return the reason why a plane body cannot carry the load, or None.

        It cannot if the axis of rotation is not normal to the plane; bodies of revolution are checked by `axial_fault`.
        """
        if revolved or not (self.axis[0] or self.axis[1]):
            return None
        return "axis", "rotates a plane body out of its plane", "not along z", "write `axis = +z`"

    def axial_fault(self, body: str) -> Reason | None:
        """Return the reason why a body of revolution cannot carry the load, or None.

        It cannot if the axis of rotation is not the axis of the body.
        """
        if not (self.axis[0] or self.axis[2] or self.through[0] or self.through[2]):
            return None
        return (
            "axis",
            f"rotates `{body}` about another axis than its own",
            "not the y axis",
            "write `axis = +y`, with `through` on the y axis",
        )

    def mirror_fault(self, axis: int, place: float, plane: str) -> Reason | None:
        """Return the reason why the rotation is not symmetric about a plane, or None.

        The axis of rotation must be normal to the plane or lie in it.
        """
        normal = self.axis[(axis + 1) % 3] == 0.0 and self.axis[(axis + 2) % 3] == 0.0
        away = abs(self.through[axis] - place) > ON_AXIS * (abs(place) or 1.0)
        if normal or (self.axis[axis] == 0.0 and not away):
            return None
        return (
            "axis",
            f"rotates about an axis that is neither normal to the plane of symmetry `{plane}` nor lies in it",
            "its mirror image is another load",
            "model the whole body, or move the axis into the plane with `through`",
        )


@dataclass(frozen=True)
class Centrifugal(Load):
    """Centrifugal force on a body that rotates steadily about a fixed axis, as seen in the rotating frame.

    The force per mass is w^2 r, with w the angular velocity and r the distance vector from the axis: from the deformed
    body, or from the undeformed one in models with small strain. So a body that moves outward is pulled more, and above
    a critical speed there may be no equilibrium. The density may vary, and regions may differ in it. Displacements
    are those relative to the rotating frame. The load is static: acceleration of the rotation and Coriolis forces are
    not included, so dynamic analyses and natural frequencies refuse it. An amplitude, a state and a load step scale the
    force, which is proportional to the square of the speed: half the force belongs to 0.707 of the speed.
    Source: Timoshenko and Goodier (1970), Theory of Elasticity, article 32.
    """

    strength = "speed"

    body: Annotated[str, "body", "the body that rotates"]
    axis: Annotated[Vector3, "direction", "direction of the axis of rotation"]
    speed: Annotated[float, "rad/s in [0, inf)", "angular velocity"]
    through: Annotated[Vector3, "m", "a point of the axis"] = NOTHING
    amplitude: Annotated[Any | None, "amplitude", AMPLITUDE] = None

    def part(self, share: float) -> Self:
        """Return the load with a fraction of its force: its speed is scaled by the square root."""
        return replace(self, speed=self.speed * math.copysign(math.sqrt(abs(share)), share))

    @property
    def action(self) -> CentrifugalForce:
        """Action of the load: a force per mass that grows with the distance from the axis."""
        return CentrifugalForce(self.axis, self.through, self.speed)
