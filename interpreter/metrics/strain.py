"""Strain at the points of a probe."""

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
class Strain(TensorMetric):
    """Strain at the points of a probe: at a point, or the largest or the mean over a line, a surface or a volume.

    With F = R U: `green` is (F^T F - I)/2, `biot` is U - I (the change of length per length along principal axes), and
    `logarithmic` is ln U. For a model of small strains all three are the symmetric part of the displacement gradient.
    `xy` and the like are tensor components, half the change of an angle. The gradient is recovered like stress, with
    the same orders and the same limits at edges and corners (see `stress`).

    Against another model, the value is |difference| at the points relative to the norm of that model's strain, as for
    `stress`.

    The report also gives largest_1, least_1, at_m, points, norm_Pa, cells_apart_Pa and usual_stress_Pa, as `stress`
    does, and cells_apart_1, the relative difference between the strains of adjacent cells there.
    """

    probe: Annotated[str, "probe", "probe at whose points it is evaluated"]
    component: Annotated[
        Literal["principal_1", "principal_2", "principal_3", "xx", "yy", "zz", "xy", "yz", "zx"],
        "component of the tensor",
    ] = "principal_1"
    measure_: Annotated[Literal["green", "biot", "logarithmic"], "strain measure"] = "green"
    over: Annotated[Over, "largest value or mean over the points"] = "largest"
    against: Annotated[
        str | None, "reference or model", "solution taken as correct: a model, or a theory with this field"
    ] = None
    natural: ClassVar[str] = "1"

    def values(self, tensors: Tensors) -> Floats:
        """Return the requested component or invariant of each tensor (n,)."""
        from softmark.solvers.stress_recovery.stress_measures import extract_component

        return extract_component(self.tensors(tensors), self.component)

    def tensors(self, tensors: Tensors) -> Floats:
        """Return the strain tensors (n, 3, 3)."""
        return tensors.strain(self.measure_)

    def usual(self, field: Stresses) -> float:
        """Return the root mean square strain of the body, dimensionless."""
        return field.usual[1]
