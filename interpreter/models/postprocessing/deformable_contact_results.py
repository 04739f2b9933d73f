"""Results of a contact between deformable surfaces in a state, combined for both surfaces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.models.postprocessing.contact_results import (
    ContactPressureField,
    index_by_place,
    nodal_friction_results,
)
from softmark.interpreter.models.postprocessing.nodal_forces import force_at_nodes
from softmark.interpreter.models.shared.rigid_contact_setup import plane_modulus
from softmark.interpreter.results.reaction_results import ContactNumbers, Friction
from softmark.solvers.contact.closest_face_points import vectors_from_closest_points
from softmark.solvers.contact.contact_pressure_recovery import ContactPressure
from softmark.solvers.contact.deformable_friction import DeformableFriction
from softmark.solvers.contact.surface_separation import least_facing_distance

if TYPE_CHECKING:
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.contact.contact_surface import ContactSurface
    from softmark.solvers.contact.deformable_contact import IpcContact
    from softmark.solvers.contact.deformable_friction import TangentialCoupling
    from softmark.solvers.contact.interaction_state import FrictionState
    from softmark.solvers.energies.energy import Floats, Ints
    from softmark.solvers.mesh.mesh import Mesh

SIDES = 2  # two surfaces with equal area and equal force
NEAR = 12  # number of faces with the nearest centres among which the nearest face is searched
LEAST = 1e-300  # N, avoids division by zero


def contact_result(
    case: Case,
    contact: IpcContact | DeformableFriction,
    mesh: Mesh,
    x: Floats,
    u: Floats,
    own: FrictionState | None,
    force: Floats | None = None,
) -> ContactNumbers:
    """Return the result of a contact with nodes at x (n, 3), m, and displacements u (3 n,), m.

    `force` (n, 3), N, are the contact forces; by default those of this state. `own` is the history of friction; None
    without friction. Pressures follow from the nodal forces of both surfaces, as for a rigid body (`ContactPressure`).
    The area is half of the sum over both surfaces, unless a condition excludes the opposite one. The remaining gap is
    the mean distance of pressed samples.
    """
    sliding = contact if isinstance(contact, DeformableFriction) else DeformableFriction(contact, 0.0)
    hold, pressing, skin = sliding.tangential_coupling(u), sliding.pressing, contact.skin
    own_facets, n = np.unique(skin.of), _outward_normals(x, mesh.facets[np.unique(skin.of[hold.which])])
    facets, both = mesh.facets[own_facets], _reported_surface_count(skin, hold, own_facets)
    f = -np.einsum("ni,ni->n", force_at_nodes(pressing, u) if force is None else force, n)
    nodes, g, near = np.unique(facets), np.full(len(x), np.nan), None
    if pressing.alone:  # in self-contact, forces show where the surface is in contact
        g[nodes] = _gaps(skin, (mesh.points + u.reshape(-1, 3))[nodes], nodes, mesh, u)
        near = g < pressing.distance
    same = index_by_place(mesh.points) if case.planar else None
    pressed = ContactPressure(facets, x, f, g, plane_modulus(case), case.depth, same, near)
    left = float(hold.N @ hold.far / max(float(hold.N.sum()), LEAST))
    least: float | None = min(pressing.least(u), float(np.nanmin(g[nodes], initial=np.inf)))
    if least == np.inf:  # farther apart than the activation distance of the barrier
        least = _least_opposite_distance(skin, mesh, u)
    rubbing, rubbed = (None, {}) if own is None else _friction_result(sliding, hold, skin, u, own, len(x))
    field = ContactPressureField(mesh.points, nodes, pressed, rubbed, both)
    return ContactNumbers(pressed.area / both, pressed.largest, least, left, field, rubbing)


def _reported_surface_count(skin: ContactSurface, hold: TangentialCoupling, facets: Ints) -> int:
    """Return the number of reported surfaces: 1 if a condition excludes the opposite surface, otherwise 2."""
    there = np.isin(skin.home[hold.faces], facets)
    return SIDES if hold.N @ there >= 0.5 * hold.N.sum() else 1


def _outward_normals(x: Floats, facets: Ints) -> Floats:
    """Return outward unit normals (n, 3) at the nodes of a surface with positions x (n, 3), m.

    They are area-weighted means over the facets around each node.
    """
    c = x[facets[:, : 4 if facets.shape[1] in (4, 8, 9) else 3]]
    one, other = (c[:, 2] - c[:, 0], c[:, 3] - c[:, 1]) if c.shape[1] == 4 else (c[:, 1] - c[:, 0], c[:, 2] - c[:, 0])
    found = np.zeros_like(x)
    for column in facets.T:
        np.add.at(found, column, np.cross(one, other))
    size = np.linalg.norm(found, axis=1, keepdims=True)
    unit: Floats = np.divide(found, size, out=np.zeros_like(found), where=size > 0.0)
    return unit


def _gaps(skin: ContactSurface, places: Floats, nodes: Ints, mesh: Mesh, u: Floats) -> Floats:
    """Return the distances (m,), m, of nodes at `places` (m, 3), m, from the faces of other pieces."""
    from scipy.spatial import cKDTree

    from softmark.solvers.contact.contact_surface import number_mesh_pieces

    d, corners = skin.X.shape[1], skin.faces
    V = skin.places(u)[: skin.corners]
    of, piece = skin.patch[corners[:, 0]], number_mesh_pieces(mesh)[nodes]
    found = np.full(len(nodes), np.inf)
    for one in np.unique(piece):
        mine, others = np.flatnonzero(piece == one), np.flatnonzero(of != one)
        if not len(others):
            continue
        faces, p = V[corners[others]], places[mine, :d]
        k = min(NEAR, len(others))
        near = cKDTree(faces.mean(axis=1)).query(p, k=k)[1].reshape(len(mine), k)
        far = np.linalg.norm(vectors_from_closest_points(np.repeat(p, k, axis=0), faces[near.ravel()]), axis=1)
        found[mine] = far.reshape(len(mine), k).min(axis=1)
    return found


def _least_opposite_distance(skin: ContactSurface, mesh: Mesh, u: Floats) -> float | None:
    """Return the smallest distance across a fold or a slot, m; None if no parts of the surface face each other."""
    V, d = skin.places(u)[: skin.corners], skin.X.shape[1]
    c = (mesh.points + u.reshape(-1, 3))[mesh.facets[skin.home]]
    quads = mesh.facets.shape[1] in (4, 8, 9)
    n = np.cross(c[:, 2] - c[:, 0], c[:, 3] - c[:, 1]) if quads else np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0])
    n = n[:, :d] / np.maximum(np.linalg.norm(n[:, :d], axis=1, keepdims=True), LEAST)
    found = least_facing_distance(V, skin.faces, n)
    return None if found is None or not np.isfinite(found) else found


def _friction_result(
    contact: DeformableFriction, hold: TangentialCoupling, skin: ContactSurface, u: Floats, own: FrictionState, n: int
) -> tuple[Friction, dict[str, Floats]]:
    """Return the friction result, and the nodal slip and sticking state (n,), of a contact between two surfaces.

    Areas are half of the sum over both surfaces.
    """
    slides = hold.slip(u, contact.friction).slides
    area, whole = skin.A[hold.which] / SIDES, float(hold.N.sum())
    slid = float(own.slid[hold.which].max(initial=0.0))
    told = Friction(slid, float(hold.N[~slides].sum() / max(whole, LEAST)), float(area[~slides].sum()), own.now)
    rows = abs(skin.M[skin.X.shape[1] * skin.corners :: skin.X.shape[1], : 3 * n : 3])
    N, sticks = np.zeros((2, skin.points))
    N[hold.which], sticks[hold.which] = hold.N, np.where(slides, 0.0, hold.N)
    return told, nodal_friction_results(lambda values: rows.T @ values, skin.A, own.slid, N, sticks)
