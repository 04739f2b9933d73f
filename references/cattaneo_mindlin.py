"""A rigid sphere that is pressed into a face with friction and then dragged along it: partial slip."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.half_space_indentation import SamePlace
from softmark.references.reference_base import About, Reference
from softmark.references.straight_cantilever import Refused, Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.references.indentation import Pressed

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np


@dataclass(frozen=True)
class PartialSlip(SamePlace):
    """Hertz's contact that a tangential travel shears. SI units.

    With m = mu P, G the shear modulus, a the radius of contact and q = Q / m, a circle of radius a (1 - q)^(1/3) sticks
    and moves by most (1 - (1 - q)^(2/3)), most = 3 m (2 - nu) / (16 a G): beyond that all of it slides.
    """

    friction: float
    slid: Vector  # m, along the face

    @property
    def travel(self) -> float:
        """Along the face, m."""
        return math.hypot(*self.slid)

    @property
    def push(self) -> float:
        """The force into the body, N."""
        return self.pressed.push

    @property
    def radius(self) -> float:
        """Of contact, m."""
        return self.pressed.radius

    @property
    def area(self) -> float:
        """Of contact, m^2."""
        return self.pressed.area

    @property
    def largest_pressure(self) -> float:
        """Pa."""
        return self.pressed.largest_pressure

    @property
    def most(self) -> float:
        """The travel from which all of it slides, m."""
        own = self.pressed
        shear = 0.5 * own.young / (1.0 + own.poisson)
        if not own.touches:
            return 0.0
        return 3.0 * self.friction * own.push * (2.0 - own.poisson) / (16.0 * own.radius * shear)

    @property
    def _part(self) -> float:
        """Of the travel from which all slides, at most 1."""
        return min(self.travel / self.most, 1.0) if self.most > 0.0 else 1.0

    @property
    def drag(self) -> float:
        """The force along the face, N."""
        return self.friction * self.push * (1.0 - math.pow(1.0 - self._part, 1.5))

    @property
    def dragged(self) -> Vector:
        """The same as a vector, on the body: along the travel."""
        x, y, z = (self.drag * c / (self.travel or 1.0) for c in self.slid)
        return x, y, z

    @property
    def stick_radius(self) -> float:
        """m; 0 where all of it slides."""
        return self.radius * math.sqrt(1.0 - self._part) if self.friction > 0.0 else 0.0

    @property
    def dissipated(self) -> float:
        """J, since it was dragged: twice the work of the drag less drag times travel, and what sliding adds."""
        x, m = self._part, self.friction * self.push
        drag, work = 1.0 - math.pow(1.0 - x, 1.5), x - 0.4 * (1.0 - math.pow(1.0 - x, 2.5))
        slid = max(self.travel - self.most, 0.0)
        return m * (self.most * (2.0 * work - x * drag) + slid)

    @property
    def off(self) -> dict[str, float]:
        """By how much, relative, its force may be off, as that of a half-space."""
        return self.pressed.off

    def pressure(self, r: Array) -> Array:
        """At distances from the axis (n,), m: Pa."""
        return self.pressed.pressure(r)

    def traction(self, r: Array) -> Array:
        """Along the face, at distances from the axis (n,), m: Pa; less in the circle that sticks."""
        c, a = self.stick_radius, self.radius or 1.0
        inner = np.sqrt(np.maximum(c**2 - np.asarray(r, dtype=float) ** 2, 0.0)) / a
        found: Array = self.friction * (self.pressure(r) - self.largest_pressure * inner)
        return found

    @property
    def estimated_error(self) -> float:
        """m, of the depth at which it has its force."""
        return self.pressed.estimated_error


@dataclass(frozen=True)
class CattaneoMindlin(Reference):
    """A rigid sphere that is pressed into a face with friction and then dragged along it: stick, slip and work lost.

    Pressed as Hertz has it, the contact sticks within a circle of radius c = a (1 - Q/(mu P))^(1/3) and slips around
    it; the travel is 3 mu P (2 - nu) / (16 a G) (1 - (1 - Q/(mu P))^(2/3)), and beyond that of Q = mu P all of it
    slides. What is lost as heat is told for a travel that grows straight on; the sphere neither turns, nor goes on
    down while it is dragged, nor comes back. Normal and tangential tractions are taken for uncoupled, as they are of
    nu = 0.5; of others expect 1 to 3 %.

    It takes what `hertz` takes, with `friction` in the contact and two supports that move the sphere: one presses it in
    states before those in which the other drags it, which is what it takes for granted. The metric `force` may be
    held against it, along the face as well, and what is asked of contact.
    Source: Cattaneo 1938; Mindlin 1949, J. Appl. Mech. 16, 259; Johnson 1985, Contact mechanics, ch. 7.
    """

    body: Annotated[Any, "body", "the body that is pressed"]

    about: ClassVar[About] = "pressed"
    with_forces: ClassVar[bool] = True
    with_displacements: ClassVar[bool] = False
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Mindlin 1949, J. Appl. Mech. 16, 259; Johnson 1985, Contact mechanics, ch. 7"
    error_meaning: ClassVar[str] = "what a half-space moves where the body ends, m, and rounding"

    def must_hold(self, pressed: Pressed) -> None:
        """Raises Refused where an assumption is broken."""
        if pressed.kind != "sphere":
            raise Refused(f"what presses is a {pressed.kind}", "it is about spheres")
        if not pressed.friction:
            raise Refused("the contact has no friction", "give `friction`, or use `hertz(...)`")
        if pressed.turned:
            raise Refused("it is dragged while it is pressed in, or back again",
                          "press it in one state, and drag it straight on in those that follow")  # fmt: skip
        pressed.must_be_shallow()
        pressed.must_be_half_space()

    def solve(self, pressed: Pressed) -> PartialSlip:
        """What it says. Raises Refused where an assumption is broken."""
        self.must_hold(pressed)
        return PartialSlip(pressed.half_space, pressed.friction, pressed.slid)
