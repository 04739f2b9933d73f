"""Placeholder for a model that could not be built; its solution consists of the reason."""

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
class UnavailableModel(Meshless):
    """Model that could not be built, with the reason."""

    reason: str
    status: Status
    size: Mapping[str, int] = field(default_factory=dict)

    @property
    def points(self) -> NDArray[np.float64]:
        """Empty array (0, 3) in place of the points at which loads act, since the model has none."""
        return np.zeros((0, 3))

    def forces(self) -> Sequence[tuple[Declared, NDArray[np.float64]]]:
        """Return no loads, because their resultants are unknown rather than zero."""
        return ()

    def solve(self, watch: Watch) -> Solution:
        """Return a solution without displacements, with the reason why the model could not be built."""
        return Solution(self.status, self.reason, {})
