"""Contact forces over the steps of a dynamic analysis, and snapshots of the contact surfaces.

Contact forces act at the end of a step with their whole impulse (dynamic_contact.py), so they are means over the step.
A node that stays in contact does not move in a step: x1 = x0. Integrators with x1 - x0 = h (v0 + v1) / 2 then reverse
its velocity, and its contact force alternates by 2 m v / h about the true value. So the contact force at a given time
is the mean over the two adjacent steps, weighted by their lengths, in which this oscillation cancels. At the end of the
analysis it is the mean of the last two steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints

MOST = 800  # largest number of recorded states; beyond it every second one is dropped


@dataclass(frozen=True)
class ContactResultant:
    """Resultant of the forces of one contact on the deformable body over a `step`, s.

    `force` (3,), N, and `moments` (2, 3), N m, about the origin: first with current lever arms, then with undeformed
    ones. `size`, N, is the sum of the magnitudes of the nodal forces. `arms` (2, 3), N m, are the sums of magnitudes
    times lever arms, both kinds as in `moments`. `gap` is the smallest gap at the end of the step, m, and `left` the
    mean gap weighted by contact force, m.
    """

    force: Floats
    moments: Floats
    size: float
    arms: Floats
    gap: float
    left: float
    step: float = 0.0

    def after(self, before: ContactResultant, step: float, given: tuple[float, float]) -> ContactResultant:
        """Return the resultant over the step that follows the resultant `before`, from the impulse of the integrator.

        `step` is the length of this step, s, and `given` holds the weights of `Motion.given`.
        """
        old, new = given[0] * before.step / step, given[1]
        if not old:
            return replace(self, step=step)
        names = ("force", "moments", "size", "arms")
        both = {name: old * getattr(before, name) + new * getattr(self, name) for name in names}
        return replace(self, step=step, **both)


def rigid_contact_resultant(contact: Any, x: Floats) -> ContactResultant:
    """Return the resultant of a contact with a rigid body in a state x at the end of a step."""
    gaps = contact.gaps(x)
    press = contact.A * contact.pressures(x)
    left = float(press @ gaps / whole) if (whole := float(press.sum())) > 0.0 else 0.0
    wrench = _resultant_with_magnitudes(contact.point_forces(x), (contact.point_positions(x), contact.at_rest))
    return ContactResultant(*wrench, float(gaps.min(initial=np.inf)), left)


def pair_contact_resultant(contact: Any, x: Floats) -> ContactResultant:
    """Return the resultant of contact between two deformable surfaces, on all mesh pieces except the first.

    `left` is not computed.
    """
    pressing = getattr(contact, "pressing", contact)
    g = np.zeros(len(x))
    contact.add_gradient(x, g)
    push, u = (own[: pressing.skin.M.shape[1]].reshape(-1, 3) for own in (-g, x))
    push = push if pressing.reaction_nodes is None else np.where(pressing.reaction_nodes[:, None], push, 0.0)
    X = np.zeros_like(u) if pressing.X is None else pressing.X
    return ContactResultant(*_resultant_with_magnitudes(push, (X + u, X)), pressing.least(x), 0.0)


def _resultant_with_magnitudes(push: Floats, arms: tuple[Floats, ...]) -> tuple[Floats, Floats, float, Floats]:
    """Return force, moments, total magnitude and weighted arms of forces `push` (p, 3), N.

    The results are as in `ContactResultant`. `arms` holds sets of lever arms (p, 3), m.
    """
    sizes = np.linalg.norm(push, axis=1)
    moments = np.array([np.cross(arm, push).sum(axis=0) for arm in arms])
    return push.sum(axis=0), moments, float(sizes.sum()), np.array([sizes @ arm for arm in arms])


def average_over_steps(steps: Floats, values: Floats) -> Floats:
    """Return values at the n + 1 times, each the average of the steps before and after it, weighted by their lengths.

    `values` (n + 1, ...) are means over single steps: entry i belongs to the step that ends at time i, and entry 0 is
    not
    used. `steps` (n,), s, are the lengths of the steps. The last time gets the value of the time before it.
    """
    if not len(steps):
        return values
    h = np.concatenate([[0.0], steps, [0.0]]).reshape(-1, *(1,) * (values.ndim - 1))
    after = np.concatenate([values[1:], values[-1:]])
    found: Floats = (h[:-1] * values + h[1:] * after) / (h[:-1] + h[1:])
    found[-1] = found[-2] if len(steps) > 1 else values[-1]
    return found


@dataclass(frozen=True)
class ContactSurfaceState:
    """Contact surface at one time, with its s nodes.

    u (s, 3), m, are displacements, f (s,), N, contact forces and g (s,), m, gaps. For contact between deformable
    surfaces f is (s, 3), on both surfaces, and there are no gaps.
    """

    u: Floats
    f: Floats
    g: Floats


class SurfaceRecord:
    """Record of the contact surfaces at selected times and at the last one.

    `kept` holds pairs of a time index and the surfaces then.
    """

    def __init__(self, contacts: Sequence[Any], meets: Sequence[Any] = ()) -> None:
        self.nodes: list[Ints] = [np.unique(c.facets) for c in contacts if c.facets is not None]
        self.whole = len(self.nodes) == len(contacts)
        self.nodes += [np.unique(c.skin.M.indices // 3).astype(np.int64) for c in meets]
        self.kept: list[tuple[int, tuple[ContactSurfaceState, ...]]] = []
        self.every, self.count = 1, 0
        self._last: tuple[float, tuple[ContactSurfaceState, ...]] | None = (
            None  # preceded by the length of the step before it, s
        )
        self._mean: list[Floats] = []  # contact forces at the last time but one

    def record_step(self, contacts: Sequence[Any], meets: Sequence[Any], x: Floats, step: float) -> None:
        """Record the state at the end of a step; at the start the step length is zero."""
        if not self.whole:
            return
        seen = (*((_rigid_contact_surface, c) for c in contacts), *((_pair_contact_surface, c) for c in meets))
        now = tuple(of(c, x, nodes) for (of, c), nodes in zip(seen, self.nodes, strict=True))
        if self._last is not None:
            before, states = self._last
            weight = step / (before + step)
            self._mean = [(1.0 - weight) * a.f + weight * b.f for a, b in zip(states, now, strict=True)]
            self._store_surfaces(states)
        self._last = step, now

    def _store_surfaces(self, states: tuple[ContactSurfaceState, ...]) -> None:
        """Store the surfaces of a time, and thin out the record if it is full."""
        if self.count % self.every == 0:
            made = tuple(ContactSurfaceState(s.u, f, s.g) for s, f in zip(states, self._mean, strict=True))
            self.kept.append((self.count, made))
            if len(self.kept) > MOST:
                self.kept, self.every = self.kept[::2], 2 * self.every
        self.count += 1

    @property
    def states(self) -> list[tuple[int, tuple[ContactSurfaceState, ...]]]:
        """Recorded states and the last one; contact forces there are means of the last two steps."""
        if self._last is None:
            return []
        last = self._last[1]
        means = self._mean or [s.f for s in last]
        return [
            *self.kept,
            (self.count, tuple(ContactSurfaceState(s.u, f, s.g) for s, f in zip(last, means, strict=True))),
        ]


def _rigid_contact_surface(contact: Any, x: Floats, nodes: Ints) -> ContactSurfaceState:
    """Return the contact surface of a rigid contact in a state x."""
    u = x[3 * nodes[:, None] + np.arange(3)]
    g = np.full(len(nodes), np.inf)
    g[np.searchsorted(nodes, contact.nodes)] = contact.nodal_gaps(x)
    return ContactSurfaceState(u, contact.presses(x, int(nodes.max()) + 1)[nodes], g)


def _pair_contact_surface(contact: Any, x: Floats, nodes: Ints) -> ContactSurfaceState:
    """Return the contact surfaces of a contact between deformable bodies in a state x."""
    g = np.zeros(len(x))
    getattr(contact, "pressing", contact).add_gradient(x, g)
    where = 3 * nodes[:, None] + np.arange(3)
    return ContactSurfaceState(x[where], -g[where], np.zeros(0))
