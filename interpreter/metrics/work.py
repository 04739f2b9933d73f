"""What a load does along the displacements of a body."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.metric_base import OfForces
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.metric_base import Floats
    from softmark.interpreter.results.reaction_results import AtRest
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class LoadWork(OfForces):
    """Work of a load at full size along the displacements that the body comes to: f . u, the potential that it loses.

    Of a load that is put on slowly a linear solid stores half. A pressure that follows the surface, or a moment that
    stays in space, has none that the state alone would tell, and no value; in a model of small strain it has. Gravity
    acts on every body, and each model tells that of its own. Against another model it is the difference relative to
    that model's.
    """

    of: Annotated[str, "load", "the load"]
    against: Annotated[str | None, "reference or model", "what is taken as right"] = None
    natural: ClassVar[str] = "J"

    @property
    def concerned(self) -> str:
        """The load."""
        return self.of

    def amount(self, rest: AtRest) -> Floats:
        """f . u in J. Raises Undefined of a load that follows."""
        if (found := rest.work[self.of]) is None:
            raise Undefined(f"the work of `{self.of}` depends on the way: it has no energy")
        return np.array(found)

    def acting(self, rest: AtRest) -> float:
        """The largest force times the largest displacement, J."""
        return rest.acting * rest.moved
