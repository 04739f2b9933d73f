"""Sequence of static states of a model, solved one after another and timed as one computation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from softmark.interpreter.models.shared.prepared_model import Meshless, Prepared, Solution
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.models.shared.prepared_model import Floats
    from softmark.solvers.statics.static_equilibrium import Watch


@dataclass(frozen=True)
class StateSequence(Meshless):
    """Sequence of models, one prepared for each of several states; each model starts from the previous state."""

    each: tuple[Prepared, ...]

    @property
    def size(self) -> Mapping[str, int]:
        """Numbers of nodes, elements and degrees of freedom, equal in all states."""
        return self.each[0].size

    @property
    def points(self) -> Floats:
        """Undeformed points (n, 3), m, at which loads act."""
        return self.each[0].points

    def forces(self) -> Sequence[tuple[Declared, Floats]]:
        """Return each load of the last state with its forces (n, 3), N."""
        return self.each[-1].forces()

    def warm(self) -> None:
        """Compile or load the code that the solutions need, before timing starts."""
        for prepared in self.each:
            prepared.warm()

    def solve(self, watch: Watch) -> Solution:
        """Solve all states in order, and stop at the first that fails.

        Return the solution of the last solved state, with the sum of iterations over all states.
        """
        found, iterations = self.each[0].solve(watch), 0
        for prepared in self.each[1:]:
            if found.displacement is None:
                break
            iterations += int(found.facts.get("iterations", 0))
            found = (prepared if found.mesh is None else prepared.after(found.mesh)).solve(watch)
        return replace(found, facts=found.facts | {"iterations": iterations + int(found.facts.get("iterations", 0))})
