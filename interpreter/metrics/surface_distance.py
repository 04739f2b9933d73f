"""Distance of a deformed surface from a measured one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from softmark.interpreter.metrics.distance_statistics import (
    DistanceStatistic,
    SurfaceStatistic,
    summarize_distances,
    summarize_ratios,
)
from softmark.interpreter.metrics.target_surface import find_target_surface, side_of_surface
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass
from softmark.references.surface_geometry import normal_distances, vertex_normals

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.measurement import Floats, Measurement, MetricInput
    from softmark.references.surface_geometry import SurfaceSearch
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class SurfaceDistance(DistanceStatistic):
    """Distance from the points of a deformed surface to a measured surface: its mean, or another statistic of it.

    For each point x = X + u of the probe, d is the distance to the measured surface, inside its triangles and not
    only at their corners. `along = nearest` takes the closest point. `along = normal` goes from x along the normal of
    the deformed surface, both ways, to the first intersection within `reach`: points without an intersection are left
    out and counted, and with a long reach some find the far side of the body. The value is the mean of d over the
    points, its population standard deviation sd = sqrt(mean(d^2) - mean(d)^2), its largest value or its root mean
    square. Points count equally, so a probe with the points of another study's mesh repeats its weights. Against a
    reference with displacements, the surface is that of the probe as the reference deforms it.

    Either distance is a lower bound: a point may find a different part of the surface than its own, and a surface that
    slides along itself shows no error. The metric is meaningful for errors that are small compared with the body;
    `relative_l2_error` and `tip_error` follow material points if a reference has them.

    Relative, as the authors of Table 1 compute it: r_i = d_i / d0_i with d0_i = |x2_i - X_i - dx0|, where x2_i is the
    point found on the measured surface and dx0 = x2_0 - X_0 is the same for one fixed point, taken as a rigid offset of
    the measurement; points with d0 of a micrometre or less are left out. Their fixed point is the first point of their
    mesh, a clamped one. Here it is the point that the model moves least, the first if there are several: the same on
    their mesh, and independent of numbering on others. The relative mean is the mean of these ratios and not the ratio
    of the means, and its standard deviation is large because points near the clamp divide by small numbers. In their
    code a point with nothing within its distance limit counts as d = 0; here there is no limit.

    The report also gives mean_m, sd_m, max_m, min_m, rms_m and p95_m of d; bias_m (mean of d with a sign, positive
    outside the measured surface); relative_mean, relative_sd, relative_points and relative_offset_m (|dx0|);
    by_displacement_mean, _sd and _points (d_i / |u_i|: each point by its own displacement in the model, as the paper
    states it and an earlier version of their program computed it; run again on their mesh, this version gives the
    relative columns of Table 1); points, without_hit and, along normals, reach_m.

    Source: Marchal, Allard, Duriez and Cotin (2008), section 2.2 and Table 1; their EvalSurfaceDistance in SOFA (2008).
    """

    probe: Annotated[str, "probe", "a probe of the surface, or of points that lie on it"]
    against: Annotated[str, "reference or model", "the measured surface, or a reference with displacements"]
    statistic: Annotated[SurfaceStatistic, "statistic of the distances"] = "mean"
    along: Annotated[Literal["nearest", "normal"], "how the distance of a point is measured"] = "nearest"
    reach: Annotated[float | None, "m in (0, inf)",
                     "search distance along a normal; default: extent of the measured surface"] = None  # fmt: skip

    def measure(self, seen: MetricInput) -> Measurement:
        """Return the requested statistic of the distances.

        Raises Undefined without a surface, or if no normal intersects it.
        """
        target, x = find_target_surface(seen), seen.X + seen.u
        found = self._distances_along_normals if self.along == "normal" else self._distances_to_nearest_points
        signed, foot, more = found(seen, x, target)
        met = np.isfinite(signed)
        if not met.any():
            raise Undefined("no normal of the deformed surface meets the measured surface within the search distance")
        d = np.abs(signed[met])  # (points,)
        details = {
            **summarize_distances(d),
            "bias_m": float(signed[met].mean()),
            **summarize_relative_distances(d, seen.X[met], seen.u[met], foot[met]),
            **summarize_ratios(d, np.linalg.norm(seen.u[met], axis=1), "by_displacement"),
            "points": len(d),
            "without_hit": int((~met).sum()),
            **more,
        }
        return self.make_measurement(details, d, d if met.all() else None)

    def _distances_to_nearest_points(
        self, seen: MetricInput, x: Floats, target: SurfaceSearch
    ) -> tuple[Floats, Floats, dict[str, Any]]:
        """Return signed distances (n,), m, of points x (n, 3) to the target, closest points (n, 3) and details."""
        closest = target.closest(x)
        return closest.distances * side_of_surface(x, closest, target), closest.points, {}

    def _distances_along_normals(
        self, seen: MetricInput, x: Floats, target: SurfaceSearch
    ) -> tuple[Floats, Floats, dict[str, Any]]:
        """Return signed distances (n,), m, of points x (n, 3) along normals, intersections (n, 3) and details.

        The distance is inf without an intersection.
        """
        if seen.triangles is None or not len(seen.triangles):
            raise Undefined("distances along normals need a surface probe")
        reach = self.reach or float(np.linalg.norm(np.ptp(target.points, axis=0)))
        normals = vertex_normals(x, seen.triangles)
        t = normal_distances(x, normals, target.points, target.triangles)
        t = np.where(np.abs(t) <= reach, t, np.inf)
        foot = x + np.where(np.isfinite(t), t, 0.0)[:, None] * normals
        # a surface found along the outward normal lies outside the model: the model is inside, so the sign is negative
        return -t, foot, {"reach_m": reach}


def summarize_relative_distances(d: Floats, X: Floats, u: Floats, foot: Floats) -> dict[str, Any]:
    """Return statistics of the distances d (n,), each divided by the displacement of its point in the measurement.

    The measured displacement of a point X (n, 3) is the vector to the point `foot` (n, 3) found for it on the
    measured surface, minus the same vector of the point with the smallest displacement u in the model.
    """
    held = int((u**2).sum(axis=1).argmin())
    offset = foot[held] - X[held]
    moved = np.linalg.norm(foot - X - offset, axis=1)
    return {**summarize_ratios(d, moved, "relative"), "relative_offset_m": float(np.linalg.norm(offset))}
