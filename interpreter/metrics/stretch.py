"""How much longer a body is, where it is looked at, than it was."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from softmark.interpreter.metrics.probe_samples import Over
from softmark.interpreter.metrics.tensor_metrics import OfTensors
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.metrics.measurement import Floats
    from softmark.solvers.stress_recovery.stress_field import Stresses
    from softmark.solvers.stress_recovery.stress_measures import Tensors


@dataclass(frozen=True)
class Stretch(OfTensors):
    """Length over length at rest, at the points of a probe; 1 where nothing has changed.

    Principal stretches in falling order, those of fibres that lay along `x`, `y` or `z`, |F e|, or the ratio of volumes
    J = det F. Where a model measures small strains, 1 + strain, and 1 + its trace. Recovered as stress is (see
    `stress`). The `largest` is the greatest of the values.

    Against another model it is |difference| at the points relative to the norm of that model's strain U - 1, as of
    `stress`: two that lengthen by 1 % and 2 % differ by half.

    Beside its value a report has largest_1, least_1, at_m, points, norm_Pa, cells_apart_Pa and usual_stress_Pa, as
    `stress` does, and cells_apart_1, the share by which strains of the cells differ there.
    """

    probe: Annotated[str, "probe", "where it is looked at"]
    component: Annotated[
        Literal["principal_1", "principal_2", "principal_3", "x", "y", "z", "volume"], "of which length, or of volumes"
    ] = "principal_1"
    over: Annotated[Over, "which of the values at the points"] = "largest"
    against: Annotated[
        str | None, "reference or model", "what is taken as right: a model, or a theory that knows it"
    ] = None
    natural: ClassVar[str] = "1"

    def values(self, tensors: Tensors) -> Floats:
        """(n,)."""
        return tensors.stretches(self.component)

    def tensors(self, tensors: Tensors) -> Floats:
        """Those of Biot's strain (n, 3, 3), which is U - 1."""
        return tensors.strain("biot")

    def usual(self, field: Stresses) -> float:
        """No unit."""
        return field.usual[1]
