"""A bar whose end meets a rigid plane: Signorini's problem in one dimension."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.beam_centre_line import as_points
from softmark.references.reference_base import About, Reference
from softmark.references.straight_cantilever import Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np


@dataclass(frozen=True)
class StoppedBar:
    """A bar held at one end that a force pulls and a plane before its other end stops. SI units.

    Free, it grows by e = P L / (E A); where that is more than the gap g it grows by g, and the plane carries
    P - E A g / L. `away` is the gap, when the plane has come to its place; negative where it presses the bar.
    """

    length: float  # m
    section: float  # m^2
    young: float  # Pa, axial modulus with its lateral constraints
    narrowing: float  # what it narrows by across, in each direction, of its stretch: Poisson's ratio, or 0
    away: float  # m
    load: float  # N, at its end, away from the held one
    root: Vector  # m, centre of the held end
    axis: Vector  # unit vector, from the held end to the other one
    across: tuple[bool, bool, bool] = (True, True, True)  # directions in which it narrows

    @property
    def stiffness(self) -> float:
        """E A / L, N/m."""
        return self.young * self.section / self.length

    @property
    def longer(self) -> float:
        """By how much, m."""
        return min(self.load / self.stiffness, self.away)

    @property
    def gap(self) -> float:
        """What is left between them, m."""
        return self.away - self.longer

    @property
    def push(self) -> float:
        """What the plane presses its end with, N."""
        return max(self.load - self.stiffness * self.away, 0.0)

    @property
    def carried(self) -> float:
        """What pulls in it, N."""
        return self.stiffness * self.longer

    @property
    def area(self) -> float:
        """Of contact, m^2."""
        return self.section if self.push > 0.0 else 0.0

    @property
    def largest_pressure(self) -> float:
        """The same everywhere, Pa."""
        return self.push / self.section

    def pressure(self, r: Array) -> Array:
        """The same at all distances from the middle (n,): Pa."""
        return np.full(len(r), self.largest_pressure)

    @property
    def energy(self) -> float:
        """That is stored, J."""
        return 0.5 * self.carried * self.longer

    @property
    def strain(self) -> float:
        """Along it."""
        return self.longer / self.length

    @property
    def off(self) -> dict[str, float]:
        """By how much, relative, its force may be off: strain that is not small."""
        return {"strain": abs(self.strain)}

    def displacement(self, X: Array) -> Array:
        """Of points X (n, 3) of the undeformed body (n, 3), m: in proportion along it. Raises Refused."""
        from_root, n = as_points(X) - np.asarray(self.root), np.asarray(self.axis)
        along = from_root @ n
        narrow = -self.narrowing * np.asarray(self.across, dtype=float)
        found: Array = self.strain * (along[:, None] * n + narrow * (from_root - along[:, None] * n))
        return found

    @property
    def estimated_error(self) -> float:
        """m: rounding."""
        return 1e-13 * abs(self.longer)


@dataclass(frozen=True)
class Signorini(Reference):
    """A bar or a block that a rigid plane stops or presses, with no friction: stress is the same everywhere.

    Held at one end along its axis, pulled or pressed by a force at the other, it grows as far as the plane lets it:
    u = min(P L / (E A), gap), and the plane carries P - E A gap / L where it is met. A plane that is moved toward the
    bar presses it, and pressure is the same all over the face, as the patch test of contact asks (Taylor and
    Papadopoulos 1991); of blocks that press each other that is `patch_test(...)`. Strain is small.

    It takes a box, a cylinder, or a rectangle in `plane_strain` or `axisymmetric`, one end held along its normal, sides
    free or on planes of symmetry; one `between` a rigid plane across the axis, or a box, and the body, without
    friction; and at most a `traction` on all of the end that meets it. With `poisson = 0` the end
    may be `fixed`. Metrics `displacement`, `force`, `contact_area` and `contact_pressure` may be held against it.
    Source: Signorini 1933; Taylor and Papadopoulos 1991, On a patch test for contact problems in two dimensions.
    """

    body: Annotated[Any, "body", "the bar"]

    about: ClassVar[About] = "stopped"
    with_forces: ClassVar[bool] = True
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Signorini 1933; Taylor and Papadopoulos 1991, in Nonlinear Computational Mechanics"
    error_meaning: ClassVar[str] = "rounding of the displacement, m: the formula solves its equations exactly"

    def solve(self, bar: StoppedBar) -> StoppedBar:
        """What it says: the closed form is that of the bar itself."""
        return bar
