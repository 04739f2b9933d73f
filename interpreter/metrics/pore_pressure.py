"""The pressure of the fluid in a porous body, and what has left it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.interpreter.metrics.metric_base import OfForces
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.metric_base import Floats
    from softmark.interpreter.results.reaction_results import AtRest, Fluid
else:
    from softmark.solvers.runtime.lazy_modules import np


def _fluid(rest: AtRest) -> Fluid:
    if rest.fluid is None:
        raise Undefined("there is no fluid in this body as this model has it: its material is to be `biphasic(...)`")
    return rest.fluid


@dataclass(frozen=True)
class PorePressure(OfForces):
    """Pressure of the fluid at a material point of a `biphasic` body, above that outside: positive where it is pressed.

    Pressures are linear between the corners of cells. Against another model it is the difference relative to that
    one's.

    Beside its value a report has least_Pa and largest_Pa, those of the whole body.
    """

    body: Annotated[str, "body", "the body"]
    at: Annotated[tuple[float, float, float], "m", "the point, by its coordinates before deformation"]
    against: Annotated[str | None, "reference or model", "what is taken as right"] = None
    natural: ClassVar[str] = "Pa"
    followed: ClassVar[bool] = False

    @property
    def concerned(self) -> str:
        """The body."""
        return self.body

    def amount(self, rest: AtRest) -> Floats:
        """In Pa. Raises Undefined where there is no fluid."""
        return np.array([_fluid(rest).pressure(self.at), *_fluid(rest).pressures])

    def size(self, value: Floats) -> float:
        """Of that at the point."""
        return abs(float(value[0]))

    def _along(self, value: Floats) -> float:
        return float(value[0])

    def acting(self, rest: AtRest) -> float:
        """The largest pressure, Pa."""
        return max(map(abs, _fluid(rest).pressures))

    def details(self, value: Floats) -> dict[str, Any]:
        """The least and the largest."""
        return {"least_Pa": float(value[1]), "largest_Pa": float(value[2])}


@dataclass(frozen=True)
class Outflow(OfForces):
    """Volume of fluid that has left a `biphasic` body through a support that lets it through, since the start.

    It is what the equations of the pressures there leave over, so that outflows and the change of the body's volume
    come to nothing: `solve.fluid.balance` of the report says how well. Against another model it is the difference
    relative to that one's.
    """

    of: Annotated[str, "support", "`drained(...)` or `pore_pressure(...)`"]
    against: Annotated[str | None, "reference or model", "what is taken as right"] = None
    natural: ClassVar[str] = "m^3"
    followed: ClassVar[bool] = False

    @property
    def concerned(self) -> str:
        """The support."""
        return self.of

    def amount(self, rest: AtRest) -> Floats:
        """In m^3. Raises Undefined where there is no fluid."""
        outflows = _fluid(rest).outflows
        if self.of not in outflows:
            raise Undefined(f"no fluid goes through `{self.of}`: ask it of `drained(...)` or `pore_pressure(...)`")
        return np.array(outflows[self.of])

    def acting(self, rest: AtRest) -> float:
        """The largest outflow, m^3."""
        return max(map(abs, _fluid(rest).outflows.values()))
