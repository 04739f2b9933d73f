"""Independent contact forces of rigid bodies, and check for penetration.

Distances, the barrier law, areas and the motion of a rigid body are computed by independent formulas
(solvers/independent_forces/rigid_contact_forces.py). The parameters of the law, distance and stiffness, are taken from
the model.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.language.coordinate_conditions import EVERYWHERE
from softmark.interpreter.models.shared.rigid_contact_setup import barrier_of, facet_subdivisions
from softmark.interpreter.verification.facet_sweep import select_facets
from softmark.interpreter.verification.support_reactions_check import held_components, rigid_motion
from softmark.interpreter.verification.unverified_model_error import NoIndependentFormula
from softmark.solvers.contact.interaction_state import InteractionState
from softmark.solvers.contact.signed_distance import gap_of
from softmark.solvers.contact.signed_distance.distance_function import depth_of_centroid as depth_of_middle
from softmark.solvers.elements.boundary_facets import FACETS
from softmark.solvers.independent_forces import (
    penetration_depth,
    point_in_deformed_body,
    rigid_contact_forces,
    solid_forces,
)
from softmark.solvers.independent_forces.rigid_friction_forces import move_points
from softmark.solvers.independent_forces.solid_forces import EPS, Floats, Ints
from softmark.solvers.mesh.extruded_shapes import Extruded
from softmark.solvers.mesh.revolved_bodies import Cone, Revolved
from softmark.solvers.mesh.rigid_shapes import HalfSpace, Punch, RoundedBox, RoundedCone, RoundedRevolution
from softmark.solvers.mesh.shapes import Box, Cylinder, MeshFile
from softmark.solvers.mesh.spheres import Sphere, SphericalShell
from softmark.solvers.mesh.surface_bodies import SurfaceBody
from softmark.solvers.mesh.tubes import Tube

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.prepared_model import DeformedMesh
    from softmark.interpreter.problem.body_case import Case, RigidBodyContact
    from softmark.solvers.contact.surface_points import AddedContactPoints
    from softmark.solvers.mesh.shape import Shape

ROUND = 1e-9  # smaller shape functions count as zero
CLOSE = 5e-3  # relative to facet size and barrier distance: points farther away are not in contact
HALF = 0.9  # relative depth to the centre of a rigid body beyond which facets pass through it
PUSHED = 0.1  # least share of a force against the facet normal that counts as resistance
MISSED = 1e-4  # relative penetration that a `where` may leave
ORDERS = {"x": (1, 2, 0), "y": (2, 0, 1), "z": (0, 1, 2)}


def all_contact_forces(case: Case, mesh: DeformedMesh, u: Floats) -> tuple[dict[str, Floats], float]:
    """Return nodal forces (n, 3), N, of every contact by name, and the total uncertainty, N.

    Raises NoIndependentFormula.
    """
    found, unsure = dict[str, Floats](), 0.0
    for touch in case.contacts:
        found[touch.name], left = contact_forces(case, touch, mesh, u)
        unsure += left
    return found, unsure


def check_contacts(case: Case, mesh: DeformedMesh, u: Floats) -> tuple[dict[str, Any], str | None]:
    """Return facts of every contact by name, and the reason if a node penetrates a rigid body, else None.

    Penetration makes the solution invalid. The fact `least_gap`, m, is the smallest gap of all nodes that may
    touch; `overlap`, m, is the penetration of facets between their nodes, if it was checked.
    """
    found, reason = {}, None
    for touch in case.contacts:
        own: dict[str, Any] = {"least_gap": None, "overlap": None}
        try:
            own |= _contact_facts(case, touch, mesh, u)
            deep = _missed_penetration(case, touch, mesh, u)
            swallowed = _is_engulfed(case, touch, mesh, u)
        except NoIndependentFormula as unknown:
            found[touch.name] = own | {"reason": str(unknown)}
            continue
        found[touch.name] = own
        if not own["least_gap"] > 0.0:
            reason = f"a node penetrates `{touch.rigid.name}` by {-own['least_gap']:.1e} m"
        if _passes_between_nodes(case, touch, mesh, u, own):
            reason = (
                f"facets of `{case.body.name}` penetrate `{touch.rigid.name}` by "
                f"{1e3 * own['overlap']:.2g} mm between their nodes, which is half its thickness, and "
                f"the contact force does not push them back: use cells smaller than `{touch.rigid.name}`"
            )
        if swallowed:
            reason = f"`{touch.rigid.name}` is inside `{case.body.name}`: it passed between the contact points; "
            reason += "use cells smaller than the rigid body"
        if deep > MISSED * mesh.mesh.extent:
            reason = (
                f"`{touch.rigid.name}` penetrates by {1e3 * deep:.2g} mm where the contact `{touch.name}` does not act"
            )
            reason += ": choose another `where`"
    return {"contact": found}, reason


def _passes_between_nodes(
    case: Case, touch: RigidBodyContact, mesh: DeformedMesh, u: Floats, own: dict[str, Any]
) -> bool:
    """Return whether facets cut deep into a rigid body between their nodes and the contact does not push them back.

    Facets are pushed back if the contact force has a component against the outward normal of the most deeply cut
    facet. Raises NoIndependentFormula.
    """
    gap = gap_of(touch.rigid.thing.shape)
    if gap is None or not (own["overlap"] or 0.0) >= HALF * depth_of_middle(gap) > 0.0:
        return False
    x = mesh.points + u
    corners = x[_facets(case, touch, mesh)[:, :3]]
    cut = corners[np.linalg.norm(corners.mean(axis=1) - own["deepest"], axis=1).argmin()]
    normal = np.cross(cut[1] - cut[0], cut[2] - cut[0])
    force = contact_forces(case, touch, mesh, u)[0].sum(axis=0)
    return not -float(force @ normal) > PUSHED * float(np.linalg.norm(force) * np.linalg.norm(normal))


def _missed_penetration(case: Case, touch: RigidBodyContact, mesh: DeformedMesh, u: Floats) -> float:
    """Return the penetration, m, of free nodes that no contact with the rigid body selects."""
    if touch.thing.where is EVERYWHERE:
        return 0.0
    others = [other for other in case.contacts if other.rigid.name == touch.rigid.name]
    asked = np.unique(np.concatenate([_facets(case, other, mesh).ravel() for other in others]))
    whole = replace(touch, declared=replace(touch.declared, thing=replace(touch.thing, where=EVERYWHERE)))
    still = np.flatnonzero(np.asarray(held_components(replace(case, supports=case.named_supports), mesh)).any(axis=1))
    nodes = np.setdiff1d(_facets(case, whole, mesh), np.concatenate([asked, still]))
    x = _plane_components(case, mesh.points + u)[nodes]
    return max(0.0, -float(_evaluate_distance(_current_distance(touch), x)[0].min(initial=0.0)))


def _is_engulfed(case: Case, touch: RigidBodyContact, mesh: DeformedMesh, u: Floats) -> bool:
    """Return whether a rigid body lies inside the deformable body, so that no node and no facet penetrates it.

    This is so if the rigid body's centre is inside. If the centre lies in a cavity of the rigid body, its whole surface
    is tested.
    """
    gap = gap_of(touch.rigid.thing.shape)
    if gap is None or gap.centroid is None:
        return False
    look, inside = _current_distance(touch), _point_in_body_test(case, mesh, u)
    middle = _plane_components(case, move_points(np.array([gap.centroid]), *rigid_motion(touch)))
    if _evaluate_distance(look, middle)[0][0] < 0.0:
        return inside(middle[0])
    low, high = _rigid_bounds(touch)
    places = point_in_deformed_body.sample_surface(partial(_evaluate_distance, look), low, high, bool(case.planar))
    if case.depth:  # only one side of the axis
        places[:, 0] = np.abs(places[:, 0])
    return bool(len(places)) and all(map(inside, places))


def _point_in_body_test(case: Case, mesh: DeformedMesh, u: Floats) -> Callable[[Floats], bool]:
    """Return a function that reports whether a point (3,), m, is in the deformed body or its plane section."""
    facets, x = np.asarray(mesh.mesh.facets), mesh.points + u
    if case.planar:  # only one face of the slice
        z = mesh.points[:, 2]
        facets = facets[z[facets].max(axis=1) < 0.5 * (z.min() + z.max())]
    triangles = x[facets[:, np.array(FACETS[facets.shape[1]].triangles)].reshape(-1, 3)]
    if case.planar:
        return lambda p: point_in_deformed_body.is_inside_region(p[:2], triangles[..., :2])
    return lambda p: point_in_deformed_body.is_inside_volume(p, triangles)


def _rigid_bounds(touch: RigidBodyContact) -> tuple[Floats, Floats]:
    """Return bounds of a rigid body in its current position, m; they may be wider than the body."""
    shape = touch.rigid.thing.shape
    if (ends := shape.bounds) is None:
        points = shape.surface(0.0)[0]
        ends = points.min(axis=0), points.max(axis=0)
    corners = move_points(np.array(list(product(*zip(*ends, strict=True)))), *rigid_motion(touch))
    return corners.min(axis=0), corners.max(axis=0)


def _contact_facts(case: Case, touch: RigidBodyContact, mesh: DeformedMesh, u: Floats) -> dict[str, Any]:
    """Return the report entries of one contact, such as its smallest gap."""
    facets, look = _facets(case, touch, mesh), _current_distance(touch)
    x = _plane_components(case, mesh.points + u)
    nodes = np.setdiff1d(np.unique(facets), _fixed_nodes(case, mesh))
    gaps = np.full(len(x), np.inf)
    gaps[nodes] = _evaluate_distance(look, x[nodes])[0]
    corners = x[facets]
    size = np.linalg.norm(np.ptp(corners, axis=1), axis=1)
    near = facets[gaps[facets].min(axis=1) < size]  # facets farther away cannot touch between their nodes
    kind = FACETS[facets.shape[1]]
    triangles = np.array(kind.rim)[np.array(kind.halves)]
    convex = bool(touch.rigid.thing.shape.convex)
    try:
        deep, place = penetration_depth.find_deepest_point(
            look, x[near], partial(solid_forces.shape_functions, facets.shape[1]), triangles, convex
        )
    except ValueError as many:
        raise NoIndependentFormula(str(many)) from many
    found = {"least_gap": float(gaps[nodes].min(initial=np.inf)), "overlap": max(0.0, -deep), "facets": len(near)}
    return found | ({"deepest": place.tolist()} if deep < 0.0 else {})


def contact_forces(case: Case, touch: RigidBodyContact, mesh: DeformedMesh, u: Floats) -> tuple[Floats, float]:
    """Return nodal forces (n, 3), N, of one contact, and their uncertainty, N. Raises NoIndependentFormula."""
    facets, barrier = _facets(case, touch, mesh), barrier_of(case, touch, mesh.mesh)
    state = mesh.interactions.get(touch.name, InteractionState())
    barrier = barrier.stiffer(state.stiffening)
    of, N, A = _points(case, touch, mesh, facets)
    joined = state.added
    if joined is not None:
        of, N, A = _append_added_points((of, N, A), joined)
    x = _plane_components(case, np.einsum("pa,pai->pi", N, (mesh.points + u)[of]))
    g, n = _evaluate_distance(_current_distance(touch), x)
    if joined is not None:
        size = float(np.linalg.norm(np.ptp(mesh.points[facets], axis=1), axis=1).max())
        g, n = _gaps_to_planes(joined, touch, x, g, n, barrier.distance + CLOSE * size)
    p, slope = rigid_contact_forces.barrier_pressure(g, barrier.distance, barrier.stiffness, barrier.bend)
    p = np.where(A > 0.0, p, 0.0)
    push = _plane_components(case, (A * p)[:, None] * n)
    if touch.thing.friction:
        from softmark.interpreter.verification.friction_forces_check import friction_tractions

        spring = barrier.stiffness / barrier.distance
        push += A[:, None] * friction_tractions(
            touch, mesh, (of, N), x, _plane_components(case, n), p, spring, bool(case.planar)
        )
        slope = slope + spring
    found = np.zeros_like(u)
    np.add.at(found, of, N[:, :, None] * push[:, None, :])
    size = float(np.abs(mesh.points).max(initial=0.0)) + float(np.abs(u).max(initial=0.0))
    return found, 4.0 * EPS * size * float((A * slope).sum())


def _append_added_points(
    points: tuple[Ints, Floats, Floats], joined: AddedContactPoints
) -> tuple[Ints, Floats, Floats]:
    """Return the contact points together with those that the solver added, whose areas are taken from its state."""
    of, N, A = points
    own = joined.points
    width = max(of.shape[1], own.of.shape[1])

    def wide(rows: Floats | Ints) -> Any:
        return np.pad(rows, ((0, 0), (0, width - rows.shape[1])))

    of, N = (np.concatenate([wide(a), wide(b)]) for a, b in ((of, own.of), (N, own.shares)))
    return of, N, np.concatenate([A, own.A])


def _gaps_to_planes(
    joined: AddedContactPoints, touch: RigidBodyContact, x: Floats, g: Floats, n: Floats, near: float
) -> tuple[Floats, Floats]:
    """Return gaps, m, and normals, where added points use the gap to their tangent plane if they are near the body."""
    c, ends = (move_points(points, *rigid_motion(touch)) for points in (joined.c, joined.c + joined.n))
    new = slice(len(g) - len(c), None)
    g, n, own = g.copy(), n.copy(), ((x[new] - c) * (ends - c)).sum(axis=1)
    g[new], n[new] = np.where(np.abs(g[new]) < near, own, np.inf), ends - c
    return g, n


def _points(case: Case, touch: RigidBodyContact, mesh: DeformedMesh, facets: Ints) -> tuple[Ints, Floats, Floats]:
    """Return the contact points: nodes of their facets (p, a), shape functions (p, a) and areas (p,), m^2.

    Points inside facets are listed once for each facet that contains them.
    """
    kind, still = facets.shape[1], _fixed_nodes(case, mesh)
    if not (steps := facet_subdivisions(case, touch, mesh.points, facets)):
        triangles = facets[:, np.array(FACETS[kind].triangles)].reshape(-1, 3)
        area = rigid_contact_forces.nodal_areas(mesh.points, triangles, case.depth)
        nodes = np.setdiff1d(np.flatnonzero(area > 0.0), still)
        return nodes[:, None], np.ones((len(nodes), 1)), area[nodes]
    xi = FACETS[kind].lattice(steps)
    N, split = (
        solid_forces.shape_functions(kind, xi),
        rigid_contact_forces.facet_lattice_triangles(FACETS[kind].square, steps),
    )
    X = np.einsum("la,fai->fli", N, mesh.points[facets]).reshape(-1, 3)
    each = (len(xi) * np.arange(len(facets))[:, None, None] + split).reshape(-1, 3)
    free = (np.abs(N) > ROUND) @ ~np.isin(facets, still).T
    A = rigid_contact_forces.nodal_areas(X, each, case.depth) * free.T.ravel()
    return np.repeat(facets, len(xi), axis=0), np.tile(N, (len(facets), 1)), A


def _fixed_nodes(case: Case, mesh: DeformedMesh) -> Ints:
    """Return the numbers of nodes that supports fix completely, which take no part in contact."""
    found: Ints = np.flatnonzero(held_components(case, mesh).all(axis=1))
    return found


def _plane_components(case: Case, x: Floats) -> Floats:
    """Return vectors x (n, 3) with only their in-plane components if the body is plane."""
    return x * (1.0, 1.0, 0.0) if case.planar else x


def _evaluate_distance(look: rigid_contact_forces.Distance, x: Floats) -> tuple[Floats, Floats]:
    try:
        return look(x)
    except ValueError as many:
        raise NoIndependentFormula(str(many)) from many


def _facets(case: Case, touch: RigidBodyContact, mesh: DeformedMesh) -> Ints:
    """Return the facets that may touch (f, k): selected ones with at least one free node.

    Raises NoIndependentFormula.
    """
    where, facets = touch.thing.where, np.asarray(mesh.mesh.facets)
    if where is not EVERYWHERE:
        swept = select_facets(where, case, mesh.mesh)
        facets = np.concatenate([np.concatenate([whole, parts[0]]) for whole, parts, _ in swept])
        facets = np.unique(facets, axis=0)
    if case.planar:
        X = mesh.points[facets]
        way = np.cross(X[:, 1] - X[:, 0], X[:, 2] - X[:, 0])
        facets = facets[np.abs(way[:, 2]) < 0.5 * np.linalg.norm(way, axis=1)]
    if case.depth:  # a body of revolution continues across the axis
        facets = facets[mesh.points[facets, 0].sum(axis=1) > EPS * np.abs(mesh.points).sum()]
    named = held_components(replace(case, supports=case.named_supports), mesh).any(axis=1)
    free: Ints = facets[np.logical_not(np.asarray(named)[facets].all(axis=1))]
    return free


# ------------------------------------------------------------------ rigid bodies


def _current_distance(touch: RigidBodyContact) -> rigid_contact_forces.Distance:
    """Return the distance function of a rigid body in its current position: rotated, then shifted.

    Raises NoIndependentFormula.
    """
    return rigid_contact_forces.moved_distance(_shape_distance(touch.rigid.thing.shape), *rigid_motion(touch))


def _shape_distance(shape: Shape) -> rigid_contact_forces.Distance:
    """Return the distance function of a shape at its declared position. Raises NoIndependentFormula."""
    make = next((make for cls, make in DISTANCES.items() if isinstance(shape, cls)), None)
    if make is None:
        raise NoIndependentFormula(f"no independent distance formula is available for the shape {type(shape).__name__}")
    found: rigid_contact_forces.Distance = make(shape)
    return found


def _half_space_distance(shape: Any) -> rigid_contact_forces.Distance:
    return rigid_contact_forces.half_space_distance(shape.origin, shape.normal)


def _box_distance(shape: Any) -> rigid_contact_forces.Distance:
    high = np.array(shape.origin) + np.array(shape.size)
    return rigid_contact_forces.box_distance(shape.origin, high, getattr(shape, "rounding", 0.0))


def _cylinder_distance(shape: Any) -> rigid_contact_forces.Distance:
    s, r, h = getattr(shape, "inner", 0.0), shape.radius, shape.length
    return _revolved_profile_distance(shape, [(s, 0.0), (r, 0.0), (r, h), (s, h)])


def _punch_distance(shape: Any) -> rigid_contact_forces.Distance:
    q, r, h = shape.rounding, shape.radius, shape.length
    return _revolved_profile_distance(shape, [(0.0, q), (r - q, q), (r - q, h - q), (0.0, h - q)], q)


def _rounded_cone_distance(shape: Any) -> rigid_contact_forces.Distance:
    q, h = shape.rounding, shape.length - shape.rounding
    return _revolved_profile_distance(shape, [(0.0, q), (np.tan(0.5 * shape.angle) * (h - q), h), (0.0, h)], q)


def _cone_distance(shape: Any) -> rigid_contact_forces.Distance:
    end = [(shape.end, shape.length)] if shape.end else []
    return _revolved_profile_distance(shape, [(0.0, 0.0), (shape.radius, 0.0), *end, (0.0, shape.length)])


def _revolved_profile_distance(shape: Any, corners: Any, rounding: float = 0.0) -> rigid_contact_forces.Distance:
    return rigid_contact_forces.revolved_distance(
        rigid_contact_forces.polygon_distance(corners, rounding, mirrored=True), shape.origin, shape.axis
    )


def _extrusion_distance(shape: Any) -> rigid_contact_forces.Distance:
    section = rigid_contact_forces.polygon_distance(shape.corners)
    return rigid_contact_forces.prism_distance(section, ORDERS[shape.along], shape.base, shape.base + shape.height)


def _closed_surface_distance(shape: Any) -> rigid_contact_forces.Distance:
    return rigid_contact_forces.closed_surface_distance(*shape.surface(0.0))


DISTANCES: Mapping[type, Callable[[Any], rigid_contact_forces.Distance]] = {
    HalfSpace: _half_space_distance,
    Sphere: lambda shape: rigid_contact_forces.ball_distance(shape.origin, shape.radius),
    SphericalShell: lambda shape: rigid_contact_forces.hollow_ball_distance(shape.origin, shape.radius, shape.inner),
    Box: _box_distance,
    RoundedBox: _box_distance,
    Cylinder: _cylinder_distance,
    Tube: _cylinder_distance,
    Cone: _cone_distance,
    Revolved: lambda shape: _revolved_profile_distance(shape, shape.outline),
    Punch: _punch_distance,
    RoundedCone: _rounded_cone_distance,
    RoundedRevolution: lambda shape: _revolved_profile_distance(shape, shape.core, shape.rounding),
    Extruded: _extrusion_distance,
    SurfaceBody: _closed_surface_distance,
    MeshFile: _closed_surface_distance,
}
