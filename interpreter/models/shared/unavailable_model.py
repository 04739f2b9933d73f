"""A model of which nothing is built: it has no answer, and says why."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.models.shared.prepared_model import Meshless, Solution, Status
from softmark.records import dataclass

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.solvers.statics.static_equilibrium import Watch


@dataclass(frozen=True)
class Unbuilt(Meshless):
    """No model, and the reason."""

    reason: str
    status: Status
    size: Mapping[str, int] = field(default_factory=dict)

    @property
    def points(self) -> NDArray[np.float64]:
        """None (0, 3)."""
        return np.zeros((0, 3))

    def forces(self) -> Sequence[tuple[Declared, NDArray[np.float64]]]:
        """None: what a load comes to is not known, and is not zero."""
        return ()

    def solve(self, watch: Watch) -> Solution:
        """Why there is none."""
        return Solution(self.status, self.reason, {})
