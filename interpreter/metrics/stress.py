"""Stress at the points of a probe."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from softmark.interpreter.metrics.probe_samples import Over
from softmark.interpreter.metrics.tensor_metrics import TensorMetric
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.metrics.measurement import Floats
    from softmark.solvers.stress_recovery.stress_field import Part, Stresses
    from softmark.solvers.stress_recovery.stress_measures import Tensors

AXES = ("xx", "yy", "zz", "xy", "yz", "zx")  # components of a nominal stress, which is not symmetric


@dataclass(frozen=True)
class Stress(TensorMetric):
    """Stress at the points of a probe: at a point, or the largest or the mean over a line, a surface or a volume.

    `cauchy` is force per deformed area. `nominal` is force along the first axis per undeformed area normal to the
    second, P = J sigma F^-T, as a testing machine reports it; `xx` ... `zx` are components along the axes of the scene.
    Principal values are in descending order, tension is positive; `pressure` is positive in compression. For small
    strains both measures are the same. The `largest` is the value of greatest magnitude, with its sign; in a dynamic
    analysis it is that of the last time. In a volume it is also searched on the surface, at corners and at mesh nodes.
    The `mean` is the integral over the line, surface or volume divided by its size, split where the material changes.

    At a point on an interface of materials there are two values: the largest is taken from both, a mean uses the
    average of both, and `sides_Pa` lists both if the value lies on an interface. On loaded and free surfaces the stress
    is compared with the applied traction (W405), and a stated error includes the difference.

    Beams in a static analysis have the stress of their sections by the theories of Navier and Saint-Venant, valid one
    section width away from supports, loads and joints (W356).

    The stress of the cells follows from the law and, in mixed elements, from the pressures, and jumps between cells.
    This metric uses a continuous stress, recovered at nodes by polynomials over patches of cells (Zienkiewicz and Zhu
    1992). For smooth problems its error was observed to fall with h^2 in linear elements and with h^3 in quadratic
    ones, one order better than the cells' own stress. Near edges of supports, re-entrant corners and point forces the
    elastic stress is singular: every refinement finds a larger value. A warning appears if the cells around the point
    disagree (W387), and no error is stated if refinement does not converge.

    Against another model, the value is |difference| at the points, the `largest` or the `mean`, relative to the norm of
    that model's tensor, the largest or the mean over the same points; so a zero component can be compared too.

    The report also gives largest_Pa and least_Pa over the points, the position of the greatest magnitude (at_m), the
    number of points, norm_Pa of the tensor at that position, cells_apart_Pa (the root mean square difference between
    the stress of the cells around it and the recovered one), usual_stress_Pa (the root mean square of stress in the
    body), and cells_apart_1, the relative difference in the part of the tensor that matters: for von Mises stress and
    shear the deviator, which a pressure would hide. Against another model it gives difference_Pa, size_Pa (the
    denominator), at_m and points.
    """

    probe: Annotated[str, "probe", "probe at whose points it is evaluated"]
    component: Annotated[
        Literal[
            "von_mises", "pressure", "principal_1", "principal_2", "principal_3", "xx", "yy", "zz", "xy", "yz", "zx"
        ],
        "component of the tensor",
    ] = "von_mises"
    measure_: Annotated[Literal["cauchy", "nominal"], "stress per deformed area or per undeformed area"] = "cauchy"
    over: Annotated[Over, "largest value or mean over the points"] = "largest"
    against: Annotated[
        str | None, "reference or model", "solution taken as correct: a model, or a theory with this field"
    ] = None
    natural: ClassVar[str] = "Pa"

    @property
    def decisive_tensor_part(self) -> Part:
        """Part of the tensor that determines the value: the deviator for von Mises stress and shear along the axes."""
        return "stress deviator" if self.component in ("von_mises", "xy", "yz", "zx") else "stress"

    def values(self, tensors: Tensors) -> Floats:
        """Return the requested component or invariant of each tensor (n,), Pa."""
        from softmark.solvers.stress_recovery.stress_measures import extract_component

        return extract_component(self.tensors(tensors), self.component)

    def tensors(self, tensors: Tensors) -> Floats:
        """Return the stress tensors (n, 3, 3), Pa."""
        return tensors.cauchy if self.measure_ == "cauchy" else tensors.nominal

    def usual(self, field: Stresses) -> float:
        """Return the root mean square stress of the body, Pa."""
        return field.usual[0]
