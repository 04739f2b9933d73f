"""The energy that a body has turned into heat."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.metric_base import OfForces
from softmark.interpreter.metrics.strain_energy import known
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.metrics.metric_base import Floats
    from softmark.interpreter.results.reaction_results import AtRest


@dataclass(frozen=True)
class Dissipation(OfForces):
    """Energy dissipated since the start of an analysis, as stress relaxes, fluid seeps or a surface rubs on another.

    What rubs is counted from state to state, as friction times pressure times slip at every node.

    `solve.energies_in_time` of the report has it beside the work of internal forces and what is stored, of which it is
    the difference but for the error of the step: what is left of the three is a measure of that. It never falls, and is
    not defined where a law is not convex, so that its springs have no energy (W368). Nothing of an elastic body.
    Against another model or a theory it is the difference relative to that one's.
    """

    body: Annotated[str, "body", "the body"]
    against: Annotated[str | None, "reference or model", "what is taken as right"] = None
    natural: ClassVar[str] = "J"

    @property
    def concerned(self) -> str:
        """The body."""
        return self.body

    def amount(self, rest: AtRest) -> Floats:
        """In J. Raises Undefined where it is not known."""
        return known(rest.dissipated)
