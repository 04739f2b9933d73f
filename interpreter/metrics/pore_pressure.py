"""Pore pressure of a porous body, and outflow of its fluid."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.interpreter.metrics.metric_base import ForceMetric
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.metric_base import Floats
    from softmark.interpreter.results.reaction_results import EquilibriumForces, Fluid
else:
    from softmark.solvers.runtime.lazy_modules import np


def _require_fluid_results(rest: EquilibriumForces) -> Fluid:
    """Return the fluid results of the body. Raises Undefined if it has none."""
    if rest.fluid is None:
        raise Undefined("the body has no fluid: make its material `biphasic(...)`")
    return rest.fluid


@dataclass(frozen=True)
class PorePressure(ForceMetric):
    """Pore pressure at a material point of a `biphasic` body, relative to the outside; positive in compression.

    Pressures are linear between the corners of cells. Against another model or a theory, the value is the difference
    relative to that solution.

    The report also gives least_Pa and largest_Pa over the whole body.
    """

    body: Annotated[str, "body", "the body"]
    at: Annotated[tuple[float, float, float], "m", "point, by its undeformed coordinates"]
    against: Annotated[str | None, "reference or model", "solution taken as correct"] = None
    natural: ClassVar[str] = "Pa"
    followed: ClassVar[bool] = False

    @property
    def subject_name(self) -> str:
        """Name of the body whose pore pressure is measured."""
        return self.body

    def amount(self, rest: EquilibriumForces) -> Floats:
        """Return the pore pressure at the point, and the least and the largest in the body, Pa.

        Raises Undefined if there is no fluid.
        """
        return np.array([_require_fluid_results(rest).pressure(self.at), *_require_fluid_results(rest).pressures])

    def size(self, value: Floats) -> float:
        """Return the magnitude of the pressure at the point."""
        return abs(float(value[0]))

    def _along(self, value: Floats) -> float:
        """Return the pore pressure at the point of the metric, Pa."""
        return float(value[0])

    def acting(self, rest: EquilibriumForces) -> float:
        """Return the largest pore pressure in the body, Pa."""
        return max(map(abs, _require_fluid_results(rest).pressures))

    def details(self, value: Floats) -> dict[str, Any]:
        """Return the report entries of the least and the largest pressure in the body."""
        return {"least_Pa": float(value[1]), "largest_Pa": float(value[2])}


@dataclass(frozen=True)
class Outflow(ForceMetric):
    """Volume of fluid that has left a `biphasic` body through a permeable support since the start.

    It is the residual of the pressure equations at the support, so that all outflows and the change of the body's
    volume sum to zero; `solve.fluid.balance` of the report gives the remaining imbalance. Against another model or a
    theory, the value is the difference relative to that solution.
    """

    of: Annotated[str, "support", "`drained(...)` or `pore_pressure(...)`"]
    against: Annotated[str | None, "reference or model", "solution taken as correct"] = None
    natural: ClassVar[str] = "m^3"
    followed: ClassVar[bool] = False

    @property
    def subject_name(self) -> str:
        """Name of the support through which fluid flows out."""
        return self.of

    def amount(self, rest: EquilibriumForces) -> Floats:
        """Return the fluid volume that has left through the support, m^3. Raises Undefined if there is no fluid."""
        outflows = _require_fluid_results(rest).outflows
        if self.of not in outflows:
            raise Undefined(
                f"no fluid flows through `{self.of}`: use a support made by `drained(...)` or `pore_pressure(...)`"
            )
        return np.array(outflows[self.of])

    def acting(self, rest: EquilibriumForces) -> float:
        """Return the largest outflow of all supports, m^3."""
        return max(map(abs, _require_fluid_results(rest).outflows.values()))
