"""Independent forces between parts of a body, computed as for foundations (foundation_forces.py)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.models.shared.rigid_contact_setup import size_of
from softmark.interpreter.models.shared.self_contact_setup import create_pair_energies
from softmark.interpreter.verification.facet_sweep import sample_facets, select_facets
from softmark.interpreter.verification.unverified_model_error import NoIndependentFormula
from softmark.interpreter.vocabulary.self_contact_words import Tied
from softmark.solvers.contact.contact_surface import number_mesh_pieces
from softmark.solvers.elements.boundary_facets import FACETS
from softmark.solvers.independent_forces import solid_forces

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.prepared_model import DeformedMesh
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.independent_forces.solid_forces import Floats, Ints

AGREE = 0.02  # relative to the forces of a pair: edges that are kept from edges are 0.6 % of them in shipped scenes
LITTLE = 1e-6  # relative to the stiffness of a barrier: pressures that are none
ASIDE = 1e-3  # relative to the reach of a tie: how straight across a point must lie
FACING = -0.5  # of two unit normals: surfaces that look at each other
NEWTON = 6  # iterations for local coordinates of a point on a facet


def pair_forces(case: Case, mesh: DeformedMesh, u: Floats) -> dict[str, Floats]:
    """Return nodal forces (n, 3), N, of every self-contact and tie, by name. Raises NoIndependentFormula.

    The solver's own forces are returned if they agree with independent ones within the accuracy of the latter. That is
    limited because a barrier also acts weakly between edges, and because ties are sampled here, while the solver cuts
    polygons.
    """
    found = {}
    each: dict[str, Any] = create_pair_energies(case, mesh.mesh)
    for name, pair in each.items():
        g = np.zeros(u.size)
        if isinstance(declared := next(p.thing for p in case.pairs if p.name == name), Tied):
            pair.add_gradient(u.ravel(), g)
            again, little = _tie_forces(case, declared, pair, mesh, u), 0.0
        else:
            pressing = pair.pressing if pair.has_friction else pair
            pressing.add_gradient(u.ravel(), g)
            again, little = (
                _barrier_forces(pressing, u.ravel()),
                LITTLE * pressing.stiffness * float(pressing.skin.A.sum()),
            )
        apart = float(np.linalg.norm(g + again.ravel()))
        if apart > AGREE * float(np.linalg.norm(g)) + little:
            off = apart / float(np.linalg.norm(g))
            raise NoIndependentFormula(
                f"the forces of `{name}` differ by {off:.1e} (relative) from those of independent formulas"
            )
        if pair.has_friction:
            g -= _friction_forces(name, pair, mesh, u.ravel())
        found[name] = -g.reshape(-1, 3)
    return found


def _barrier_forces(pressing: Any, u: Floats) -> Floats:
    """Return nodal forces (3 n,), N, of a contact barrier, from samples on both surfaces, each with half its area."""
    from softmark.solvers.independent_forces import deformable_friction_forces

    skin = pressing.skin
    V = skin.places(u)
    p, x = V[skin.corners :], V[: skin.corners]
    pairs = deformable_friction_forces.find_candidate_pairs(p, x, skin.faces, pressing.distance)
    pairs = pairs[_possible_contact_pairs(skin, pairs[:, 0], pairs[:, 1], pressing.alone)]
    f, back = deformable_friction_forces.contact_forces(
        p, x, skin.faces, pairs, 0.5 * skin.A, pressing.distance, pressing.stiffness
    )
    found: Floats = skin.M.T @ np.concatenate([back, f]).ravel()
    return found


def _tie_forces(case: Case, tie: Any, pair: Any, mesh: DeformedMesh, u: Floats) -> Floats:
    """Return nodal forces (n, 3), N, of a tie: springs from points of one surface straight across to the other."""
    from softmark.interpreter.vocabulary.self_contact_words import REACH

    swept = select_facets(tie.where, case, mesh.mesh)
    facets = np.unique(np.concatenate([np.concatenate([whole, parts[0]]) for whole, parts, _ in swept]), axis=0)
    of, reach = number_mesh_pieces(mesh.mesh), tie.reach or REACH * size_of(case, mesh.mesh)
    piece, found = of[facets[:, 0]], np.zeros_like(u)
    for a in range(int(of.max())):
        one, other = facets[piece == a], facets[piece > a]
        if len(one) and len(other):
            found += _spring_forces(mesh.points, one, other, u, pair.stiffness, reach, case.depth)
    return found


def _spring_forces(points: Floats, one: Ints, other: Ints, u: Floats, k: float, reach: float, depth: float) -> Floats:
    """Return nodal forces (n, 3), N, of springs of stiffness k, Pa/m, between facets `one` (f, a) and `other`.

    Springs connect points of `one` to their projections on facets of `other` within the distance `reach`, m.
    """
    from softmark.solvers.independent_forces import deformable_friction_forces

    found, kind = np.zeros_like(u), other.shape[1]
    split = np.array(FACETS[kind].triangles)
    triangles, home = other[:, split].reshape(-1, 3), np.repeat(np.arange(len(other)), len(split))
    for facets, xi, w in sample_facets(one):
        N, dN = solid_forces.shape_functions(facets.shape[1], xi), solid_forces.shape_derivatives(facets.shape[1], xi)
        X = np.einsum("pa,pai->pi", N, points[facets])
        n = np.cross(*np.einsum("pai,paj->jpi", points[facets], dN))
        A = w * np.linalg.norm(n, axis=1)
        n /= np.linalg.norm(n, axis=1, keepdims=True)
        A = A * (2.0 * np.pi * X[:, 0] / depth if depth else 1.0)
        pairs = deformable_friction_forces.find_candidate_pairs(X, points, triangles, reach)
        foot = deformable_friction_forces.closest_points(X[pairs[:, 0]], points[triangles[pairs[:, 1]]])
        off, m = X[pairs[:, 0]] - foot, n[pairs[:, 0]]
        height = (off * m).sum(axis=1)
        aside = np.linalg.norm(off - height[:, None] * m, axis=1)
        facing = (deformable_friction_forces.normals(points[triangles[pairs[:, 1]]]) * m).sum(axis=1) < FACING
        good = np.flatnonzero((np.abs(height) < reach) & (aside < ASIDE * reach) & facing)
        good = good[np.unique(pairs[good, 0], return_index=True)[1]]  # on a side of two triangles either will do
        at, corners = pairs[good, 0], other[home[pairs[good, 1]]]
        M = solid_forces.shape_functions(kind, _local_coordinates(points[corners], foot[good]))
        apart = np.einsum("pa,pai->pi", N[at], u[facets[at]]) - np.einsum("pa,pai->pi", M, u[corners])
        f = k * A[at, None] * apart
        np.add.at(found, facets[at], -N[at][:, :, None] * f[:, None])
        np.add.at(found, corners, M[:, :, None] * f[:, None])
    return found


def _local_coordinates(corners: Floats, X: Floats) -> Floats:
    """Return local coordinates (p, 2) of points X (p, 3), m, on facets with nodes `corners` (p, a, 3), m.

    They are found by Gauss-Newton steps.
    """
    kind = corners.shape[1]
    xi = np.tile(solid_forces.node_positions(kind).mean(axis=0), (len(X), 1))
    for _ in range(NEWTON):
        left = X - np.einsum("pa,pai->pi", solid_forces.shape_functions(kind, xi), corners)
        J = np.einsum("pai,paj->pij", corners, solid_forces.shape_derivatives(kind, xi))
        square = np.einsum("pij,pik->pjk", J, J)
        xi = xi + np.linalg.solve(square, np.einsum("pij,pi->pj", J, left)[:, :, None])[:, :, 0]
    return xi


def _friction_forces(name: str, pair: Any, mesh: DeformedMesh, u: Floats) -> Floats:
    """Return independent nodal friction forces (3 n,), N, from the friction springs that a state stores."""
    from softmark.solvers.independent_forces import deformable_friction_forces

    state, skin, pressing = mesh.interactions.get(name), pair.skin, pair.pressing
    if state is None or (own := state.friction) is None or own.anchors.s.shape[0] != skin.points:
        raise NoIndependentFormula(f"the friction history of `{name}` is not known")
    which = np.flatnonzero(own.anchors.n.any(axis=1))
    V = skin.places(u)
    p, x = V[skin.corners + which], V[: skin.corners]
    pairs = deformable_friction_forces.find_candidate_pairs(p, x, skin.faces, pressing.distance)
    pairs = pairs[_possible_contact_pairs(skin, which[pairs[:, 0]], pairs[:, 1], pressing.alone)]
    area = 0.5 * skin.A[which]
    N = area[:, None] * deformable_friction_forces.contact_pressures(
        p, x, skin.faces, pairs, pressing.distance, pressing.stiffness
    )
    pull = (area * pair.spring)[:, None] * own.anchors.s[which]
    n = deformable_friction_forces.normals(x[skin.faces[skin.own[which]]])
    f, on = deformable_friction_forces.friction_forces(
        p, x, skin.faces, pairs, pull, pair.friction * np.abs((n * N).sum(axis=1))
    )
    each = np.zeros_like(V)
    each[: skin.corners] = on
    each[skin.corners + which] = f
    found: Floats = skin.M.T @ each.ravel()
    return found


def _possible_contact_pairs(skin: Any, samples: Any, faces: Any, alone: bool) -> Any:
    """Return a mask of the pairs of samples and faces (c,) that may be in contact.

    With `alone`, sample and face must be on different parts of the body; otherwise their facets must share no corner.
    """
    if alone:
        return skin.patch[skin.corners + samples] != skin.patch[skin.faces[faces, 0]]
    mine, its = skin.of[samples], skin.home[faces]
    corners = [set(skin.faces[skin.home == facet].ravel().tolist()) for facet in range(int(skin.home.max()) + 1)]
    return np.array([not corners[a] & corners[b] for a, b in zip(mine.tolist(), its.tolist(), strict=True)], bool)
