"""Setup of contacts of a body with rigid bodies, as energies of the nodes of its surface."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.problem.body_case import Case, Fault, RigidBodyContact, fault
from softmark.interpreter.problem.surface_selection.loaded_surface_part import find_loaded_surface
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.records import dataclass
from softmark.solvers.contact.barrier_law import Barrier
from softmark.solvers.contact.rigid_contact import RigidContact, node_areas
from softmark.solvers.contact.rigid_transform import MovedGap, RigidMotion
from softmark.solvers.contact.signed_distance import gap_of
from softmark.solvers.contact.tunnelling_check import SurfaceTriangles, surface_triangles
from softmark.solvers.elements.boundary_facets import FACETS
from softmark.solvers.mesh.plane_boundary import is_on_border

if TYPE_CHECKING:
    from softmark.solvers.contact.signed_distance.distance_function import Gap
    from softmark.solvers.energies.energy import Floats, Ints
    from softmark.solvers.mesh.mesh import Mesh

Bools = NDArray[np.bool_]
THIN = 1e-5  # of the size of a body: distance at which the barrier becomes active
SLIGHT = 5e-4  # of the prescribed motion, if that is smaller: such a gap changes forces by a thousandth
LEAST = 1e-9  # of the size of a body: smallest activation distance above rounding
BEARS = 0.5  # times Young's modulus: stiffness of the barrier


def contacts_on(case: Case, mesh: Mesh) -> dict[str, RigidContact]:
    """Return the energy of every contact with a rigid body, by name.

    Raises Fault if a contact has no surface, shares facets with another contact, or overlaps at the start.
    """
    _check_distinct_surfaces(case, mesh)
    return {touch.name: _contact_energy(case, touch, mesh) for touch in case.contacts}


def _check_distinct_surfaces(case: Case, mesh: Mesh) -> None:
    """Raise Fault if two contacts with one rigid body select the same whole facets."""
    for i, later in enumerate(case.contacts):
        for first in (c for c in case.contacts[:i] if c.rigid.name == later.rigid.name):
            own, others = (find_loaded_surface(case.shape, mesh, t.thing.where).whole for t in (later, first))
            if not set(map(tuple, np.sort(own).tolist())) & set(map(tuple, np.sort(others).tolist())):
                continue
            raise fault(
                "E616",
                later.at("where" if "where" in later.declared.fields else ""),
                f"`{later.name}` selects facets of `{case.body.name}` that `{first.name}` selects too",
                f"same facets, same rigid body `{later.rigid.name}`",
                "remove one contact, or select different parts of the surface",
            )


@dataclass(frozen=True)
class PrescribedPosition:
    """Prescribed position of a rigid body as a function of the load fraction: first rotated, then translated."""

    gap: Gap
    touch: RigidBodyContact

    def __call__(self, share: float) -> Gap:
        """Return the gap function of the rigid body at its position for a load fraction `share`."""
        pose = pose_at(self.touch, share)
        return self.gap if pose is None else MovedGap(self.gap, pose)

    def pose(self, share: float) -> RigidMotion:
        """Return the rigid motion from the declared position to the position at a load fraction `share`."""
        return pose_at(self.touch, share) or RigidMotion()


def pose_at(touch: RigidBodyContact, share: float) -> RigidMotion | None:
    """Return the motion of a rigid body by its supports and loads at a load fraction; None if it has not moved."""
    shift, rotation, about = np.zeros(3), np.zeros(3), np.zeros(3)
    if touch.along is not None:
        shift[touch.along] = share * touch.force_travel
    for support in touch.moved:
        shift = shift + share * np.array(support.thing.imposed)
        if support.thing.rotates:
            rotation, about = share * np.array(support.thing.rotation), np.array(support.thing.through)
    if not (shift.any() or rotation.any()):
        return None
    (a, b, c), (p, q, r), (x, y, z) = shift.tolist(), rotation.tolist(), about.tolist()
    return RigidMotion((a, b, c), (p, q, r), (x, y, z))


def size_of(case: Case, mesh: Mesh) -> float:
    """Return the diagonal of the bounding box of a body, m; for a plane slice, the diagonal in its plane."""
    return float(np.linalg.norm(np.ptp(mesh.points[:, :2], axis=0))) if case.planar else mesh.extent


def barrier_of(case: Case, touch: RigidBodyContact, mesh: Mesh) -> Barrier:
    """Return the barrier of a contact: its activation distance and its stiffness.

    Both follow from the size of the body, its stiffness and the prescribed motion.
    """
    return Barrier(touch.thing.distance or _barrier_distance(case, touch, mesh), BEARS * case.largest_young)


def _barrier_distance(case: Case, touch: RigidBodyContact, mesh: Mesh) -> float:
    """Return the distance at which the barrier becomes active, m, so small that the remaining gap is negligible.

    In static analyses it is a small fraction of the prescribed support motion or, without such a motion, of the
    compression by loads.
    """
    extent = size_of(case, mesh)
    if isinstance(case.analysis, Dynamic):
        return THIN * extent
    travel = max((math.hypot(*s.thing.imposed) for s in (*case.supports, *touch.moved)), default=0.0)
    if not travel and touch.along is None:  # the travel of a force-driven rigid body is not known in advance
        travel = _estimate_shortening(case, mesh)
    return min(THIN * extent, max(SLIGHT * travel, LEAST * extent)) if travel else THIN * extent


def _estimate_shortening(case: Case, mesh: Mesh) -> float:
    """Return an estimate of the shortening of the body under its loads, m; 0 if no load has a force.

    It is F L^2 / (E V), the shortening of a bar of the same length L, volume V and largest Young's modulus E.
    Bending causes larger displacements.
    """
    volume = abs(float(mesh.volumes.sum()))
    total = sum(load.thing.action.size(_MeshedBody(case, mesh, volume)) for load in case.loads)
    return total * mesh.extent**2 / (case.largest_young * volume) if volume > 0.0 else 0.0


@dataclass(frozen=True)
class _MeshedBody:
    """The mass and the loaded area of a meshed body, for orders of magnitude of forces."""

    case: Case
    mesh: Mesh
    volume: float  # m^3

    def mass(self) -> float:
        """Return the mass with the largest density, kg."""
        return self.volume * max(material.density or 0.0 for material in self.case.typical)

    def length(self) -> float:
        """Return the size of the body, m: the extent of its mesh."""
        return self.mesh.extent

    def area(self, where: Condition) -> float:
        """Return the selected area, m^2."""
        return find_loaded_surface(self.case.shape, self.mesh, where).area_with_depth(self.case.depth)


def _contact_energy(case: Case, touch: RigidBodyContact, mesh: Mesh) -> RigidContact:
    """Return the energy of one contact with a rigid body, with friction if declared."""
    gap = gap_of(touch.rigid.thing.shape)
    assert gap is not None  # refused when the scene is checked
    _must_meet_the_plane(case, touch, gap)
    facets = _surface(case, touch, mesh)
    split = mesh.element.facet.triangles
    nodes, areas = node_areas(mesh.points, facets, split, case.depth)
    still = _fully_held_nodes(case, mesh)
    nodes, areas = nodes[~still[nodes]], areas[~still[nodes]]
    barrier, posed = barrier_of(case, touch, mesh), PrescribedPosition(gap, touch)
    made = RigidContact(nodes, mesh.points[nodes], areas, barrier, posed, bool(case.planar), facets=facets)
    made = replace(made, skin=_crossable_surface(case, mesh))
    if steps := facet_subdivisions(case, touch, mesh.points, facets):
        from softmark.solvers.contact.facet_contact_points import add_points_inside_facets

        made = add_points_inside_facets(made, mesh.points, facets, steps, case.depth, still)
    if _is_sharper_than_facets(gap, mesh.points * ((1.0, 1.0, 0.0) if case.planar else 1.0), facets, steps):
        from softmark.solvers.contact.facet_contact_points import make_searched_facets

        made = replace(made, facing=make_searched_facets(mesh.points, facets, steps, bool(case.planar), case.depth))
    if touch.thing.friction:
        from softmark.solvers.contact.rigid_friction import add_friction

        made = add_friction(made, touch.thing.friction, posed.pose)
    _check_initial_overlap(case, touch, made)
    return made


def _crossable_surface(case: Case, mesh: Mesh) -> SurfaceTriangles:
    """Return the surface of the body that a rigid body may pass through."""
    facets = np.asarray(mesh.facets)
    return surface_triangles(
        mesh.points, facets[is_on_border(mesh.points, facets, case.depth > 0.0)] if case.planar else facets
    )


def facet_subdivisions(case: Case, touch: RigidBodyContact, points: Floats, facets: Ints) -> int:
    """Return the number of subdivisions of facets (f, a) for the lattice of contact points; 0 if nodes suffice.

    For plane bodies the lattice is no finer than facets need.
    """
    facet = FACETS[facets.shape[1]]
    steps = 1 + (facet.nodes > facet.corners)
    if not case.planar:
        steps *= _edge_subdivisions(gap_of(touch.rigid.thing.shape), longest_triangle_side(points, facets))
    return steps if len(facet.lattice(steps)) > facet.nodes else 0


def longest_triangle_side(points: Floats, facets: Ints) -> float:
    """Return the longest side, m, of the triangles that facets (f, a) are split into."""
    corners = points[facets[:, np.array(FACETS[facets.shape[1]].triangles)].reshape(-1, 3)]
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max())


def _is_sharper_than_facets(gap: Gap, points: Floats, facets: Ints, steps: int) -> bool:
    """Return whether a rigid body has edges or tips that are sharper than facets subdivided into `steps` parts.

    A blunter body penetrates between contact points by at most an eighth of their distance, which facets can
    follow.
    """
    facet = FACETS[facets.shape[1]]
    parts = max(1, steps // (1 + (facet.nodes > facet.corners)))
    return gap.least_curvature_radius * parts < longest_triangle_side(points, facets)


def _edge_subdivisions(gap: Gap | None, longest: float) -> int:
    """Return into how many parts a sharp rigid body requires that edges of length `longest`, m, are divided."""
    from softmark.solvers.contact.facet_contact_points import MOST

    sharpest = np.inf if gap is None else gap.least_curvature_radius
    return int(np.clip(np.ceil(longest / max(sharpest, longest / MOST)), 1, MOST))


def _must_meet_the_plane(case: Case, touch: RigidBodyContact, gap: Gap) -> None:
    """Raise Fault if a rigid body read from a file lies outside the plane of the body.

    Validation has checked other shapes already.
    """
    points = getattr(gap, "points", None)
    if points is None:
        return
    from softmark.interpreter.problem.out_of_plane_contact import missed_plane_error

    missed = missed_plane_error(touch.rigid, case.body, float(points[:, 2].min()), float(points[:, 2].max()))
    if missed is not None:
        raise Fault(missed)


def _check_initial_overlap(case: Case, touch: RigidBodyContact, made: RigidContact) -> None:
    """Raise Fault if a rigid body overlaps the body at the start."""
    rest, start = np.zeros(int(made.stencils.max()) + 1), made.at(0.0)
    g = start.gaps(rest)
    deepest = int(g.argmin())
    if g[deepest] > -made.barrier.distance:
        return
    from softmark.interpreter.language import units

    at = units.format_vector(start.places(rest)[deepest].tolist(), units.LENGTH)
    deep = units.format_value(float(-g[deepest]), units.LENGTH)
    raise fault(
        "E611",
        touch.at(),
        f"`{touch.rigid.name}` overlaps `{case.body.name}` in the undeformed state by {deep} at {at}",
        "initial overlap",
        "move it away until it just touches, and let a support move it: `displaced(..., by = ...)`",
    )


def plane_modulus(case: Case) -> float:
    """Return the plane strain modulus E / (1 - nu^2), Pa, of the stiffest material of a body."""
    return max(2.0 * float(m.shear_modulus) / (1.0 - float(m.poisson)) for m in case.typical)


def _surface(case: Case, touch: RigidBodyContact, mesh: Mesh) -> Ints:
    """Return the nodes of the facets that may come into contact (k, a). Raises Fault if there are none."""
    facets = find_loaded_surface(case.shape, mesh, touch.thing.where).selected_facets
    facets = np.unique(facets, axis=0)
    if case.planar:
        facets = facets[is_on_border(mesh.points, facets, case.depth > 0.0)]
    free = ~_supported_nodes(case, mesh)
    facets = facets[free[facets].any(axis=1)]
    if not len(facets):
        raise fault(
            "E302",
            touch.at("where" if "where" in touch.declared.fields else ""),
            f"`{touch.name}` selects no part of the surface of `{case.body.name}` that is free to move",
            "selects nothing",
            "write a condition that holds on a part of the surface without support",
        )
    return facets


def _fully_held_nodes(case: Case, mesh: Mesh) -> Bools:
    """Return a mask (n,) of the nodes that supports hold in all components.

    A rigid body may overlap these nodes, because neither moves.
    """
    from softmark.interpreter.models.shared.support_constraints import selected_nodes

    held: Bools = np.zeros((len(mesh.points), 3), dtype=np.bool_)
    for support in case.supports:
        held[:, list(support.thing.components)] |= selected_nodes(case, support, mesh)[:, None]
    return np.asarray(held.all(axis=1), dtype=np.bool_)


def _supported_nodes(case: Case, mesh: Mesh) -> Bools:
    """Return a mask (n,) of the nodes that a named support holds.

    Facets with only such nodes do not take part in contact.
    """
    from softmark.interpreter.models.shared.support_constraints import selected_nodes

    found: Bools = np.zeros(len(mesh.points), dtype=np.bool_)
    for support in case.named_supports:
        found |= selected_nodes(case, support, mesh)
    return found
