"""What contacts do to a body from step to step of a motion, and what some states of its surface are.

Forces of contact act as they are at the end of a step, with their whole impulse (dynamic_contact.py): they are means
over it. A node that stays in contact goes nowhere in a step, x1 = x0, so that integrators with x1 - x0 = h (v0 + v1) /
2 turn its
velocity round, and its force is by turns 2 m v / h above and below what presses: what contact does at a time is the
mean over the two steps that meet there, by their lengths, in which that cancels. At the end it is that of the last two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints

MOST = 800  # states of surfaces that are kept: of more, every second, and so on


@dataclass(frozen=True)
class Acting:
    """What a contact does to the body that deforms over a `step`, s.

    `force` (3,), N; `moments` (2, 3), N m about the origin, of arms as they are and as they are at rest; `size`, N, the
    sum of the sizes of its forces, and `arms` (2, 3), N m, that of sizes times arms, likewise. Where the step ends:
    `gap`, the least, and `left`, the mean where it presses, m.
    """

    force: Floats
    moments: Floats
    size: float
    arms: Floats
    gap: float
    left: float
    step: float = 0.0

    def after(self, before: Acting, step: float, given: tuple[float, float]) -> Acting:
        """Over a step after one `before`, with the impulse that the integrator makes of it (`Motion.given`)."""
        old, new = given[0] * before.step / step, given[1]
        if not old:
            return replace(self, step=step)
        names = ("force", "moments", "size", "arms")
        both = {name: old * getattr(before, name) + new * getattr(self, name) for name in names}
        return replace(self, step=step, **both)


def acting(contact: Any, x: Floats) -> Acting:
    """Of a contact where it is, in the state at the end of a step."""
    gaps = contact.gaps(x)
    press = contact.A * contact.pressures(x)
    left = float(press @ gaps / whole) if (whole := float(press.sum())) > 0.0 else 0.0
    wrench = _wrench(contact.pushes(x), (contact.spots(x), contact.at_rest))
    return Acting(*wrench, float(gaps.min(initial=np.inf)), left)


def meeting(contact: Any, x: Floats) -> Acting:
    """The same of surfaces that both deform: on all pieces but the first. What is left is told of some states alone."""
    pressing = getattr(contact, "pressing", contact)
    g = np.zeros(len(x))
    contact.add_gradient(x, g)
    push, u = (own[: pressing.skin.M.shape[1]].reshape(-1, 3) for own in (-g, x))
    push = push if pressing.told is None else np.where(pressing.told[:, None], push, 0.0)
    X = np.zeros_like(u) if pressing.X is None else pressing.X
    return Acting(*_wrench(push, (X + u, X)), pressing.least(x), 0.0)


def _wrench(push: Floats, arms: tuple[Floats, ...]) -> tuple[Floats, Floats, float, Floats]:
    """What forces (p, 3), N, come to: force, moments of each of the arms, size, and middles."""
    sizes = np.linalg.norm(push, axis=1)
    moments = np.array([np.cross(arm, push).sum(axis=0) for arm in arms])
    return push.sum(axis=0), moments, float(sizes.sum()), np.array([sizes @ arm for arm in arms])


def in_time(steps: Floats, values: Floats) -> Floats:
    """Means over the two steps that meet at each time (n + 1, ...) of `values` (n + 1, ...) over the steps before it.

    `steps` (n,), s; the first value belongs to no step.
    """
    if not len(steps):
        return values
    h = np.concatenate([[0.0], steps, [0.0]]).reshape(-1, *(1,) * (values.ndim - 1))
    after = np.concatenate([values[1:], values[-1:]])
    found: Floats = (h[:-1] * values + h[1:] * after) / (h[:-1] + h[1:])
    found[-1] = found[-2] if len(steps) > 1 else values[-1]
    return found


@dataclass(frozen=True)
class Surface:
    """Nodes (s,) of a surface in contact at a time: displacements u (s, 3), m, what presses f (s,), N, gaps g (s,).

    Of surfaces that both deform f (s, 3) is what presses on both, and gaps are not looked at.
    """

    u: Floats
    f: Floats
    g: Floats


class Surfaces:
    """Surfaces of contacts at some times: `kept` has the number of the time with them, the last one always."""

    def __init__(self, contacts: Sequence[Any], meets: Sequence[Any] = ()) -> None:
        self.nodes: list[Ints] = [np.unique(c.facets) for c in contacts if c.facets is not None]
        self.whole = len(self.nodes) == len(contacts)
        self.nodes += [np.unique(c.skin.M.indices // 3).astype(np.int64) for c in meets]
        self.kept: list[tuple[int, tuple[Surface, ...]]] = []
        self.every, self.count = 1, 0
        self._last: tuple[float, tuple[Surface, ...]] | None = None  # with the step before it, s
        self._mean: list[Floats] = []  # what presses at the last time but one

    def follow(self, contacts: Sequence[Any], meets: Sequence[Any], x: Floats, step: float) -> None:
        """Take in the state at the end of a step, of no length at the start."""
        if not self.whole:
            return
        seen = (*((_seen, c) for c in contacts), *((_met, c) for c in meets))
        now = tuple(of(c, x, nodes) for (of, c), nodes in zip(seen, self.nodes, strict=True))
        if self._last is not None:
            before, states = self._last
            weight = step / (before + step)
            self._mean = [(1.0 - weight) * a.f + weight * b.f for a, b in zip(states, now, strict=True)]
            self._keep(states)
        self._last = step, now

    def _keep(self, states: tuple[Surface, ...]) -> None:
        if self.count % self.every == 0:
            made = tuple(Surface(s.u, f, s.g) for s, f in zip(states, self._mean, strict=True))
            self.kept.append((self.count, made))
            if len(self.kept) > MOST:
                self.kept, self.every = self.kept[::2], 2 * self.every
        self.count += 1

    @property
    def states(self) -> list[tuple[int, tuple[Surface, ...]]]:
        """Those that are kept, and the last: what presses there is of the last two steps."""
        if self._last is None:
            return []
        last = self._last[1]
        means = self._mean or [s.f for s in last]
        return [*self.kept, (self.count, tuple(Surface(s.u, f, s.g) for s, f in zip(last, means, strict=True)))]


def _seen(contact: Any, x: Floats, nodes: Ints) -> Surface:
    u = x[3 * nodes[:, None] + np.arange(3)]
    g = np.full(len(nodes), np.inf)
    g[np.searchsorted(nodes, contact.nodes)] = contact.nodal_gaps(x)
    return Surface(u, contact.presses(x, int(nodes.max()) + 1)[nodes], g)


def _met(contact: Any, x: Floats, nodes: Ints) -> Surface:
    g = np.zeros(len(x))
    getattr(contact, "pressing", contact).add_gradient(x, g)
    where = 3 * nodes[:, None] + np.arange(3)
    return Surface(x[where], -g[where], np.zeros(0))
