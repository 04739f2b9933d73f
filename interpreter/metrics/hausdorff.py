"""The largest distance between two surfaces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.metric_base import Metric
from softmark.interpreter.metrics.target_surface import known_surface
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass
from softmark.references.surface_geometry import SearchedSurface, open_edges, used

if TYPE_CHECKING:
    from softmark.interpreter.metrics.measurement import Seen


@dataclass(frozen=True)
class Hausdorff(Metric):
    """Largest distance between two surfaces, from any point of either to the other.

    max(max_a min_b |a - b|, max_b min_a |b - a|), with a over the points of the deformed surface and b anywhere in the
    triangles of the other, and the other way round. Where `surface_distance` asks only how far the model is from the
    measurement, this asks also whether the model leaves a part of it out. Each side is taken at the corners of its
    triangles: between them a distance may be larger, by no more than the size of a triangle.

    A measured surface that is open, or shows more than the body, makes the way from it to the model large for no fault
    of the model. Both ways stand in the report, and whether the measured surface is closed; the value is the larger
    one all the same.

    Beside its value a report has to_reference_m (from the model), to_model_m (from the reference), reference_closed
    and, if it is not closed, note.
    """

    probe: Annotated[str, "probe", "a probe of the surface"]
    against: Annotated[str, "reference or model", "the measured surface, or a reference with displacements"]
    unit: ClassVar[str] = "m"
    uncertain: ClassVar[bool] = True

    def measure(self, seen: Seen) -> Measurement:
        """The larger of the two one-sided distances. Raises Undefined without two surfaces."""
        if seen.triangles is None or not len(seen.triangles):
            raise Undefined("the way from the measured surface to the model needs a probe of a surface")
        known, x = known_surface(seen), seen.X + seen.u
        forth = known.closest(x).distances  # (n,)
        back = SearchedSurface(x, seen.triangles).closest(used(known.points, known.triangles)[0]).distances
        closed = open_edges(known.triangles) == 0
        details: dict[str, Any] = {
            "to_reference_m": float(forth.max()),
            "to_model_m": float(back.max()),
            "reference_closed": closed,
        }
        if not closed:
            details["note"] = "the surface of the reference is open: what it shows beyond the body counts as distance"
        return Measurement(float(max(forth.max(), back.max())), details, at_points=forth)
