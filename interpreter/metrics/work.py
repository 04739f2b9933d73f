"""Work of a load along the displacements of a body."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.metric_base import ForceMetric
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.metric_base import Floats
    from softmark.interpreter.results.reaction_results import EquilibriumForces
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class LoadWork(ForceMetric):
    """Work of a load along the displacements of the body: f . u of a dead load, the potential energy that it loses.

    Under a slowly applied load a linear solid stores half of it. For a pressure that follows the surface, or a moment
    with a fixed axis, the work depends on the path, so it has no value (in a model of small strain it has). Gravity
    acts on every body, and each model reports the work on its own body. Against another model, the value is the
    difference relative to that model's work.
    """

    of: Annotated[str, "load", "the load"]
    against: Annotated[str | None, "reference or model", "solution taken as correct"] = None
    natural: ClassVar[str] = "J"

    @property
    def subject_name(self) -> str:
        """Name of the load whose work is measured."""
        return self.of

    def amount(self, rest: EquilibriumForces) -> Floats:
        """Return the work f . u of the load, J. Raises Undefined for a load that follows the surface."""
        if (found := rest.work[self.of]) is None:
            raise Undefined(f"the work of `{self.of}` depends on the path: the load has no potential energy")
        return np.array(found)

    def acting(self, rest: EquilibriumForces) -> float:
        """Return the largest load or reaction times the largest displacement, J."""
        return rest.acting * rest.moved
