"""Nodal forces of a body in static equilibrium: loads, and support reactions from the residual.

The residual, internal minus applied forces, is zero except at supports, where it is the force of the support on
the body. Each support gets the forces on the degrees of freedom that it holds. If several supports hold the
same degree of freedom, the first support in the scene gets its force, so that no force counts twice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.results.load_results import to_vector
from softmark.interpreter.results.reaction_results import ContactNumbers, Fluid, Reaction
from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.assembly.assembly import Assembly
    from softmark.solvers.contact.rigid_contact import RigidContact
    from softmark.solvers.mesh.mesh import Mesh

Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Wrench:
    """Force, N, and moment about the origin, N m, (3,) each."""

    force: Floats
    moment: Floats

    def __add__(self, other: Wrench) -> Wrench:
        """Return the sum of two forces and of their moments."""
        return Wrench(self.force + other.force, self.moment + other.moment)

    def about(self, point: Floats) -> Floats:
        """Return the moment about a point (3,), m, in N m."""
        found: Floats = self.moment - np.cross(point, self.force)
        return found


def resultant_of_rings(f: Floats) -> Wrench:
    """Return the resultant of forces (n, 3), N, on whole rings around the y axis; radial components cancel."""
    return Wrench(np.array([0.0, f[:, 1].sum(), 0.0]), np.zeros(3))


NOTHING = Wrench(np.zeros(3), np.zeros(3))


@dataclass(frozen=True)
class NodalForces:
    """Nodal forces in a static state: nodes `x` (n, 3), m, and the residual `left` (n, 6), N and N m.

    Nodes are deformed, or undeformed if strains are small, so that internal moments balance. Moments are about the
    columns of `frames` (n, 3, 3), or about the space axes if these are None. `u` (n, 3) are displacements, m;
    `loads` (n, 6) are the forces of each load at full size; `energy` is the strain energy, J. `work`, J, is the
    work of each full load along these displacements; None if it depends on the path. `turns_freely` is true if
    internal forces have no moment, that is if the energy is invariant under rotation. `written` (n, 6) is the
    residual of the state as stored, while `left` excludes the effect of rounding in it. Forces on an `axial` body,
    one of revolution about the y axis, have a resultant along the axis and no moment. `pulling` (n, 6) are the
    forces of muscles: their resultant is zero, but their size is used as a scale.
    """

    X: Floats
    u: Floats
    x: Floats
    left: Floats
    loads: Mapping[str, Floats]
    energy: float
    work: Mapping[str, float | None]
    frames: Floats | None = None
    turns_freely: bool = True
    axial: bool = False
    holders: tuple[SupportedNodes, ...] = ()  # supported nodes, if the model determines them itself
    dissipated: float = 0.0  # J, by viscoelastic materials
    written: Floats | None = None
    beds: Mapping[str, Floats] = field(default_factory=dict)  # forces of each foundation or contact on the body (n, 6)
    touches: Mapping[str, ContactNumbers] = field(default_factory=dict)  # results of contacts, by name
    pulling: Floats | None = None
    fluid: Fluid | None = None  # fluid of a porous body

    def wrench(self, forces: Floats) -> Wrench:
        """Return the resultant of nodal forces and moments (n, 6), N and N m."""
        f, m = forces[:, :3], forces[:, 3:]
        if self.axial:
            return resultant_of_rings(f)
        if self.frames is not None:
            m = np.einsum("nij,nj->ni", self.frames, m)
        return Wrench(f.sum(axis=0), m.sum(axis=0) + np.cross(self.x, f).sum(axis=0))

    @cached_property
    def load_resultants(self) -> dict[str, Wrench]:
        """Return the resultant of every load, by name."""
        return {name: self.wrench(f) for name, f in self.loads.items()}

    @cached_property
    def middle(self) -> Floats:
        """Centre (3,), m, of the bounding box of the nodes."""
        found: Floats = 0.5 * (self.x.min(axis=0) + self.x.max(axis=0))
        return found

    @cached_property
    def extent(self) -> float:
        """Diagonal of the bounding box of the nodes, m."""
        return float(np.linalg.norm(np.ptp(self.x, axis=0)))

    @cached_property
    def largest_load_size(self) -> float:
        """Size of the largest load, N: the sum of its nodal force magnitudes, as pressure may have no resultant."""
        return max((float(np.linalg.norm(f[:, :3], axis=1).sum()) for f in self.loads.values()), default=0.0)


@dataclass(frozen=True)
class SupportedNodes:
    """Degrees of freedom that a support holds (n, 6), and the weight of each node (n,).

    `named` is false if the scene does not declare the support, as for the plane of a plane body.
    """

    name: str
    holds: Bools
    weights: Floats
    named: bool = True


def on_mesh(mesh: Mesh, state: Floats, u: Floats, assembly: Assembly, loads: Sequence[tuple[Declared, Energy]],
            small: bool, turns_freely: bool = True, axial: bool = False,
            muscles: Sequence[Energy] = ()) -> NodalForces:  # fmt: skip
    """Return the nodal forces on a mesh with displacements u (3 n,), m, which are the first entries of the `state`."""
    exact = np.asarray(state, dtype=np.float64)
    moved = np.ascontiguousarray(u, dtype=np.float64).reshape(-1, 3)
    left = assembly.gradient(exact, 1.0)[: mesh.points.size].reshape(-1, 3)
    own = {load.name: _without_moments(force_at_nodes(energy, moved.ravel())) for load, energy in loads}
    energy = float(sum(e.value(exact) for e in assembly.internal))
    work = {load.name: -float(e.value(moved.ravel())) if e.conservative else None for load, e in loads}
    x = mesh.points if small else mesh.points + moved
    pulling = (
        sum((_without_moments(force_at_nodes(e, moved.ravel())) for e in muscles), np.zeros((len(x), 6)))
        if muscles
        else None
    )
    return NodalForces(
        mesh.points, moved, x, _without_moments(left), own, energy, work, None, turns_freely, axial, pulling=pulling
    )


def add_foundation_forces(carried: NodalForces, beds: Mapping[str, Energy]) -> NodalForces:
    """Return nodal forces to which the forces of foundations are added; the strain energy is not changed."""
    u = carried.u.ravel()
    stored = sum(bed.value(u) for bed in beds.values())
    each = {name: _without_moments(reported_forces(bed, force_at_nodes(bed, u))) for name, bed in beds.items()}
    return replace(carried, energy=carried.energy - stored, beds=each)


def reported_forces(bed: Energy, forces: Floats) -> Floats:
    """Return the forces (n, 3), N, that are reported for a foundation or tie.

    For a tie between pieces these are the forces on all pieces but the first.
    """
    return forces if bed.reaction_nodes is None else np.where(bed.reaction_nodes[:, None], forces, 0.0)


def add_rigid_contact_forces(carried: NodalForces, contacts: Mapping[str, RigidContact], case: Case) -> NodalForces:
    """Return nodal forces to which the forces of contacts with rigid bodies are added."""
    from softmark.interpreter.models.postprocessing.contact_results import contact_result

    u = carried.u.ravel()
    each = {name: _without_moments(force_at_nodes(contact, u)) for name, contact in contacts.items()}
    touches = {name: contact_result(case, contact, carried.X, carried.x, u) for name, contact in contacts.items()}
    return replace(carried, beds={**carried.beds, **each}, touches=touches)


def force_at_nodes(load: Energy, u: Floats) -> Floats:
    """Return the nodal forces of a load (n, 3), N, in a state u (3 n,)."""
    g = np.zeros_like(u)
    load.add_gradient(u, g)
    return -g.reshape(-1, 3)


def _without_moments(forces: Floats) -> Floats:
    """Return nodal forces (n, 3) extended by zero moments, as (n, 6)."""
    return np.hstack([forces, np.zeros_like(forces)])


# ------------------------------------------------------------------ who carries it


def supported_nodes(case: Case, mesh: Mesh | None, thing: Any) -> list[SupportedNodes]:
    """Return the nodes that each support holds, in the order of the scene.

    The nodes are those of the `mesh` or, if it is None, those of a beam or frame model, whose declaration is `thing`.
    """
    if mesh is not None:
        return [_nodes_of_support(case, support, mesh) for support in case.supports]
    if case.shape.wired:
        from softmark.interpreter.models.beam_frame.frame_layout import Layout

        layout = Layout.of(case, thing.segments)
        masks = [(support.name, layout.holds(support)) for support in case.supports]
        return [SupportedNodes(name, mask, np.asarray(mask.any(axis=1), dtype=np.float64)) for name, mask in masks]
    from softmark.interpreter.models.beam.beam_supports import held_dof_masks

    stations = np.array(thing.stations(case))
    found = held_dof_masks(case, stations.tolist())
    return [
        SupportedNodes(name, mask, _represented_lengths(stations, np.asarray(mask[:, :3].any(axis=1))))
        for name, mask in found.items()
    ]


def _represented_lengths(stations: Floats, nodes: Bools) -> Floats:
    """Return the length (n,), m, that each held node of a beam represents; 1 if no segment is held."""
    half = 0.5 * np.diff(stations) * (nodes[:-1] & nodes[1:])
    found: Floats = np.concatenate([half, [0.0]]) + np.concatenate([[0.0], half])
    return found if found.any() else nodes.astype(float)


def _nodes_of_support(case: Case, support: Declared, mesh: Mesh) -> SupportedNodes:
    """Return the nodes that a support holds on a mesh, with weights."""
    from softmark.interpreter.models.shared.support_constraints import selected_nodes

    nodes = selected_nodes(case, support, mesh)
    holds = np.zeros((len(nodes), 6), dtype=np.bool_)
    holds[:, list(support.thing.components)] = nodes[:, None]
    return SupportedNodes(support.name, holds, _weights(mesh, nodes), not support.thing.implied)


def _weights(mesh: Mesh, nodes: Bools) -> Floats:
    """Return the weight of each held node (n,): volume of held cells, else area of held facets, else 1."""
    cells = nodes[mesh.cells].all(axis=1)
    if cells.any():
        own = np.repeat(mesh.volumes[cells] / mesh.cells.shape[1], mesh.cells.shape[1])
        volumes: Floats = np.bincount(mesh.cells[cells].ravel(), own, minlength=len(mesh.points)).astype(np.float64)
        return volumes
    facets = mesh.facets[nodes[mesh.facets].all(axis=1)]
    if not len(facets):
        return nodes.astype(float)
    corners = mesh.points[facets][:, np.array(mesh.element.facet.triangles)]
    sides = corners[:, :, 1:] - corners[:, :, :1]
    areas = 0.5 * np.linalg.norm(np.cross(sides[:, :, 0], sides[:, :, 1]), axis=2).sum(axis=1)
    each = np.repeat(areas / facets.shape[1], facets.shape[1])
    found: Floats = np.bincount(facets.ravel(), each, minlength=len(mesh.points)).astype(np.float64)
    return found


def reactions(carried: NodalForces, supports: Sequence[SupportedNodes]) -> dict[str, Reaction]:
    """Return the reaction of every support on the body, by name."""
    found, taken = {}, np.zeros(carried.left.shape, dtype=np.bool_)
    for support in supports:
        others = [s for s in supports if s.named and s is not support and bool((s.holds & support.holds).any())]
        own = carried.wrench(np.where(support.holds & ~taken, carried.left, 0.0))
        at: Floats = support.weights @ carried.x / support.weights.sum()
        at = at * (0.0, 1.0, 0.0) if carried.axial else at
        both = np.any([s.holds for s in others], axis=0) & support.holds if others else taken & False
        found[support.name] = Reaction(
            to_vector(own.force),
            to_vector(own.moment),
            to_vector(at),
            to_vector(own.about(at)),
            tuple(s.name for s in others),
            to_vector(carried.wrench(np.where(both, carried.left, 0.0)).force),
        )
        taken |= support.holds
    return found | {name: _foundation_reaction(carried, own) for name, own in carried.beds.items()}


def _foundation_reaction(carried: NodalForces, forces: Floats) -> Reaction:
    """Return the reaction of a foundation, with its moment about the centre of the force magnitudes."""
    own, sizes = carried.wrench(forces), np.linalg.norm(forces[:, :3], axis=1)
    at: Floats = sizes @ carried.x / (float(sizes.sum()) or 1.0)
    at = at * (0.0, 1.0, 0.0) if carried.axial else at
    return Reaction(to_vector(own.force), to_vector(own.moment), to_vector(at), to_vector(own.about(at)))
