"""How far a deformed surface is from a measured one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from softmark.interpreter.metrics.distance_statistics import Summed, SurfaceStatistic, ratios, spread
from softmark.interpreter.metrics.target_surface import known_surface, side
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass
from softmark.references.surface_geometry import normal_distances, vertex_normals

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.measurement import Floats, Measurement, Seen
    from softmark.references.surface_geometry import SearchedSurface
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class SurfaceDistance(Summed):
    """Distance from the points of a deformed surface to a measured surface: its mean, or another statistic of it.

    For each point x = X + u of the probe, d is the distance to the measured surface, inside its triangles and not
    only at their corners. `along = nearest` takes the closest point; `along = normal` goes from x along the normal of
    the deformed surface, both ways, to the first point met within `reach`: points that meet nothing are left out and
    counted, and a long reach lets some meet the far side of the body. The value is the mean of d over the points, its
    population standard deviation sd = sqrt(mean(d^2) - mean(d)^2), its largest value or its root mean square. Points
    count equally, so a probe with the points of another study's mesh repeats its weights. Against a reference with
    displacements, the surface is that of the probe as the reference deforms it.

    Either distance is a lower bound: a point may find another part of the surface than the one that it should lie on,
    and a surface that slides along itself is no error. It means what it says for errors that are small beside the
    body; `energy_norm` and `tip_error` follow material points where a reference has them.

    Relative, as the authors of Table 1 compute it: r_i = d_i / d0_i with d0_i = |x2_i - X_i - dx0|, where x2_i is the
    point found on the measured surface and dx0 = x2_0 - X_0 the same for one point that is held, taken for a rigid
    offset of the measurement; points with d0 of a micrometre or less are left out. Theirs is the first point of their
    mesh, a clamped one; here it is the one that the model moves least, the first if there are several: the same on
    their mesh, and no accident of numbering on others. The relative mean is the mean of these ratios and not the
    ratio of the means, and the spread is large because points near the clamp divide by little. In their code a point
    with nothing within its limit of distance counts as d = 0; here no limit is set.

    Beside its value a report has mean_m, sd_m, max_m, min_m, rms_m and p95_m of d; bias_m (mean of d with a sign,
    positive outside the measured surface); relative_mean, relative_sd, relative_points and relative_offset_m (|dx0|);
    by_displacement_mean, _sd and _points (d_i / |u_i|: each point by its own displacement in the model, as the paper
    says it, and as an earlier version of their program did: run again on their mesh, it is this one that gives the
    relative columns of Table 1); points, without_hit and, along normals, reach_m.

    Source: Marchal, Allard, Duriez and Cotin (2008), section 2.2 and Table 1; their EvalSurfaceDistance in SOFA (2008).
    """

    probe: Annotated[str, "probe", "a probe of the surface, or of points that lie on it"]
    against: Annotated[str, "reference or model", "the measured surface, or a reference with displacements"]
    statistic: Annotated[SurfaceStatistic, "which number is the value"] = "mean"
    along: Annotated[Literal["nearest", "normal"], "how the distance of a point is taken"] = "nearest"
    reach: Annotated[float | None, "m in (0, inf)",
                     "how far along a normal is looked; the extent of the measured surface"] = None  # fmt: skip

    def measure(self, seen: Seen) -> Measurement:
        """The statistic of the distances. Raises Undefined where there is no surface, or no normal meets it."""
        target, x = known_surface(seen), seen.X + seen.u
        found = self._along_normals if self.along == "normal" else self._nearest
        signed, foot, more = found(seen, x, target)
        met = np.isfinite(signed)
        if not met.any():
            raise Undefined("no normal of the deformed surface meets the measured one within reach")
        d = np.abs(signed[met])  # (points,)
        details = {
            **spread(d),
            "bias_m": float(signed[met].mean()),
            **relative(d, seen.X[met], seen.u[met], foot[met]),
            **ratios(d, np.linalg.norm(seen.u[met], axis=1), "by_displacement"),
            "points": len(d),
            "without_hit": int((~met).sum()),
            **more,
        }
        return self.summed(details, d, d if met.all() else None)

    def _nearest(self, seen: Seen, x: Floats, target: SearchedSurface) -> tuple[Floats, Floats, dict[str, Any]]:
        """Signed distances (n,), points found (n, 3), further details."""
        closest = target.closest(x)
        return closest.distances * side(x, closest, target), closest.points, {}

    def _along_normals(self, seen: Seen, x: Floats, target: SearchedSurface) -> tuple[Floats, Floats, dict[str, Any]]:
        """As above along normals; inf where nothing is met."""
        if seen.triangles is None or not len(seen.triangles):
            raise Undefined("normals need a probe of a surface")
        reach = self.reach or float(np.linalg.norm(np.ptp(target.points, axis=0)))
        normals = vertex_normals(x, seen.triangles)
        t = normal_distances(x, normals, target.points, target.triangles)
        t = np.where(np.abs(t) <= reach, t, np.inf)
        foot = x + np.where(np.isfinite(t), t, 0.0)[:, None] * normals
        # a surface that is met outwards lies outside the model, so the model is inside: the other sign
        return -t, foot, {"reach_m": reach}


def relative(d: Floats, X: Floats, u: Floats, foot: Floats) -> dict[str, Any]:
    """Distances d (n,) by how far points went from X to `foot` (n, 3), less the motion of the one with the least u."""
    held = int((u**2).sum(axis=1).argmin())
    offset = foot[held] - X[held]
    moved = np.linalg.norm(foot - X - offset, axis=1)
    return {**ratios(d, moved, "relative"), "relative_offset_m": float(np.linalg.norm(offset))}
