"""What bodies in motion remember: the energies of the next step, and memories that are taken on once it is accepted."""

from __future__ import annotations

from typing import Protocol

from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.viscoelastic_memory import BodyHistory


class Acting(Protocol):
    """Forces: internal energies of a step, and those `now`, at its start."""

    internal: tuple[Energy, ...]
    now: tuple[Energy, ...] | None


class Remembering:
    """What is remembered at the start of a step, and once it is tried at its end.

    Forces within a step are those of energies over the step, at its end; with `between`, as of the midpoint rule, over
    half of it. Forces at its start are those of no time at all.
    """

    def __init__(self, memories: BodyHistory, between: bool = False) -> None:
        self._first = self._known = self._next = memories
        self.share = 0.5 if between else 1.0
        self.losses = [0.0]  # dissipated up to the end of every step, J

    def reset(self, forces: Acting, x: Floats) -> None:
        """As of a body that has always been at rest, and is in the state x at once."""
        self._known = self._next = self._first.accepted(x, 0.0)
        self.losses = [0.0]
        forces.now = forces.internal = self._next.over(0.0)

    def begin(self, forces: Acting, h: float) -> None:
        """Before a step of h s is tried."""
        self._next = self._known
        forces.now = self._known.over(0.0)
        forces.internal = self._known.over(self.share * h)

    def tried(self, forces: Acting, x: Floats, h: float) -> None:
        """After it has led to the state x."""
        self._next = self._known.accepted(x, h)
        forces.internal = self._next.over(0.0)

    def accepted(self) -> None:
        """It is kept."""
        self.losses.append(self.losses[-1] + self.lost)
        self._known = self._next

    def stored(self, x: Floats) -> float:
        """Energy of all springs in the state x, J."""
        return self._next.stored(x)

    @property
    def unknown(self) -> bool:
        """Whether what is stored or dissipated was not found somewhere."""
        return self._next.unknown

    @property
    def lost(self) -> float:
        """What the step has dissipated, J."""
        return self._next.dissipated - self._known.dissipated
