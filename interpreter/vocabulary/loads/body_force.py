"""Gravity: a force per mass with constant direction."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

from softmark.interpreter.vocabulary.loads.load import AMPLITUDE, NOTHING, Load, Reason, SolidAction, Vector3
from softmark.records import dataclass

if TYPE_CHECKING:
    from collections.abc import Callable

    from softmark.interpreter.vocabulary.loads.load import BodySize, ExactBody, IndependentForces, SolidForces
    from softmark.solvers.energies.energy import Energy, Floats


@dataclass(frozen=True)
class BodyForce(SolidAction):
    """Body force per mass with constant direction (a dead load)."""

    dead = conservative = True

    acceleration: Vector3  # m/s^2

    @property
    def vector(self) -> Vector3:
        """Acceleration that the load gives to the body, m/s^2."""
        return self.acceleration

    def solid_energy(self, solid: SolidForces) -> Energy:
        """Return the energy of the weight of a mesh."""
        return solid.mass_forces(self.acceleration)

    def independent_forces(self, check: IndependentForces) -> tuple[Floats, float]:
        """Return the weight at the nodes (n, 3), N, by independent integrals, and its uncertainty, N."""
        return check.mass_forces(self.acceleration)

    def exact_resultant(self, body: ExactBody) -> tuple[Vector3 | None, float | None]:
        """Return the weight of a homogeneous body, N, and None for the area, since gravity acts on no surface."""
        mass, (x, y, z) = body.mass(), self.acceleration
        return (None if mass is None else (mass * x, mass * y, mass * z)), None

    def size(self, body: BodySize) -> float:
        """Return the magnitude of the weight, N."""
        return body.mass() * math.hypot(*self.acceleration)

    def on_rigid_body(self, mass: Callable[[], float]) -> tuple[Vector3, Vector3 | None, Vector3] | None:
        """Return the weight of a rigid body, N, which acts at its centre of mass without a moment."""
        (x, y, z), m = self.acceleration, mass()
        return (m * x, m * y, m * z), None, NOTHING

    def axial_fault(self, body: str) -> Reason | None:
        """Return the reason why gravity across the axis of a body of revolution is refused, or None."""
        if not (self.acceleration[0] or self.acceleration[2]):
            return None
        return "", f"pulls `{body}` across its axis", "not along y", "write `direction = -y`: the axis is y"

    def mirror_fault(self, axis: int, place: float, plane: str) -> Reason | None:
        """Return the reason why gravity across a plane of symmetry is refused, or None."""
        if not self.acceleration[axis]:
            return None
        way = "xyz"[axis]
        return (
            "",
            f"pulls across the plane of symmetry `{plane}`",
            f"along {way}; its mirror image pulls the other way",
            f"use a wall instead of the plane: `fixed(..., components = {way})`",
        )


@dataclass(frozen=True)
class Gravity(Load):
    """Weight of every body: density times an acceleration, per undeformed volume."""

    strength = "magnitude"

    magnitude: Annotated[float, "m/s^2 in [0, inf)", "gravitational acceleration, 9.81 m/s^2 on Earth"]
    direction: Annotated[Vector3, "direction", "direction of gravity"] = (0.0, 0.0, -1.0)
    amplitude: Annotated[Any | None, "amplitude", AMPLITUDE] = None

    @property
    def action(self) -> BodyForce:
        """Action of the load: its acceleration as a body force per mass."""
        x, y, z = (self.magnitude * c for c in self.direction)
        return BodyForce((x, y, z))
