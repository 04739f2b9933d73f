"""Result of a solved beam: displacements of any point of the body that the beam represents."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from softmark.records import dataclass
from softmark.references.straight_cantilever import Cantilever, NotApplicable

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np

BEYOND = 1e-9
"""Share of the length by which a point may lie beyond an end: meshes round their coordinates."""


@dataclass(frozen=True)
class CentreLine:
    """Deformed centre line of a cantilever whose cross-sections stay plane and rigid.

    `axial`, `transverse` and `rotation` are functions of the arc length along the undeformed axis, (n,), m, in [0, L].
    They return the displacements along the axis and along gravity, m, and the rotation of the section, rad.
    """

    cantilever: Cantilever
    axial: Callable[[Array], Array]  # displacement along the axis, m
    transverse: Callable[[Array], Array]  # displacement along gravity, m
    rotation: Callable[[Array], Array]  # of the section, from the axis towards gravity, rad
    root_curvature: float  # d(rotation)/ds at the clamp, 1/m
    estimated_error: float  # m, error of the displacement of any point; numerical error only
    linearised: bool = False  # small rotations: a section moves by theta x r, to first order

    def displacement(self, X: Array) -> Array:
        """Return the displacement (n, 3), m, of the points X (n, 3), m, of the undeformed body.

        u = u_a a + u_d d + y [(-sin phi) a + (cos phi - 1) d], with a along the axis, d along gravity and y the offset
        of the point from the axis along d. Offsets normal to the plane of bending do not change. Raises NotApplicable
        for points that are not a finite (n, 3), or lie beyond an end of the beam.
        """
        points = as_points(X)
        a, d = np.asarray(self.cantilever.axis), np.asarray(self.cantilever.down)  # (3,) each
        from_root = points - np.asarray(self.cantilever.root)
        s = self._axis_positions(from_root @ a)  # (n,)
        y = from_root @ d
        along, across = self._offset_factors(self.rotation(s))
        return np.outer(self.axial(s) + y * along, a) + np.outer(self.transverse(s) + y * across, d)

    def _offset_factors(self, phi: Array) -> tuple[Array, Array]:
        if self.linearised:
            return -phi, np.zeros_like(phi)
        return -np.sin(phi), -2 * np.sin(phi / 2) ** 2  # cos(phi) - 1 without cancellation

    def _axis_positions(self, s: Array) -> Array:
        L = self.cantilever.length
        outside = (s < -BEYOND * L) | (s > (1 + BEYOND) * L)
        if outside.any():
            raise NotApplicable(
                f"{int(outside.sum())} of {len(s)} points lie beyond the ends of the beam, "
                f"the first {float(s[outside][0]):.6g} m along an axis of {L:.6g} m",
                "use only points between the two end sections of the undeformed body",
            )
        return np.clip(s, 0, L)


def as_points(X: Array) -> Array:
    """Return points (n, 3), m, as an array. Raises NotApplicable for anything else."""
    points = np.asarray(X, dtype=float)
    if points.ndim != 2 or points.shape[1] != 3:
        raise NotApplicable(f"the points have shape {points.shape}", "give them as (n, 3)")
    if not np.isfinite(points).all():
        raise NotApplicable("some coordinates of the points are not finite", "remove those points")
    return points
