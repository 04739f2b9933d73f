"""Energy dissipated in a body."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.metric_base import ForceMetric
from softmark.interpreter.metrics.strain_energy import require_energy
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.metrics.metric_base import Floats
    from softmark.interpreter.results.reaction_results import EquilibriumForces


@dataclass(frozen=True)
class Dissipation(ForceMetric):
    """Energy dissipated since the start of an analysis by stress relaxation, fluid flow or friction.

    Friction is summed from state to state, as friction coefficient times pressure times slip at every node.

    `solve.energies_in_time` of the report lists it with the work of internal forces and the stored energy. It equals
    their difference up to the error of the time step, so the remainder of the three measures that error. Dissipation
    never decreases. It is undefined for laws that are not convex, because their springs have no energy (W368), and zero
    for elastic bodies. Against another model or a theory, the value is the difference relative to that solution.
    """

    body: Annotated[str, "body", "the body"]
    against: Annotated[str | None, "reference or model", "solution taken as correct"] = None
    natural: ClassVar[str] = "J"

    @property
    def subject_name(self) -> str:
        """Name of the body whose dissipated energy is measured."""
        return self.body

    def amount(self, rest: EquilibriumForces) -> Floats:
        """Return the dissipated energy, J. Raises Undefined if it is unknown."""
        return require_energy(rest.dissipated)
