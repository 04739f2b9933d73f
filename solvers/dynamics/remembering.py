"""What bodies in motion remember: the energies of the next step, and memories that are taken on once it is accepted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.remembering import Memory


class Acting(Protocol):
    """Forces: internal energies of a step, and those `now`, at its start."""

    internal: tuple[Energy, ...]
    now: tuple[Energy, ...] | None


class Remembering:
    """The memory of each internal energy, or the energy itself where it has none.

    Forces within a step are those of energies over the step, at its end; with `between`, as of the midpoint rule, over
    half of it. Forces at its start are those of no time at all.
    """

    def __init__(self, parts: Sequence[Memory | Energy], between: bool = False) -> None:
        self._first = self._parts = self._next = tuple(parts)
        self.share = 0.5 if between else 1.0

    def reset(self, forces: Acting) -> None:
        """As of a body that has always been at rest."""
        self._parts = self._next = self._first
        forces.now = forces.internal = self._over(0.0)

    def begin(self, forces: Acting, h: float) -> None:
        """Before a step of h s is tried."""
        self._next = self._parts
        forces.now = self._over(0.0)
        forces.internal = self._over(self.share * h)

    def tried(self, forces: Acting, x: Floats, h: float) -> None:
        """After it has led to the state x."""
        self._next = tuple(p.accepted(x, h) if isinstance(p, Memory) else p for p in self._parts)
        forces.internal = self._over(0.0)

    def accepted(self) -> None:
        """It is kept."""
        self._parts = self._next

    def stored(self, x: Floats) -> float:
        """Energy of all springs in the state x, J."""
        memories = [part for part in self._next if isinstance(part, Memory)]
        whole = (part.energy if isinstance(part, Memory) else part for part in self._next)
        return float(sum(e.value(x) for e in whole)) + sum(m.stored for m in memories)

    @property
    def lost(self) -> float:
        """What the step has dissipated, J."""
        pairs = zip(self._parts, self._next, strict=True)
        return sum(b.dissipated - a.dissipated for a, b in pairs if isinstance(a, Memory) and isinstance(b, Memory))

    def _over(self, h: float) -> tuple[Energy, ...]:
        return tuple(part.over(h) if isinstance(part, Memory) else part for part in self._next)
