"""Sequence of states of a model, solved one after another and timed as one computation."""

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
    """Models prepared for each state (k > 1), each starting from the state before."""

    each: tuple[Prepared, ...]

    @property
    def size(self) -> Mapping[str, int]:
        """Numbers of nodes, elements and dofs, equal in all states."""
        return self.each[0].size

    @property
    def points(self) -> Floats:
        """Undeformed points that loads act at (n, 3), m."""
        return self.each[0].points

    def forces(self) -> Sequence[tuple[Declared, Floats]]:
        """Return the forces of every load in the last state."""
        return self.each[-1].forces()

    def warm(self) -> None:
        """Compile or load whatever the solutions need."""
        for prepared in self.each:
            prepared.warm()

    def solve(self, watch: Watch) -> Solution:
        """Solve all states up to the first that fails; return the last solution with the iterations of all."""
        found, iterations = self.each[0].solve(watch), 0
        for prepared in self.each[1:]:
            if found.displacement is None:
                break
            iterations += int(found.facts.get("iterations", 0))
            found = (prepared if found.mesh is None else prepared.after(found.mesh)).solve(watch)
        return replace(found, facts=found.facts | {"iterations": iterations + int(found.facts.get("iterations", 0))})
