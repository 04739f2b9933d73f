"""Partial slip: a rigid sphere pressed into a surface with friction and then displaced tangentially."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.half_space_indentation import ForceTheory
from softmark.references.reference_base import Reference
from softmark.references.straight_cantilever import NotApplicable, Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.references.indentation import Indentation

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np


@dataclass(frozen=True)
class PartialSlip(ForceTheory):
    """Solution of Hertz contact with a tangential displacement. SI units.

    With m = mu P the largest friction force, G the shear modulus, a the contact radius and q = Q / m for the tangential
    force Q, a circle of radius a (1 - q)^(1/3) sticks. The tangential displacement is M (1 - (1 - q)^(2/3)), with M =
    3 m (2 - nu) / (16 a G) (property `most`). Beyond M the whole contact slides.
    """

    friction: float
    slid: Vector  # m, along the face

    @property
    def travel(self) -> float:
        """Tangential displacement of the sphere, m."""
        return math.hypot(*self.slid)

    @property
    def push(self) -> float:
        """Normal force into the body, N."""
        return self.pressed.push

    @property
    def radius(self) -> float:
        """Contact radius, m."""
        return self.pressed.radius

    @property
    def area(self) -> float:
        """Contact area, m^2."""
        return self.pressed.area

    @property
    def largest_pressure(self) -> float:
        """Largest contact pressure, Pa."""
        return self.pressed.largest_pressure

    @property
    def most(self) -> float:
        """Tangential displacement at which the whole contact slides, m."""
        own = self.pressed
        shear = 0.5 * own.young / (1.0 + own.poisson)
        if not own.touches:
            return 0.0
        return 3.0 * self.friction * own.push * (2.0 - own.poisson) / (16.0 * own.radius * shear)

    @property
    def _slip_fraction(self) -> float:
        """Tangential displacement as a fraction of that at full sliding, at most 1."""
        return min(self.travel / self.most, 1.0) if self.most > 0.0 else 1.0

    @property
    def drag(self) -> float:
        """Tangential force, N."""
        return self.friction * self.push * (1.0 - math.pow(1.0 - self._slip_fraction, 1.5))

    @property
    def dragged(self) -> Vector:
        """Tangential force on the body, N, as a vector along the displacement."""
        x, y, z = (self.drag * c / (self.travel or 1.0) for c in self.slid)
        return x, y, z

    @property
    def stick_radius(self) -> float:
        """Radius of the sticking circle, m; 0 if the whole contact slides."""
        return self.radius * math.sqrt(1.0 - self._slip_fraction) if self.friction > 0.0 else 0.0

    @property
    def dissipated(self) -> float:
        """Dissipated energy, J.

        It is twice the work of the tangential force minus the product of force and displacement, up to full sliding,
        plus the work of full sliding.
        """
        x, m = self._slip_fraction, self.friction * self.push
        drag, work = 1.0 - math.pow(1.0 - x, 1.5), x - 0.4 * (1.0 - math.pow(1.0 - x, 2.5))
        slid = max(self.travel - self.most, 0.0)
        return m * (self.most * (2.0 * work - x * drag) + slid)

    @property
    def relative_errors(self) -> dict[str, float]:
        """Estimated errors of the force, relative to the force, by name of the neglected effect (see `HalfSpace`)."""
        return self.pressed.relative_errors

    def pressure(self, r: Array) -> Array:
        """Return the contact pressure (n,), Pa, at distances r from the axis (n,), m."""
        return self.pressed.pressure(r)

    def traction(self, r: Array) -> Array:
        """Return the tangential traction (n,), Pa, at distances r from the axis (n,), m.

        The traction is the friction coefficient times the pressure in the slip zone, and less in the stick zone.
        """
        c, a = self.stick_radius, self.radius or 1.0
        inner = np.sqrt(np.maximum(c**2 - np.asarray(r, dtype=float) ** 2, 0.0)) / a
        found: Array = self.friction * (self.pressure(r) - self.largest_pressure * inner)
        return found

    @property
    def estimated_error(self) -> float:
        """Error of the indentation depth for the given force, m."""
        return self.pressed.estimated_error


@dataclass(frozen=True)
class CattaneoMindlin(Reference):
    """A rigid sphere pressed into a surface with friction and then moved along it: stick, slip and dissipation.

    Under Hertz pressure the contact sticks within a circle of radius c = a (1 - Q/(mu P))^(1/3) and slips around it;
    the tangential displacement is 3 mu P (2 - nu) / (16 a G) (1 - (1 - Q/(mu P))^(2/3)), and beyond that of Q = mu P
    the whole contact slides. The dissipated energy holds for a displacement that grows monotonically on a straight
    line; the sphere does not rotate, goes no deeper while it is moved, and does not return. Normal and tangential
    tractions are assumed uncoupled, as is exact for nu = 0.5; for others expect errors of 1 to 3 %.

    It applies to the same cases as `hertz`, with `friction` in the contact and two supports that move the sphere: one
    presses it in states before those in which the other drags it; this order is assumed. It can be compared with the
    metric `force`, also tangential, and with contact metrics.
    Source: Cattaneo 1938; Mindlin 1949, J. Appl. Mech. 16, 259; Johnson 1985, Contact mechanics, ch. 7.
    """

    body: Annotated[Any, "body", "deformable body that is indented"]

    problem_kind: ClassVar[str] = "indentation"
    with_displacements: ClassVar[bool] = False
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Mindlin 1949, J. Appl. Mech. 16, 259; Johnson 1985, Contact mechanics, ch. 7"
    error_meaning: ClassVar[str] = "displacement of the half-space at the borders of the body, m, and rounding"

    def must_hold(self, pressed: Indentation) -> None:
        """Raise NotApplicable if the case violates an assumption of the theory."""
        if pressed.kind != "sphere":
            raise NotApplicable(f"the indenter is a {pressed.kind}", "it applies only to spheres")
        if not pressed.friction:
            raise NotApplicable("the contact has no friction", "give `friction`, or use `hertz(...)`")
        if pressed.turned:
            raise NotApplicable(
                "the sphere is dragged while it is pressed in, or is dragged back",
                "press it in the first state, and drag it in one direction in the states after it",
            )
        pressed.must_be_shallow()
        pressed.must_be_half_space()

    def solve(self, pressed: Indentation) -> PartialSlip:
        """Return the solution. Raises NotApplicable if the case violates an assumption."""
        self.must_hold(pressed)
        return PartialSlip(pressed.half_space, pressed.friction, pressed.slid)
