"""What acts at the nodes of a body at rest: loads, and what supports carry of what loads and stress leave over.

A solver's own out-of-balance forces, internal less applied, are zero but where a support holds: there they are what it
does to the body. Each support has what acts on the degrees of freedom that it holds; of those that several hold, the
first in the scene has it, so that nothing counts twice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.results.load_results import vector
from softmark.interpreter.results.reaction_results import Fluid, Reaction, Touch
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
    """A force, N, and its moment about the origin, N m: (3,) each."""

    force: Floats
    moment: Floats

    def __add__(self, other: Wrench) -> Wrench:
        return Wrench(self.force + other.force, self.moment + other.moment)

    def about(self, point: Floats) -> Floats:
        """Its moment about a point (3,), N m."""
        found: Floats = self.moment - np.cross(point, self.force)
        return found


def of_rings(f: Floats) -> Wrench:
    """What forces on whole rings around the y axis (n, 3), N, come to: those across it cancel."""
    return Wrench(np.array([0.0, f[:, 1].sum(), 0.0]), np.zeros(3))


NOTHING = Wrench(np.zeros(3), np.zeros(3))


@dataclass(frozen=True)
class Carried:
    """A state of rest: nodes `x` (n, 3) where forces act, m, and the unbalanced ones `left` (n, 6), N and N m.

    Nodes stand where they are, or undeformed where strains are small: there the moments of what is inside add up to
    nothing. Moments are about the columns of `frames` (n, 3, 3), or in space. `u` (n, 3) are displacements, m, `loads`
    (n, 6) what each load does at full size, `energy` the strain energy, J. `work` is that of each load at full size
    along these displacements, J, None of one that depends on the way. It `turns_freely` where internal forces have no
    moment, as those of an energy that does not see rotations. `written` (n, 6) are those left over in the state as its
    numbers are, where `left` is without what rounding of these leaves. What acts on an `axial` body, one of revolution
    about the y axis, comes to a force along it, and to no moment. `pulling` (n, 6) is what muscle within does, which
    comes to nothing, and is a measure of what acts all the same.
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
    holders: tuple[Holder, ...] = ()  # of a model that has its own: what supports hold
    dissipated: float = 0.0  # J, by what remembers
    written: Floats | None = None
    beds: Mapping[str, Floats] = field(default_factory=dict)  # what each bed, or contact, does to the body (n, 6)
    touches: Mapping[str, Touch] = field(default_factory=dict)  # what contacts come to
    pulling: Floats | None = None
    fluid: Fluid | None = None  # of a porous body

    def wrench(self, forces: Floats) -> Wrench:
        """What forces and moments (n, 6) at the nodes come to."""
        f, m = forces[:, :3], forces[:, 3:]
        if self.axial:
            return of_rings(f)
        if self.frames is not None:
            m = np.einsum("nij,nj->ni", self.frames, m)
        return Wrench(f.sum(axis=0), m.sum(axis=0) + np.cross(self.x, f).sum(axis=0))

    @cached_property
    def applied(self) -> dict[str, Wrench]:
        """Of every load, by name."""
        return {name: self.wrench(f) for name, f in self.loads.items()}

    @cached_property
    def middle(self) -> Floats:
        """The middle of what its nodes span (3,), m."""
        found: Floats = 0.5 * (self.x.min(axis=0) + self.x.max(axis=0))
        return found

    @cached_property
    def extent(self) -> float:
        """The diagonal of the same, m."""
        return float(np.linalg.norm(np.ptp(self.x, axis=0)))

    @cached_property
    def largest(self) -> float:
        """The largest load, N: the sizes of its forces at nodes, for a pressure all around comes to no force."""
        return max((float(np.linalg.norm(f[:, :3], axis=1).sum()) for f in self.loads.values()), default=0.0)


@dataclass(frozen=True)
class Holder:
    """A support, the degrees of freedom that it holds (n, 6), and how much each node stands for (n,).

    Not `named` is what the scene does not name: the plane of a plane body.
    """

    name: str
    holds: Bools
    weights: Floats
    named: bool = True


def on_mesh(mesh: Mesh, state: Floats, u: Floats, assembly: Assembly, loads: Sequence[tuple[Declared, Energy]],
            small: bool, turns_freely: bool = True, axial: bool = False,
            muscles: Sequence[Energy] = ()) -> Carried:  # fmt: skip
    """Of a state of a mesh whose nodes move by u (3 n,), m; other unknowns of the `state` follow these."""
    exact = np.asarray(state, dtype=np.float64)
    moved = np.ascontiguousarray(u, dtype=np.float64).reshape(-1, 3)
    left = assembly.gradient(exact, 1.0)[: mesh.points.size].reshape(-1, 3)
    own = {load.name: _plain(force_at_nodes(energy, moved.ravel())) for load, energy in loads}
    energy = float(sum(e.value(exact) for e in assembly.internal))
    work = {load.name: -float(e.value(moved.ravel())) if e.conservative else None for load, e in loads}
    x = mesh.points if small else mesh.points + moved
    pulling = (
        sum((_plain(force_at_nodes(e, moved.ravel())) for e in muscles), np.zeros((len(x), 6))) if muscles else None
    )
    return Carried(mesh.points, moved, x, _plain(left), own, energy, work, None, turns_freely, axial, pulling=pulling)


