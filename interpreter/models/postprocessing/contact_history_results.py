"""What contacts come to in a motion: at its end, and at the times before it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.models.postprocessing.contact_results import pressed, touch_from
from softmark.interpreter.models.postprocessing.deformable_contact_results import meeting_of
from softmark.interpreter.results.load_results import vector
from softmark.interpreter.results.reaction_results import AtRest, Friction, Reaction, Touch
from softmark.records import dataclass
from softmark.solvers.dynamics.contact_output import Surface, in_time
from softmark.solvers.energies.energy import Floats, Ints

if TYPE_CHECKING:
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.contact.rigid_contact import RigidContact
    from softmark.solvers.dynamics.trajectory import Trajectory
    from softmark.solvers.mesh.mesh import Mesh

WHY = "reactions are those of a state of rest: in a motion what contacts do is followed alone"


@dataclass(frozen=True)
class Followed:
    """Contacts in motion: forces at every accepted step, and the surface at some of them.

    Forces at a time are means over the two steps that meet there (solvers/dynamics/contact_output.py), so that they
    have the right impulse; arms of moments are those of places at rest where strains are `small`. What pieces of the
    body that
    meet do to each other, `meets`, comes after what rigid bodies do.
    """

    case: Case
    contacts: Mapping[str, RigidContact]
    meets: Mapping[str, Any]
    mesh: Mesh
    track: Trajectory
    small: bool

    @property
    def names(self) -> list[str]:
        """Of all contacts."""
        return [*self.contacts, *self.meets]

    @property
    def X(self) -> Floats:
        """Nodes (n, 3) at rest, m."""
        return self.mesh.points

    @cached_property
    def _acts(self) -> list[list[Floats]]:
        """Of each contact (n + 1, 3): forces, moments, and the middles of the same forces; the origin of none."""
        acts, arm = self._touched.acts, int(self.small)
        found = []
        for k in range(len(self.names)):
            own = [seen[k] for seen in acts]
            each = [(a.force, a.moments[arm], a.arms[arm], np.array([a.size])) for a in own]
            f, m, arms, size = (in_time(self.track.steps, np.array(values)) for values in zip(*each, strict=True))
            at = arms / np.where(size > 0.0, size, 1.0)
            found.append([f, m, at])
        return found

    @property
    def _touched(self) -> Any:
        assert self.track.touched is not None
        return self.track.touched

    def states(self, surface: bool) -> tuple[Floats, Iterator[AtRest]]:
        """Times (t,), s, and what contacts come to at each: at all, or at those at which the surface is known."""
        numbers = [i for i, _ in self._touched.surfaces] if surface else list(range(len(self.track.times)))
        return self.track.times[numbers], map(self._state, numbers)

    @property
    def last(self) -> AtRest:
        """What they come to at the end."""
        return self._state(len(self.track.times) - 1)

    def _state(self, i: int) -> AtRest:
        held = {name: self._reaction(k, i) for k, name in enumerate(self.names)}
        most = max((float(np.linalg.norm(f, axis=1).max()) for f, _, _ in self._acts), default=0.0)
        size = float(np.linalg.norm(np.ptp(self.X, axis=0)))
        touches = _Touches(self, i)
        return AtRest(held, acting=most, moved=self._moved, extent=size, reason=WHY, touches=touches)

    @cached_property
    def _moved(self) -> float:
        """The farthest that a node of these surfaces is from where it was at the end, m."""
        states = self._touched.surfaces
        return max((float(np.linalg.norm(s.u, axis=1).max(initial=0.0)) for s in states[-1][1]), default=0.0)

    def _reaction(self, k: int, i: int) -> Reaction:
        f, m, at = (values[i] for values in self._acts[k])
        return Reaction(vector(f), vector(m), vector(at), vector(m - np.cross(at, f)))

    @cached_property
    def _surfaces(self) -> dict[int, tuple[Surface, ...]]:
        return dict(self._touched.surfaces)

    def touch(self, name: str, i: int) -> Touch:
        """What a contact comes to at one of the times at which surfaces are known."""
        k = self.names.index(name)
        surface, nodes, act = self._surfaces[i][k], self._touched.nodes[k], self._touched.acts[i][k]
        x, f, g = self.X.copy(), np.zeros(len(self.X)), np.full(len(self.X), np.inf)
        if not self.small:
            x[nodes] += surface.u
        if name in self.meets:
            return self._met(name, i, x, surface, nodes)
        contact = self.contacts[name]
        f[nodes], g[nodes] = surface.f, surface.g
        own = pressed(self.case, contact, self.X, x, f, g)
        return touch_from(self.X, contact, own, act.gap, act.left, self._rubbed(name, i, own.area))

    def _met(self, name: str, i: int, x: Floats, surface: Surface, nodes: Ints) -> Touch:
        """The same of pieces of the body that meet, of nodes at x (n, 3), m."""
        u, force = np.zeros((2, *self.X.shape))
        u[nodes], force[nodes] = surface.u, surface.f
        touch = meeting_of(self.case, self.meets[name], self.mesh, x, u.ravel(), None, force)
        return replace(touch, rubbing=self._rubbed(name, i, touch.area))

    def _rubbed(self, name: str, i: int, area: float) -> Friction | None:
        every = (*self.contacts.items(), *self.meets.items())
        rubbing = [n for n, contact in every if hasattr(contact, "friction")]
        if name not in rubbing:
            return None
        own = self.track.rubbed[i][rubbing.index(name)]
        return Friction(own.slip, own.sticks or 0.0, area * own.area, own.heat)


class _Touches(Mapping[str, Touch]):
    """What contacts come to at a time, each found when it is asked for."""

    def __init__(self, followed: Followed, i: int) -> None:
        self.followed, self.i = followed, i
        self.known: dict[str, Touch] = {}

    def __getitem__(self, name: str) -> Touch:
        if name not in self.followed.names:
            raise KeyError(name)
        if name not in self.known:
            self.known[name] = self.followed.touch(name, self.i)
        return self.known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.followed.names)

    def __len__(self) -> int:
        return len(self.followed.names)
