"""Hausdorff distance between two surfaces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.metric_base import Metric
from softmark.interpreter.metrics.target_surface import find_target_surface
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass
from softmark.references.surface_geometry import SurfaceSearch, count_open_edges, drop_unused_points

if TYPE_CHECKING:
    from softmark.interpreter.metrics.measurement import MetricInput


@dataclass(frozen=True)
class Hausdorff(Metric):
    """Hausdorff distance: the largest distance between two surfaces, from any point of either to the other.

    max(max_a min_b |a - b|, max_b min_a |b - a|), with a over the points of the deformed surface and b anywhere in the
    triangles of the other surface, and vice versa. While `surface_distance` measures only the distance from the model
    to the measurement, this also detects parts of the measurement that the model misses. Each side is evaluated at the
    corners of its triangles; between them a distance may be larger, by at most the size of a triangle.

    A measured surface that is open, or shows more than the body, makes the distance from it to the model large although
    the model is not wrong. The report gives both directions, and whether the measured surface is closed; the value is
    always the larger one.

    The report also gives to_reference_m (from the model), to_model_m (from the reference), reference_closed and, if it
    is not closed, note.
    """

    probe: Annotated[str, "probe", "a probe of the surface"]
    against: Annotated[str, "reference or model", "the measured surface, or a reference with displacements"]
    unit: ClassVar[str] = "m"
    uncertain: ClassVar[bool] = True

    def measure(self, seen: MetricInput) -> Measurement:
        """Return the larger of the two one-sided distances. Raises Undefined without two surfaces."""
        if seen.triangles is None or not len(seen.triangles):
            raise Undefined("the distance from the measured surface to the model needs a surface probe")
        known, x = find_target_surface(seen), seen.X + seen.u
        forth = known.closest(x).distances  # (n,)
        back = SurfaceSearch(x, seen.triangles).closest(drop_unused_points(known.points, known.triangles)[0]).distances
        closed = count_open_edges(known.triangles) == 0
        details: dict[str, Any] = {
            "to_reference_m": float(forth.max()),
            "to_model_m": float(back.max()),
            "reference_closed": closed,
        }
        if not closed:
            details["note"] = "the surface of the reference is open: parts of it beyond the body count as distance"
        return Measurement(float(max(forth.max(), back.max())), details, at_points=forth)
