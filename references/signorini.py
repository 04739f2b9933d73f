"""Signorini's problem in one dimension: a bar whose end meets a rigid plane."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.beam_centre_line import as_points
from softmark.references.reference_base import Reference
from softmark.references.straight_cantilever import Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np


@dataclass(frozen=True)
class StoppedBar:
    """Bar held at one end, pulled by a force P, and stopped by a rigid plane at its other end. SI units.

    Without the plane the bar lengthens by e = P L / (E A). If e exceeds the gap g, the bar lengthens by g, and the
    plane carries P - E A g / L. `away` is the gap to the plane in its final position; it is negative if the plane
    compresses the bar.
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
        """Axial stiffness E A / L, N/m."""
        return self.young * self.section / self.length

    @property
    def lengthening(self) -> float:
        """Lengthening of the bar, m."""
        return min(self.load / self.stiffness, self.away)

    @property
    def gap(self) -> float:
        """Remaining gap between bar and plane, m."""
        return self.away - self.lengthening

    @property
    def push(self) -> float:
        """Force of the plane on the end of the bar, N."""
        return max(self.load - self.stiffness * self.away, 0.0)

    @property
    def carried(self) -> float:
        """Axial force in the bar, N."""
        return self.stiffness * self.lengthening

    @property
    def area(self) -> float:
        """Contact area, m^2."""
        return self.section if self.push > 0.0 else 0.0

    @property
    def largest_pressure(self) -> float:
        """Contact pressure, Pa, which is uniform."""
        return self.push / self.section

    def pressure(self, r: Array) -> Array:
        """Return the uniform contact pressure (n,), Pa, at distances r from the centre (n,), m."""
        return np.full(len(r), self.largest_pressure)

    @property
    def energy(self) -> float:
        """Stored energy, J."""
        return 0.5 * self.carried * self.lengthening

    @property
    def strain(self) -> float:
        """Axial strain."""
        return self.lengthening / self.length

    @property
    def relative_errors(self) -> dict[str, float]:
        """Estimated relative error of the force: the axial `strain`, since terms of its second order are neglected."""
        return {"strain": abs(self.strain)}

    def displacement(self, X: Array) -> Array:
        """Return displacements (n, 3), m, of points X (n, 3), linear along the bar. Raises NotApplicable."""
        from_root, n = as_points(X) - np.asarray(self.root), np.asarray(self.axis)
        along = from_root @ n
        narrow = -self.narrowing * np.asarray(self.across, dtype=float)
        found: Array = self.strain * (along[:, None] * n + narrow * (from_root - along[:, None] * n))
        return found

    @property
    def estimated_error(self) -> float:
        """Rounding error of a displacement, m."""
        return 1e-13 * abs(self.lengthening)


@dataclass(frozen=True)
class Signorini(Reference):
    """A bar or a block that a rigid plane stops or presses, without friction, under uniform stress.

    Held at one end along its axis, loaded by a force at the other, it lengthens up to the plane: u = min(P L / (E A),
    gap), and the plane carries P - E A gap / L once in contact. A plane that is moved toward the bar compresses it,
    with uniform pressure on the face, as the patch test of contact requires (Taylor and Papadopoulos 1991); for blocks
    that press each other use `patch_test(...)`. Strain is small.

    It applies to a box, a cylinder, or a rectangle in `plane_strain` or `axisymmetric`, one end held along its normal,
    sides free or on planes of symmetry; one `rigid_contact` a rigid plane across the axis, or a box, and the body,
    without friction; and at most a `traction` on all of the end that meets it. With `poisson = 0` the end may be
    `fixed`. It can be compared with the metrics `displacement`, `force`, `contact_area` and `contact_pressure`.
    Source: Signorini 1933; Taylor and Papadopoulos 1991, On a patch test for contact problems in two dimensions.
    """

    body: Annotated[Any, "body", "the bar"]

    problem_kind: ClassVar[str] = "stopped_bar"
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Signorini 1933; Taylor and Papadopoulos 1991, in Nonlinear Computational Mechanics"
    error_meaning: ClassVar[str] = "rounding of the displacement, m: the formula solves its equations exactly"

    def solve(self, bar: StoppedBar) -> StoppedBar:
        """Return the bar itself, whose class contains the closed form."""
        return bar
