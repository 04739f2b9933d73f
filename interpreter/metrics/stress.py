"""The stress in a body."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from softmark.interpreter.metrics.probe_samples import Over
from softmark.interpreter.metrics.tensor_metrics import OfTensors
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.metrics.measurement import Floats
    from softmark.solvers.stress_recovery.stress_field import Part, Stresses
    from softmark.solvers.stress_recovery.stress_measures import Tensors

AXES = ("xx", "yy", "zz", "xy", "yz", "zx")  # what a nominal stress, which is not symmetric, has


@dataclass(frozen=True)
class Stress(OfTensors):
    """Stress at the points of a probe: at a point, or the largest or the mean over a line, a surface or a volume.

    `cauchy` is force per area as the body is deformed, `nominal` force along the first axis per area at rest across the
    second, P = J sigma F^-T, what a testing machine reports; `xx` ... `zx` are components by the axes of the scene.
    Principal values are in falling order, tension is positive; `pressure` is positive in compression. Where strains are
    small, both measures are one. The `largest` is that of the greatest magnitude, with its sign; in motion it is that
    of the last moment. Over a volume it is looked for on its surface, at its corners and at nodes of the mesh too. The
    `mean` is the integral over the line, the surface or the volume by its size, split where the material changes.

    At a point on an interface of materials there are two values: the largest is taken from both, a mean counts half of
    each, and `sides_Pa` has both where the number lies on an interface. On loaded and free faces stress is compared
    with what acts there (W405), and a stated error holds the difference.

    Beams at rest have that of their sections, by the theories of Navier and Saint-Venant, which holds a width away from
    what holds, loads or joins them (W356).

    Stress of the cells follows from the law and, where they have pressures, from these, and jumps from cell to cell.
    What is told here is recovered from it to nodes by polynomials over patches of cells (Zienkiewicz and Zhu 1992) and
    is continuous: its error falls with h^2 in linear elements and with h^3 in quadratic ones, by observation over
    smooth problems, one order sooner than the cells' own. Near edges where a face is held, corners that turn inward and
    forces on points, elasticity has no largest stress: every refinement finds a larger one. A warning says where the
    cells around the place do not agree (W387), and a stated error has no number where refinement finds no limit.

    Against another model it is |difference| at the points, the `largest` or the `mean`, relative to the norm of that
    model's tensor, the largest or the mean over the same points: so a component that is zero can be compared too.

    Beside its value a report has largest_Pa and least_Pa over the points, where the greatest magnitude lies (at_m), the
    number of points, norm_Pa of the tensor at that place, cells_apart_Pa, by how much stresses of the cells around it
    differ from what is recovered in the mean square, usual_stress_Pa, the root mean square of stress in the body, and
    cells_apart_1, the share by which they differ in what the number is made of: of von Mises' stress and of shear the
    deviator, which a pressure would hide.
    Of one against another model it has difference_Pa, size_Pa, which that is relative to, at_m and points.
    """

    probe: Annotated[str, "probe", "where it is looked at"]
    component: Annotated[
        Literal[
            "von_mises", "pressure", "principal_1", "principal_2", "principal_3", "xx", "yy", "zz", "xy", "yz", "zx"
        ],
        "which number of the tensor",
    ] = "von_mises"
    measure_: Annotated[Literal["cauchy", "nominal"], "per deformed area, or per area at rest"] = "cauchy"
    over: Annotated[Over, "which of the values at the points"] = "largest"
    against: Annotated[
        str | None, "reference or model", "what is taken as right: a model, or a theory that knows it"
    ] = None
    natural: ClassVar[str] = "Pa"

    @property
    def made_of(self) -> Part:
        """No pressure stands in von Mises' stress, nor in shear across the axes."""
        return "stress deviator" if self.component in ("von_mises", "xy", "yz", "zx") else "stress"

    def values(self, tensors: Tensors) -> Floats:
        """(n,), Pa."""
        from softmark.solvers.stress_recovery.stress_measures import component_of

        return component_of(self.tensors(tensors), self.component)

    def tensors(self, tensors: Tensors) -> Floats:
        """(n, 3, 3), Pa."""
        return tensors.cauchy if self.measure_ == "cauchy" else tensors.nominal

    def usual(self, field: Stresses) -> float:
        """Pa."""
        return field.usual[0]
