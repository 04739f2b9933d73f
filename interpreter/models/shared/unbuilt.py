"""A model of a plugin that failed while it was built: it has no answer, and says why."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.models.shared.prepared import Meshless, Solution
from softmark.records import dataclass

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from softmark.interpreter.language.scene import Declared
    from softmark.interpreter.problem.case import Case
    from softmark.solvers.statics.equilibrium import Watch


@dataclass(frozen=True)
class Unbuilt(Meshless):
    """No model, and the reason."""

    case: Case
    reason: str

    @property
    def size(self) -> dict[str, int]:
        """Nothing."""
        return {"nodes": 0, "elements": 0, "dofs": 0}

    @property
    def points(self) -> NDArray[np.float64]:
        """None (0, 3)."""
        return np.zeros((0, 3))

    def forces(self) -> Sequence[tuple[Declared, NDArray[np.float64]]]:
        """Of every load none (0, 3), N."""
        return [(load, np.zeros((0, 3))) for load in self.case.loads]

    def solve(self, watch: Watch) -> Solution:
        """Why there is none."""
        return Solution("failed", self.reason, {})
