"""The energy that a body has turned into heat."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.metric import OfForces
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.metric import Floats
    from softmark.interpreter.results.reactions import AtRest
else:
    from softmark.solvers.base.deferred import np


@dataclass(frozen=True)
class Dissipation(OfForces):
    """Energy that a body has dissipated since the start of a quasistatic analysis, by stress that relaxes.

    `solve.energies_in_time` of the report has it beside the work of internal forces and what is stored, of which it is
    the difference but for the error of the step. In small strain it never falls; in finite strain, where that is not
    certain (`viscous` says why), `W368` says so. Nothing of an elastic body. Against another model or a theory it is
    the difference relative to that one's.
    """

    body: Annotated[str, "body", "the body"]
    against: Annotated[str | None, "reference or model", "what is taken as right"] = None
    natural: ClassVar[str] = "J"

    @property
    def concerned(self) -> str:
        """The body."""
        return self.body

    def amount(self, rest: AtRest) -> Floats:
        """In J."""
        return np.array(rest.dissipated)
