"""The strain in a body."""

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
class Strain(OfTensors):
    """Strain at the points of a probe: at a point, or the largest or the mean over a line, a surface or a volume.

    With F = R U: `green` is (F^T F - I)/2, `biot` U - I, the change of length per length along principal axes, and
    `logarithmic` ln U. Where a model measures small strains, all three are the symmetric part of the gradient of
    displacements. `xy` and its like are tensor components, half the change of an angle. The gradient is recovered as
    stress is, with the same orders (see `stress`), and what is said there of edges and corners holds as well.

    Against another model it is |difference| at the points relative to the norm of that model's strain, as of `stress`.

    Beside its value a report has largest_1, least_1, at_m, points, norm_Pa, cells_apart_Pa and usual_stress_Pa, as
    `stress` does, and cells_apart_1, the share by which strains of the cells differ there.
    """

    probe: Annotated[str, "probe", "where it is looked at"]
    component: Annotated[
        Literal["principal_1", "principal_2", "principal_3", "xx", "yy", "zz", "xy", "yz", "zx"],
        "which number of the tensor",
    ] = "principal_1"
    measure_: Annotated[Literal["green", "biot", "logarithmic"], "which tensor"] = "green"
    over: Annotated[Over, "which of the values at the points"] = "largest"
    against: Annotated[
        str | None, "reference or model", "what is taken as right: a model, or a theory that knows it"
    ] = None
    natural: ClassVar[str] = "1"

    def values(self, tensors: Tensors) -> Floats:
        """(n,)."""
        from softmark.solvers.stress_recovery.stress_measures import component_of

        return component_of(self.tensors(tensors), self.component)

    def tensors(self, tensors: Tensors) -> Floats:
        """(n, 3, 3)."""
        return tensors.strain(self.measure_)

    def usual(self, field: Stresses) -> float:
        """No unit."""
        return field.usual[1]
