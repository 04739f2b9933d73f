"""The energy that a deformed body stores."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.metric_base import OfForces
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.metric_base import Floats
    from softmark.interpreter.results.reaction_results import AtRest, Reaction
else:
    from softmark.solvers.runtime.lazy_modules import np


def known(energy: float) -> Floats:
    """An energy in J (). Raises Undefined where it is not known."""
    if energy != energy:
        raise Undefined("its law has no energy there, only stress (W368)")
    return np.array(energy)


@dataclass(frozen=True)
class StrainEnergy(OfForces):
    """Strain energy of a body at rest, as the model integrates it over its cells, segments or springs.

    Under loads alone a linear solid stores half of what they do along their displacements (Clapeyron), and meshes store
    less than the body; where displacements are imposed they store more. Modes of a beam that are switched off store
    nothing. Against another model it is the difference relative to that model's.
    """

    body: Annotated[str, "body", "the body"]
    against: Annotated[str | None, "reference or model", "what is taken as right"] = None
    natural: ClassVar[str] = "J"

    @property
    def concerned(self) -> str:
        """The body."""
        return self.body

    def amount(self, rest: AtRest) -> Floats:
        """U in J. Raises Undefined where it is not known."""
        return known(rest.energy)

    def distance(self, rest: AtRest, right: AtRest) -> float:
        """Not less than what reactions are apart, relative: too little here and too much there is no agreement."""
        own = super().distance(rest, right)

        theirs = {name: _wrench(r, right.extent) for name, r in right.reactions.items()}
        largest = max((float(np.linalg.norm(w, axis=1).max()) for w in theirs.values()), default=0.0)
        gaps = (w - _wrench(rest.reactions[name], right.extent) for name, w in theirs.items())
        most = max((float(np.linalg.norm(gap, axis=1).max()) for gap in gaps), default=0.0)
        return max(own, most / largest * right.energy) if largest > 0.0 else own


def _wrench(reaction: Reaction, extent: float) -> Floats:
    """Force of a reaction, N, and its moment over the `extent` of the body, N (2, 3): a pure twist has no force."""
    return np.array([reaction.force, np.asarray(reaction.own_moment) / (extent or 1.0)])
