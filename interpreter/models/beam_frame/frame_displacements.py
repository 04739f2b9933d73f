"""Displacements of material points of a frame."""

from __future__ import annotations

import numpy as np

from softmark.interpreter.models.beam_frame.frame_layout import Layout
from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats
from softmark.solvers.energies.rod_state import displacement_at


@dataclass(frozen=True)
class FrameDisplacementField:
    """Displacement field of a frame in a state x (n * 7,): positions and quaternions of its nodes."""

    layout: Layout
    x: Floats

    def __call__(self, X: Floats) -> Floats:
        """Return displacements (k, 3), m, of points X (k, 3), m, each from the member it is in or nearest to."""
        found, own = np.zeros((len(X), 3)), self.layout.network.nearest(X)
        for member in np.unique(own).tolist():
            found[own == member] = self.of(member, X[own == member])
        return found

    def of(self, member: int, X: Floats) -> Floats:
        """Return displacements (k, 3), m, of points X (k, 3), m, of one member (from 0) with rigid sections."""
        nodes = self.layout.nodes(member)
        rod, rest = (state.reshape(-1, 7)[nodes].ravel() for state in (self.x, self.layout.rest))
        return displacement_at(rod, rest, X)
