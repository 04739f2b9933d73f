"""Viscoelastic histories in a time step: energies of the next step, and update after it is accepted."""

from __future__ import annotations

from typing import Protocol

from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.viscoelastic_memory import BodyHistory


class StepForces(Protocol):
    """Interface of forces with history: `internal` energies over a step, and `now` at its start."""

    internal: tuple[Energy, ...]
    now: tuple[Energy, ...] | None


class ViscoelasticStep:
    """Viscoelastic histories at the start of a step, and provisional histories at the end of a trial step.

    Forces at the end of the step are those of the energies over the step. With `between`, as for the midpoint rule,
    they are those over half of the step. Forces at its start are those of a step of zero length.
    """

    def __init__(self, memories: BodyHistory, between: bool = False) -> None:
        self._first = self._known = self._next = memories
        self.share = 0.5 if between else 1.0
        self.losses = [0.0]  # dissipated up to the end of every step, J

    def reset(self, forces: StepForces, x: Floats) -> None:
        """Start with a body that has always been at rest and is suddenly in the state x."""
        self._known = self._next = self._first.history_after_step(x, 0.0)
        self.losses = [0.0]
        forces.now = forces.internal = self._next.over(0.0)

    def begin(self, forces: StepForces, h: float) -> None:
        """Prepare the energies of a trial step of length h, s."""
        self._next = self._known
        forces.now = self._known.over(0.0)
        forces.internal = self._known.over(self.share * h)

    def compute_provisional_history(self, forces: StepForces, x: Floats, h: float) -> None:
        """Compute the provisional history after a trial step to state x."""
        self._next = self._known.history_after_step(x, h)
        forces.internal = self._next.over(0.0)

    def accept_history(self) -> None:
        """Accept the provisional history."""
        self.losses.append(self.losses[-1] + self.lost)
        self._known = self._next

    def stored(self, x: Floats) -> float:
        """Return the elastic energy stored in the body in state x, J, with the provisional history."""
        return self._next.stored(x)

    @property
    def has_unknown_energy(self) -> bool:
        """True if the stored or dissipated energy could not be computed at some point."""
        return self._next.has_unknown_energy

    @property
    def lost(self) -> float:
        """Energy dissipated in the step, J."""
        return self._next.dissipated - self._known.dissipated