def bedded(carried: Carried, beds: Mapping[str, Energy]) -> Carried:
    """With what beds do to a body that lies on them; the strain energy is that of the body alone."""
    u = carried.u.ravel()
    stored = sum(bed.value(u) for bed in beds.values())
    each = {name: _plain(counted(bed, force_at_nodes(bed, u))) for name, bed in beds.items()}
    return replace(carried, energy=carried.energy - stored, beds=each)


def counted(bed: Energy, forces: Floats) -> Floats:
    """Those of its forces (n, 3), N, that are told: between pieces of a body the force on all but the first."""
    return forces if bed.told is None else np.where(bed.told[:, None], forces, 0.0)


def touched(carried: Carried, contacts: Mapping[str, RigidContact], case: Case) -> Carried:
    """With what rigid bodies do to a body that touches them."""
    from softmark.interpreter.models.postprocessing.contact_results import touch_of

    u = carried.u.ravel()
    each = {name: _plain(force_at_nodes(contact, u)) for name, contact in contacts.items()}
    touches = {name: touch_of(case, contact, carried.X, carried.x, u) for name, contact in contacts.items()}
    return replace(carried, beds={**carried.beds, **each}, touches=touches)


def force_at_nodes(load: Energy, u: Floats) -> Floats:
    """What a load does at the nodes (n, 3), N, in a state u (3 n,)."""
    g = np.zeros_like(u)
    load.add_gradient(u, g)
    return -g.reshape(-1, 3)


def _plain(forces: Floats) -> Floats:
    """Forces without moments (n, 6)."""
    return np.hstack([forces, np.zeros_like(forces)])


# ------------------------------------------------------------------ who carries it


def holders(case: Case, mesh: Mesh | None, thing: Any) -> list[Holder]:
    """The supports of a model on a mesh, or else of beams, in the order of the scene, and what each holds of it."""
    if mesh is not None:
        return [_of_mesh(case, support, mesh) for support in case.supports]
    if case.shape.wired:
        from softmark.interpreter.models.beam_frame.frame_layout import Layout

        layout = Layout.of(case, thing.segments)
        masks = [(support.name, layout.holds(support)) for support in case.supports]
        return [Holder(name, mask, np.asarray(mask.any(axis=1), dtype=np.float64)) for name, mask in masks]
    from softmark.interpreter.models.beam.beam_supports import held_by

    stations = np.array(thing.stations(case))
    found = held_by(case, stations.tolist())
    return [Holder(name, mask, _along(stations, np.asarray(mask[:, :3].any(axis=1)))) for name, mask in found.items()]


def _along(stations: Floats, nodes: Bools) -> Floats:
    """What each held node of a beam stands for (n,): of the length between held ones, or where there is none, one."""
    half = 0.5 * np.diff(stations) * (nodes[:-1] & nodes[1:])
    found: Floats = np.concatenate([half, [0.0]]) + np.concatenate([[0.0], half])
    return found if found.any() else nodes.astype(float)


def _of_mesh(case: Case, support: Declared, mesh: Mesh) -> Holder:
    from softmark.interpreter.models.shared.support_constraints import selected

    nodes = selected(case, support, mesh)
    holds = np.zeros((len(nodes), 6), dtype=np.bool_)
    holds[:, list(support.thing.components)] = nodes[:, None]
    return Holder(support.name, holds, _weights(mesh, nodes), support in case.named_supports)


def _weights(mesh: Mesh, nodes: Bools) -> Floats:
    """What each held node stands for (n,): of the volume of cells that are held, or of the area of facets, or one."""
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


def reactions(carried: Carried, supports: Sequence[Holder]) -> dict[str, Reaction]:
    """What every support does to the body, by name."""
    found, taken = {}, np.zeros(carried.left.shape, dtype=np.bool_)
    for support in supports:
        others = [s for s in supports if s.named and s is not support and bool((s.holds & support.holds).any())]
        own = carried.wrench(np.where(support.holds & ~taken, carried.left, 0.0))
        at: Floats = support.weights @ carried.x / support.weights.sum()
        at = at * (0.0, 1.0, 0.0) if carried.axial else at
        both = np.any([s.holds for s in others], axis=0) & support.holds if others else taken & False
        found[support.name] = Reaction(
            vector(own.force), vector(own.moment), vector(at), vector(own.about(at)), tuple(s.name for s in others),
            vector(carried.wrench(np.where(both, carried.left, 0.0)).force),
        )  # fmt: skip
        taken |= support.holds
    return found | {name: _of_bed(carried, own) for name, own in carried.beds.items()}


def _of_bed(carried: Carried, forces: Floats) -> Reaction:
    """What a bed does: its moment is about the middle of the forces' sizes."""
    own, sizes = carried.wrench(forces), np.linalg.norm(forces[:, :3], axis=1)
    at: Floats = sizes @ carried.x / (float(sizes.sum()) or 1.0)
    at = at * (0.0, 1.0, 0.0) if carried.axial else at
    return Reaction(vector(own.force), vector(own.moment), vector(at), vector(own.about(at)))
