"""Stretch at the points of a probe."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from softmark.interpreter.metrics.probe_samples import Over
from softmark.interpreter.metrics.tensor_metrics import TensorMetric
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.metrics.measurement import Floats
    from softmark.solvers.stress_recovery.stress_field import Stresses
    from softmark.solvers.stress_recovery.stress_measures import Tensors


@dataclass(frozen=True)
class Stretch(TensorMetric):
    """Stretch at the points of a probe: deformed length over undeformed length, 1 without deformation.

    Components are the principal stretches in descending order, the stretches |F e| of fibres along `x`, `y` or `z`, or
    the volume ratio J = det F. For a model of small strains they are 1 + strain, and 1 + its trace. The gradient is
    recovered like stress (see `stress`). The `largest` is the greatest of the values.

    Against another model, the value is |difference| at the points relative to the norm of that model's strain U - 1, as
    for `stress`: bodies that lengthen by 1 % and 2 % differ by half.

    The report also gives largest_1, least_1, at_m, points, norm_Pa, cells_apart_Pa and usual_stress_Pa, as `stress`
    does, and cells_apart_1, the relative difference between the strains of adjacent cells there.
    """

    probe: Annotated[str, "probe", "probe at whose points it is evaluated"]
    component: Annotated[
        Literal["principal_1", "principal_2", "principal_3", "x", "y", "z", "volume"],
        "direction of the stretch, or the volume ratio",
    ] = "principal_1"
    over: Annotated[Over, "largest value or mean over the points"] = "largest"
    against: Annotated[
        str | None, "reference or model", "solution taken as correct: a model, or a theory with this field"
    ] = None
    natural: ClassVar[str] = "1"

    def values(self, tensors: Tensors) -> Floats:
        """Return the requested stretch of each tensor (n,)."""
        return tensors.stretches(self.component)

    def tensors(self, tensors: Tensors) -> Floats:
        """Return Biot's strain U - 1 (n, 3, 3)."""
        return tensors.strain("biot")

    def usual(self, field: Stresses) -> float:
        """Return the root mean square strain of the body, dimensionless."""
        return field.usual[1]
