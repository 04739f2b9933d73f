"""A probe of somebody else."""

from typing import Annotated

from softmark.interpreter.vocabulary.probe_words import Probe
from softmark.records import dataclass

SOFTMARK = {"probes": {"pair": "Pair"}}


@dataclass(frozen=True)
class Pair(Probe):
    """The displacements of a point and of its mirror image below the middle."""

    body: Annotated[str, "body", "the body that is looked at"]
    at: Annotated[tuple[float, float, float], "m", "the point, before deformation"]

    @property
    def stations(self):
        """The material points, m."""
        x, y, z = self.at
        return (x, y, z), (x, y, -z)
