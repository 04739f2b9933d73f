"""Volume change of a body."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.metric_base import Metric
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass
from softmark.references.surface_geometry import count_open_edges, signed_volume

if TYPE_CHECKING:
    from softmark.interpreter.metrics.measurement import MetricInput


@dataclass(frozen=True)
class VolumeChange(Metric):
    """Relative change of the volume that a body's surface encloses.

    v / V - 1, with v of the deformed surface and V of the undeformed one. Each is the sum of signed tetrahedra
    a . (b x c) / 6 over the triangles (a, b, c) of the probe (divergence theorem), exact for the faceted surface: the
    facets cut the same corners off both. An incompressible solid has 0 under any load; a solid of Poisson's ratio nu
    under a uniaxial strain e has about (1 - 2 nu) e. It works for models and references alike, and needs a probe of a
    whole surface.

    The report also gives volume_m3 and rest_volume_m3.
    """

    probe: Annotated[str, "probe", "the body's whole surface"]
    unit: ClassVar[str] = "1"
    uncertain: ClassVar[bool] = False

    def measure(self, seen: MetricInput) -> Measurement:
        """Return the relative volume change v / V - 1. Raises Undefined unless the triangles form a closed surface."""
        if seen.triangles is None or not len(seen.triangles):
            raise Undefined("a volume change needs a probe of the body's whole surface")
        if gaps := count_open_edges(seen.triangles):
            raise Undefined(
                f"the surface of the probe is not closed ({gaps} unmatched edges), so it encloses no volume"
            )
        rest, now = (signed_volume(x, seen.triangles) for x in (seen.X, seen.X + seen.u))
        if rest == 0.0:
            raise Undefined("the undeformed surface encloses no volume")
        return Measurement(now / rest - 1.0, {"volume_m3": abs(now), "rest_volume_m3": abs(rest)})
