"""Results of a contact with a rigid body in a state, and its pressure distribution."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.models.shared.rigid_contact_setup import plane_modulus
from softmark.interpreter.results.reaction_results import ContactNumbers, Friction
from softmark.records import dataclass
from softmark.solvers.contact.contact_pressure_recovery import ContactPressure
from softmark.solvers.energies.energy import Floats, Ints

if TYPE_CHECKING:
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.contact.rigid_contact import RigidContact

SAME = 1e-7  # of the size of a slice: nearer nodes in its plane count as coincident
ON = 1e-3  # of the extent of the surface: a point farther away is not on it


@dataclass(frozen=True)
class ContactPressureField:
    """Undeformed contact surface with nodes X (n, 3), m, and its contact pressure.

    `may` (m,) are the nodes that may come into contact. `rubbed` has friction results at all nodes (n,), by name.
    The surface may consist of `sides` surfaces with equal and opposite pressure.
    """

    X: Floats
    may: Ints
    pressing: ContactPressure
    rubbed: Mapping[str, Floats] = field(default_factory=dict)
    sides: int = 1

    @property
    def edge(self) -> float:
        """Typical edge length of the facets, m."""
        corners = self.X[self.pressing.corners]
        lengths = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        return float(np.median(lengths[lengths > 0.0]))

    @cached_property
    def at_nodes(self) -> Mapping[str, Floats]:
        """Nodal values (n,), by name: `pressure`, Pa, and `gap`, m; with friction also `slip`, m, and `sticks`."""
        own = np.full(len(self.X), np.nan)
        own[self.may] = self.pressing.g[self.may]
        return {"pressure": self.pressing.pressures, "gap": own, **self.rubbed}

    def pressures(self, X: Floats) -> Floats:
        """Return the pressure (n,), Pa, at material points X (n, 3), m; nan off the surface.

        Pressure is interpolated linearly on triangles.
        """
        return self.values("pressure", X)

    def values(self, name: str, X: Floats) -> Floats:
        """Return the nodal result `name`, interpolated at material points X (n, 3), m."""
        from softmark.solvers.contact.signed_distance.triangle_tree import TriangleTree

        split = np.array(self.pressing.plain.halves)
        triangles = self.pressing.corners[:, split].reshape(-1, 3)
        corners = self.X[triangles]
        nearest, shares = TriangleTree(corners).closest(X)
        far = np.linalg.norm(np.einsum("na,nai->ni", shares, corners[nearest]) - X, axis=1)
        found: Floats = np.einsum("na,na->n", shares, self.at_nodes[name][triangles[nearest]])
        size = float(np.linalg.norm(np.ptp(corners.reshape(-1, 3), axis=0)))
        return np.where(far > ON * size, np.nan, found)


def nodal_friction_results(
    to_nodes: Callable[[Floats], Floats], A: Floats, slid: Floats, push: Floats, sticks: Floats
) -> dict[str, Floats]:
    """Return the friction results `slip` and `sticks` at nodes (n,), from values at contact points (p,).

    `to_nodes` sums values of contact points at nodes, by their weights. `slip`, m, is the mean of the slip `slid`
    (p,), m, of surrounding points, weighted by areas A (p,), m^2. `sticks` is 1 where most of the normal force
    `push` (p,), N, acts on sticking points; their force is the argument `sticks` (p,), N. It is -1 where the
    surface slides, and 0 without pressure.
    """
    area, force = to_nodes(A), to_nodes(push)
    pressed = force > 0.0
    far = np.divide(to_nodes(A * slid), area, out=np.zeros_like(area), where=area > 0.0)
    return {"slip": far, "sticks": np.where(pressed, np.where(2.0 * to_nodes(sticks) > force, 1.0, -1.0), 0.0)}


def index_by_place(X: Floats) -> Ints:
    """Return an index for each node (n,) of a plane slice that is equal for nodes with equal x and y."""
    size = float(np.ptp(X, axis=0).max())
    found: Ints = np.unique(np.round(X[:, :2] / (SAME * size)).astype(np.int64), axis=0, return_inverse=True)[1].ravel()
    return found


def contact_result(case: Case, contact: RigidContact, X: Floats, x: Floats, u: Floats) -> ContactNumbers:
    """Return the result of a contact whose nodes X (n, 3), m, are displaced by u (3 n,), m.

    Moments are computed with nodes at x (n, 3), m.
    """
    gaps, push = contact.gaps(u), contact.A * contact.pressures(u)
    g = np.full(len(X), np.inf)
    there = X[contact.nodes] + u.reshape(-1, 3)[contact.nodes]
    g[contact.nodes] = contact.body.gap(there * (1.0, 1.0, 0.0) if contact.flat else there)
    own = pressure_distribution(case, contact, X, x, contact.presses(u, len(X)), g)
    on, whole = push > 0.0, float(push.sum())
    left = float(push[on] @ gaps[on]) / whole if whole > 0.0 else 0.0
    return make_contact_result(X, contact, own, float(gaps.min()), left)


def pressure_distribution(
    case: Case, contact: RigidContact, X: Floats, x: Floats, f: Floats, g: Floats
) -> ContactPressure:
    """Return the pressure distribution of nodal normal forces f (n,), N, with gaps g (n,), m.

    X (n, 3), m, are the undeformed nodes. Moments are computed with nodes at x (n, 3), m.
    """
    assert contact.facets is not None
    few = contact.extra is None and len(contact.A) <= len(contact.nodes) + len(contact.facets)
    near = g < contact.barrier.distance
    touching = near if few and (near.any() or not f.any()) else None  # else it touches between nodes as well, or alone
    same = index_by_place(X) if case.planar else None
    return ContactPressure(contact.facets, x, f, g, plane_modulus(case), case.depth, same, touching)


def make_contact_result(
    X: Floats, contact: RigidContact, own: ContactPressure, gap: float, left: float, rubbing: Friction | None = None
) -> ContactNumbers:
    """Return the result of a contact from its pressure distribution `own` and its gaps.

    `gap`, m, is the smallest gap, and `left`, m, the mean gap under pressure.
    """
    return ContactNumbers(own.area, own.largest, gap, left, ContactPressureField(X, contact.nodes, own), rubbing)
