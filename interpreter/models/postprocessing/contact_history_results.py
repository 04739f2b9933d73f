"""Contact results of dynamic analyses, at the end and at earlier times."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.models.postprocessing.contact_results import make_contact_result, pressure_distribution
from softmark.interpreter.models.postprocessing.deformable_contact_results import contact_result
from softmark.interpreter.results.load_results import to_vector
from softmark.interpreter.results.reaction_results import ContactNumbers, EquilibriumForces, Friction, Reaction
from softmark.records import dataclass
from softmark.solvers.dynamics.contact_output import ContactSurfaceState, average_over_steps
from softmark.solvers.energies.energy import Floats, Ints

if TYPE_CHECKING:
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.contact.rigid_contact import RigidContact
    from softmark.solvers.dynamics.trajectory import Trajectory
    from softmark.solvers.mesh.mesh import Mesh

WHY = "reactions need a static analysis: a dynamic analysis records only contact forces"


@dataclass(frozen=True)
class ContactHistoryResults:
    """Contact history of a dynamic analysis: forces at every accepted step, and the surface at some of the times.

    Forces at a time are means over the two adjacent steps (solvers/dynamics/contact_output.py), so that their
    impulse is correct. Moment arms use undeformed positions if strains are `small`. `contacts` are contacts with rigid
    bodies, and `meets` are self-contacts, each by name.
    """

    case: Case
    contacts: Mapping[str, RigidContact]
    meets: Mapping[str, Any]
    mesh: Mesh
    track: Trajectory
    small: bool

    @property
    def names(self) -> list[str]:
        """Names of all contacts, rigid contacts first."""
        return [*self.contacts, *self.meets]

    @property
    def X(self) -> Floats:
        """Undeformed nodes (n, 3), m."""
        return self.mesh.points

    @cached_property
    def _contact_resultants(self) -> list[list[Floats]]:
        """Forces, moments and centres of force of each contact at all times, (n + 1, 3) each.

        The centre is the origin if there is no force.
        """
        acts, arm = self._contact_history.acts, int(self.small)
        found = []
        for k in range(len(self.names)):
            own = [seen[k] for seen in acts]
            each = [(a.force, a.moments[arm], a.arms[arm], np.array([a.size])) for a in own]
            f, m, arms, size = (
                average_over_steps(self.track.steps, np.array(values)) for values in zip(*each, strict=True)
            )
            at = arms / np.where(size > 0.0, size, 1.0)
            found.append([f, m, at])
        return found

    @property
    def _contact_history(self) -> Any:
        assert self.track.touched is not None
        return self.track.touched

    def states(self, surface: bool) -> tuple[Floats, Iterator[EquilibriumForces]]:
        """Return times (t,), s, and the forces and contacts at each time.

        These are all times or, if `surface`, only those with a stored surface.
        """
        numbers = [i for i, _ in self._contact_history.surfaces] if surface else list(range(len(self.track.times)))
        return self.track.times[numbers], map(self._forces_at_index, numbers)

    @property
    def final_forces(self) -> EquilibriumForces:
        """Forces and contacts at the end of the analysis."""
        return self._forces_at_index(len(self.track.times) - 1)

    def _forces_at_index(self, i: int) -> EquilibriumForces:
        held = {name: self._reaction(k, i) for k, name in enumerate(self.names)}
        most = max((float(np.linalg.norm(f, axis=1).max()) for f, _, _ in self._contact_resultants), default=0.0)
        size = float(np.linalg.norm(np.ptp(self.X, axis=0)))
        touches = _LazyContactResults(self, i)
        return EquilibriumForces(
            held, acting=most, moved=self._largest_displacement, extent=size, reason=WHY, touches=touches
        )

    @cached_property
    def _largest_displacement(self) -> float:
        """Largest displacement of a node of the contact surfaces at the end, m."""
        states = self._contact_history.surfaces
        return max((float(np.linalg.norm(s.u, axis=1).max(initial=0.0)) for s in states[-1][1]), default=0.0)

    def _reaction(self, k: int, i: int) -> Reaction:
        f, m, at = (values[i] for values in self._contact_resultants[k])
        return Reaction(to_vector(f), to_vector(m), to_vector(at), to_vector(m - np.cross(at, f)))

    @cached_property
    def _surfaces(self) -> dict[int, tuple[ContactSurfaceState, ...]]:
        return dict(self._contact_history.surfaces)

    def contact_result_at(self, name: str, i: int) -> ContactNumbers:
        """Return the result of a contact at the stored time with index i."""
        k = self.names.index(name)
        surface, nodes, act = self._surfaces[i][k], self._contact_history.nodes[k], self._contact_history.acts[i][k]
        x, f, g = self.X.copy(), np.zeros(len(self.X)), np.full(len(self.X), np.inf)
        if not self.small:
            x[nodes] += surface.u
        if name in self.meets:
            return self._self_contact_result(name, i, x, surface, nodes)
        contact = self.contacts[name]
        f[nodes], g[nodes] = surface.f, surface.g
        own = pressure_distribution(self.case, contact, self.X, x, f, g)
        return make_contact_result(self.X, contact, own, act.gap, act.left, self._friction_result(name, i, own.area))

    def _self_contact_result(
        self, name: str, i: int, x: Floats, surface: ContactSurfaceState, nodes: Ints
    ) -> ContactNumbers:
        """Return the result of a self-contact at the stored time with index i, with nodes at x (n, 3), m."""
        u, force = np.zeros((2, *self.X.shape))
        u[nodes], force[nodes] = surface.u, surface.f
        touch = contact_result(self.case, self.meets[name], self.mesh, x, u.ravel(), None, force)
        return replace(touch, rubbing=self._friction_result(name, i, touch.area))

    def _friction_result(self, name: str, i: int, area: float) -> Friction | None:
        every = (*self.contacts.items(), *self.meets.items())
        rubbing = [n for n, contact in every if hasattr(contact, "friction")]
        if name not in rubbing:
            return None
        own = self.track.rubbed[i][rubbing.index(name)]
        return Friction(own.slip, own.sticks or 0.0, area * own.area, own.heat)


class _LazyContactResults(Mapping[str, ContactNumbers]):
    """Results of all contacts at one time, by name, each computed on first use."""

    def __init__(self, followed: ContactHistoryResults, i: int) -> None:
        self.followed, self.i = followed, i
        self.known: dict[str, ContactNumbers] = {}

    def __getitem__(self, name: str) -> ContactNumbers:
        if name not in self.followed.names:
            raise KeyError(name)
        if name not in self.known:
            self.known[name] = self.followed.contact_result_at(name, self.i)
        return self.known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.followed.names)

    def __len__(self) -> int:
        return len(self.followed.names)
