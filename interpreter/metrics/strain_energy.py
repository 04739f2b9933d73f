"""Strain energy stored in a deformed body."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.metric_base import ForceMetric
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.metric_base import Floats
    from softmark.interpreter.results.reaction_results import EquilibriumForces, Reaction
else:
    from softmark.solvers.runtime.lazy_modules import np


def require_energy(energy: float) -> Floats:
    """Return an energy, J, as an array of shape (). Raises Undefined if it is unknown (NaN)."""
    if energy != energy:
        raise Undefined("the material law defines a stress but no energy in this state (W368)")
    return np.array(energy)


@dataclass(frozen=True)
class StrainEnergy(ForceMetric):
    """Strain energy of a body at equilibrium, as the model integrates it over its cells, segments or springs.

    Under loads only, a linear solid stores half of the work of its loads along the displacements (Clapeyron), and
    meshes store less than the exact solution; under prescribed displacements they store more. Disabled deformation
    modes of a beam store nothing. Against another model, the value is the difference relative to that model's energy.
    """

    body: Annotated[str, "body", "the body"]
    against: Annotated[str | None, "reference or model", "solution taken as correct"] = None
    natural: ClassVar[str] = "J"

    @property
    def subject_name(self) -> str:
        """Name of the body whose strain energy is measured."""
        return self.body

    def amount(self, rest: EquilibriumForces) -> Floats:
        """Return the strain energy U, J. Raises Undefined if it is unknown."""
        return require_energy(rest.energy)

    def distance(self, rest: EquilibriumForces, right: EquilibriumForces) -> float:
        """Return the difference of the energies, J, but at least the energy times the relative difference of reactions.

        Local errors may cancel in the energy, which is a sum.
        """
        own = super().distance(rest, right)

        theirs = {name: _force_and_scaled_moment(r, right.extent) for name, r in right.reactions.items()}
        largest = max((float(np.linalg.norm(w, axis=1).max()) for w in theirs.values()), default=0.0)
        gaps = (w - _force_and_scaled_moment(rest.reactions[name], right.extent) for name, w in theirs.items())
        most = max((float(np.linalg.norm(gap, axis=1).max()) for gap in gaps), default=0.0)
        return max(own, most / largest * right.energy) if largest > 0.0 else own


def _force_and_scaled_moment(reaction: Reaction, extent: float) -> Floats:
    """Return the force of a reaction, N, and its moment divided by the body's `extent`, N, as rows (2, 3)."""
    return np.array([reaction.force, np.asarray(reaction.own_moment) / (extent or 1.0)])
