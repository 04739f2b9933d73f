"""Comparison of the stress at the surface of a body with the applied traction.

Equilibrium fixes sigma n on every face: the applied traction on a loaded face, zero on a free one. A mesh that is
coarser than a loaded patch misses the patch, and a finer space over the same cells may miss it as well. Left out are
components in which a support holds the point, faces on foundations or in contact, moments on faces, and places where a
load begins or ends, since the traction is not known there or has two values.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.metrics.probe_samples import ProbeSamples
from softmark.interpreter.metrics.tensor_metrics import TensorMetric
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.interpreter.models.shared.loaded_surface import surface_of
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.verification.stress_singularities import facet_normals, held_directions
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.records import dataclass
from softmark.solvers.mesh.element_interpolation import locate_points
from softmark.solvers.mesh.plane_boundary import is_on_border
from softmark.solvers.stress_recovery.sampling_point_stress import SYMMETRIC
from softmark.solvers.stress_recovery.stress_field import Stresses
from softmark.solvers.stress_recovery.stress_measures import Tensors

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from softmark.interpreter.metrics.probe_samples import ProbePlace
    from softmark.solvers.mesh.mesh import Mesh

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]
    Bools = NDArray[np.bool_]

AT = 1e-9  # a shape function below it is zero
SMOOTH = 0.7  # cosine: facets that meet at a smaller angle are one smooth face
BESIDE = 1e-4  # relative to the way to a corner of a facet: the distance at which loads beside a point are looked up
FACES = 3  # facets of different normals at one point: those of a corner
SAME = 1e-6  # of tractions: smaller differences are rounding
ROUNDS = 20  # of corrections at edges and corners, where several faces have tractions
NEAREST = 12  # candidate facets for the one nearest to a point outside the mesh


@dataclass(frozen=True)
class TractionMismatch:
    """Largest mismatch between the stress of a model at the surface and the applied traction.

    `error` is the possible error of the metric, in its unit; `at` (3,) the place, m. `found` is the traction of the
    stress and `applied` the applied one, Pa: normal components, or tangential ones if `along` is false. `loads` are the
    names of the loads there.
    """

    error: float
    at: Floats
    found: float
    applied: float
    along: bool
    loads: tuple[str, ...]


@dataclass(frozen=True)
class Boundary:
    """Faces of a body's surface at n points, up to FACES at each point, with the known parts of their tractions.

    `normals` (n, f, 3) are zero where a point has fewer faces. `tractions` (n, f, 3), Pa, are per undeformed area, and
    `pressures` (n, f), Pa, those of follower loads. `free` (n, f, 3) is a mask of components without support or
    contact.
    """

    normals: Floats
    tractions: Floats
    pressures: Floats
    free: Bools
    loads: Sequence[tuple[str, ...]]


def mismatch(
    metric: TensorMetric, case: Case, place: ProbePlace, stress: Any, at_rest: Any = None
) -> TractionMismatch | None:
    """Return the mismatch between stress and applied traction at a metric's points; None if no traction is known."""
    if metric.measured_from is not None or isinstance(case.analysis, Dynamic) or case.pairs or case.beds:
        return None
    if not isinstance(stress, Stresses) or stress.state.mesh.facets is None:
        return None
    if any(load.thing.action.balanced for load in case.loads):
        return None
    mesh = stress.state.mesh
    samples = _add_points_on_loaded_patches(metric, case, mesh, place, metric.samples(place, stress))
    points, facets, normals = _points_on_faces(case, mesh, samples.X)
    if not len(points):
        return None
    sides = samples.sides(stress)
    single = np.bincount(sides.rows, minlength=len(samples.X)) == 1
    chosen = np.unique(points[single[points]])
    if not len(chosen):
        return None
    boundary = _boundary(case, mesh, samples.X, chosen, (points, facets, normals), at_rest)
    row = np.searchsorted(sides.rows, chosen)
    tensors = sides.tensors
    here = Tensors(tensors.six[row], tensors.H[row], tensors.small)
    corrected, worst = _nearest_admissible_stresses(here, boundary)
    six, H = tensors.six.copy(), tensors.H.copy()
    six[row] = corrected
    change = corrected - here.six
    H[row] += _displacement_gradient_change(case, sides.materials[row], change, stress)
    try:
        before, after = metric.values(tensors), metric.values(Tensors(six, H, tensors.small))
    except (Undefined, np.linalg.LinAlgError):
        return None
    shares = sides.divide_among_rows(samples.shares)
    own, value = metric.reduce_values(before, shares)
    _, other = metric.reduce_values(after, shares)
    if not (np.isfinite(value) and np.isfinite(other)):
        return None
    size = metric.norms(Tensors(change, H[row] - tensors.H[row], True))
    where = np.searchsorted(row, own)
    whole = float(shares[row] @ size) if metric.over == "mean" else (
        float(size[where]) if where < len(row) and row[where] == own else 0.0
    )  # fmt: skip
    i = int(np.argmax(np.abs(after - before)[row]))
    return TractionMismatch(max(abs(other - value), whole), samples.X[chosen[i]], *worst(i))


def _add_points_on_loaded_patches(
    metric: TensorMetric, case: Case, mesh: Mesh, place: ProbePlace, samples: ProbeSamples
) -> ProbeSamples:
    """Return the samples of a surface or volume, with one more point on every loaded part of a facet."""
    domain = place.domain
    if metric.over == "mean" or domain is None or domain.nodes == "none":
        return samples
    found = [samples.X]
    for load in case.loads:
        if load.thing.action.surface is None:
            continue
        part = surface_of(case, load, load.thing.action.surface, mesh)
        some = part.w > 0.0
        if not some.any():
            continue
        nodes, w = part.nodes[some], part.w[some]
        X = np.einsum("pa,pai->pi", mesh.element.facet.shape(part.xi[some]), mesh.points[nodes])
        _, which = np.unique(nodes, axis=0, return_inverse=True)
        size = np.bincount(which.ravel(), w)
        middles = np.stack([np.bincount(which.ravel(), w * x) / size for x in X.T], axis=1)
        found.append(middles[domain.holds(middles)])
    X = np.concatenate(found)
    shares = np.concatenate([samples.shares, np.zeros(len(X) - len(samples.X))])
    return ProbeSamples(X, shares, samples.materials)


def _displacement_gradient_change(case: Case, materials: Ints, change: Floats, stress: Stresses) -> Floats:
    """Return the change of the displacement gradient (n, 9) for a change of stress (n, 6), Pa, by Hooke's law."""
    found = np.zeros((len(change), 9))
    for number in np.unique(materials).tolist():
        material = case.typical[number] if number < len(case.typical) else case.typical[0]
        here = materials == number
        G, nu = material.shear_modulus, min(material.poisson, 0.5)
        S = Tensors(change[here], found[here], True).cauchy
        trace = np.trace(S, axis1=1, axis2=2)[:, None, None]
        found[here] = ((S - nu / (1.0 + nu) * trace * np.eye(3)) / (2.0 * G)).reshape(-1, 9)
    return found


# ------------------------------------------------------------------ faces at points


def _points_on_faces(case: Case, mesh: Mesh, X: Floats) -> tuple[Ints, Ints, Floats]:
    """Return pairs (p,) of a point X (n, 3), m, and a boundary facet that contains it, with outward normals (p, 3)."""
    from scipy import sparse

    facets = mesh.facets
    which = np.arange(len(facets))
    if case.planar:
        which = np.flatnonzero(is_on_border(mesh.points, facets, bool(case.depth)))
    own = facets[which]
    outer = np.zeros(len(mesh.points), dtype=np.bool_)
    outer[own] = True
    where = locate_points(mesh, X)
    counts = np.abs(where.N) > AT
    on = np.flatnonzero(((outer[where.nodes] | ~counts).all(axis=1)) & (where.outside == 0.0))
    normals = _smooth_normals(mesh, own)
    points, rows = np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    if len(on):
        n = len(mesh.points)
        point, column = np.nonzero(counts[on])
        of_points = sparse.csr_array((np.ones(len(point)), (point, where.nodes[on][point, column])), shape=(len(on), n))
        touched = np.repeat(np.arange(len(own)), own.shape[1])
        of_facets = sparse.csr_array((np.ones(own.size), (touched, own.ravel())), shape=(len(own), n))
        of_facets.data[:] = 1.0
        both = (of_points @ of_facets.T).tocoo()
        full = both.data >= counts[on].sum(axis=1)[both.row] - 0.5
        points, rows = on[both.row[full]], both.col[full].astype(np.int64)
    known = _interpolate_normals(own, normals, points, rows, where.nodes, where.N)
    beyond = np.flatnonzero(where.outside > 0.0)
    if len(beyond):
        nearest, N = _nearest_facets(mesh, own, X[beyond])
        points, rows = np.concatenate([points, beyond]), np.concatenate([rows, nearest])
        known = np.concatenate([known, np.einsum("pa,pai->pi", N, normals[nearest])])
    length = np.linalg.norm(known, axis=1, keepdims=True)
    order = np.argsort(points, kind="stable")
    unit: Floats = known / np.where(length > 0.0, length, 1.0)
    return points[order], which[rows[order]], unit[order]


def _interpolate_normals(own: Ints, normals: Floats, points: Ints, rows: Ints, nodes: Ints, N: Floats) -> Floats:
    """Interpolate the normals at the nodes of facets (f, a, 3) to points on the facets (p, 3)."""
    same = own[rows][:, :, None] == nodes[points][:, None, :]  # (p, a, b)
    share = np.where(same, N[points][:, None, :], 0.0).sum(axis=2)
    found: Floats = np.einsum("pa,pai->pi", share, normals[rows])
    return found


def _smooth_normals(mesh: Mesh, own: Ints) -> Floats:
    """Return unit normals of facets at their nodes (f, a, 3): means over facets that meet smoothly at a node."""
    own_normals = facet_normals(mesh, own)
    flat, node = own_normals.reshape(-1, 3), own.ravel()
    order = np.argsort(node, kind="stable")
    starts = np.flatnonzero(np.concatenate([[True], np.diff(node[order]) > 0]))
    sizes = np.diff(np.concatenate([starts, [len(order)]]))
    found = np.empty_like(flat)
    for size in np.unique(sizes).tolist():  # nodes with as many facets around them at a time
        rows = order[starts[sizes == size][:, None] + np.arange(size)]  # (g, size)
        n = flat[rows]
        near = np.einsum("gai,gbi->gab", n, n) > SMOOTH
        mean = np.einsum("gab,gbi->gai", near.astype(np.float64), n)
        found[rows] = mean / np.linalg.norm(mean, axis=2, keepdims=True)
    return found.reshape(own_normals.shape)


def _nearest_facets(mesh: Mesh, own: Ints, X: Floats) -> tuple[Ints, Floats]:
    """Return the facet (n,) nearest to each point X (n, 3), m, outside a mesh, and weights of its nodes (n, a)."""
    from scipy.spatial import cKDTree

    corners = mesh.element.facet.corners
    middles = mesh.points[own[:, :corners]].mean(axis=1)
    _, near = cKDTree(middles).query(X, k=min(NEAREST, len(own)))
    near = near.reshape(len(X), -1)
    normals = facet_normals(mesh, own)[:, :corners].mean(axis=1)
    height = np.abs(np.einsum("nki,nki->nk", X[:, None] - middles[near], normals[near]))
    across = np.linalg.norm(X[:, None] - middles[near], axis=2)
    chosen = near[np.arange(len(X)), (across + height).argmin(axis=1)]
    away = np.linalg.norm(X[:, None] - mesh.points[own[chosen][:, :corners]], axis=2)
    shares = np.zeros((len(X), own.shape[1]))
    shares[:, :corners] = 1.0 / np.maximum(away, 1e-12 * mesh.extent)
    return chosen, shares / shares.sum(axis=1, keepdims=True)


# ------------------------------------------------------------------ tractions


def _boundary(
    case: Case, mesh: Mesh, X: Floats, chosen: Ints, pairs: tuple[Ints, Ints, Floats], at_rest: Any
) -> Boundary:
    """Return normals, tractions and free components of the faces at the chosen points (n,) of X."""
    points, facets, normals = pairs
    n = len(chosen)
    found = Boundary(np.zeros((n, FACES, 3)), np.zeros((n, FACES, 3)), np.zeros((n, FACES)),
                     np.zeros((n, FACES, 3), dtype=np.bool_), [()] * n)  # fmt: skip
    held = _held_components_at_points(case, mesh, X[chosen]) | _contact_mask(at_rest, X[chosen])[:, None]
    acting = [_ActingLoad(case, load, mesh) for load in case.loads if load.thing.action.surface is not None]
    filled = np.zeros(n, dtype=np.int64)
    names: list[tuple[str, ...]] = [()] * n
    doubtful = np.zeros(n, dtype=np.bool_)
    for point, facet, normal in zip(points.tolist(), facets.tolist(), normals, strict=True):
        i = int(np.searchsorted(chosen, point))
        if i >= n or chosen[i] != point or doubtful[i] or not normal.any():
            continue
        total, pressure, own = np.zeros(3), 0.0, []
        for load in acting:
            if (acts := load.at(X[point], facet)) is None:
                doubtful[i] = True
                break
            if acts:
                own.append(load.name)
                t, p = load.traction(normal)
                total, pressure = total + t, pressure + p
        if doubtful[i]:
            continue
        k = _new_face_slot(found, i, int(filled[i]), normal, total, pressure)
        if k is None:  # the face is known already, or its traction contradicts the known one
            continue
        filled[i] = k + 1
        found.normals[i, k], found.tractions[i, k], found.pressures[i, k] = normal, total, pressure
        found.free[i, k] = ~held[i]
        names[i] = tuple(dict.fromkeys((*names[i], *own)))
    found.free[doubtful] = False
    return Boundary(found.normals, found.tractions, found.pressures, found.free, names)


def _new_face_slot(found: Boundary, i: int, filled: int, normal: Floats, total: Floats, pressure: float) -> int | None:
    """Return the slot for a new face of a point; None if the face is known already, or if no slot is left."""
    for k in range(filled):
        if found.normals[i, k] @ normal > 0.99:
            if not np.allclose(found.tractions[i, k], total) or found.pressures[i, k] != pressure:
                found.free[i] = False
            return None
    return filled if filled < FACES else None


def _held_components_at_points(case: Case, mesh: Mesh, X: Floats) -> Bools:
    """Return a mask of the components that supports hold at points X (n, 3), m, by the nodes around each point."""
    held = held_directions(case, mesh)
    where = locate_points(mesh, X)
    near = np.abs(where.N) > AT
    found: Bools = np.asarray((held[where.nodes] & near[:, :, None]).any(axis=1))
    return found


def _contact_mask(at_rest: Any, X: Floats) -> Bools:
    """Return a mask of the points X (n, 3), m, at which contact pressure acts (n,)."""
    found = np.zeros(len(X), dtype=np.bool_)
    for touch in getattr(at_rest, "touches", {}).values():
        field = getattr(touch, "field", None)
        pressed: Bools = np.ones_like(found) if field is None else np.asarray(field.pressures(X) > 0.0)
        found |= pressed
    return found


class _ActingLoad:
    """Load that acts on a part of the surface of a mesh."""

    def __init__(self, case: Case, load: Declared, mesh: Mesh) -> None:
        self.name, self.action, self._mesh = load.name, load.thing.action, mesh
        part = surface_of(case, load, self.action.where, mesh)
        self._number = {tuple(sorted(row)): f for f, row in enumerate(mesh.facets.tolist())}
        self._whole = {self._number[tuple(sorted(row))] for row in part.whole.tolist()}
        self._parts = {self._number[tuple(sorted(row))] for row in np.unique(part.selected_facets, axis=0).tolist()}

    def at(self, X: Floats, facet: int) -> bool | None:
        """Return whether the load acts on a facet at X (3,), m; None if that is unknown, or at the load's border."""
        if self.action.traction_on(np.array((1.0, 0.0, 0.0))) is None:
            return None if facet in self._parts else False
        if facet in self._whole:
            return True
        if facet not in self._parts:
            return False
        where = self.action.where
        if where.groups or any(border.plane is None for border in where.borders):
            return None
        corners = self._mesh.points[self._mesh.facets[facet][: self._mesh.element.facet.corners]]
        beside = X + BESIDE * (corners - X)
        held = np.broadcast_to(where.holds(*beside.T, self._mesh.extent), len(beside))
        return None if held.any() != held.all() else bool(held.all())

    def traction(self, normal: Floats) -> tuple[Floats, float]:
        """Return the traction per undeformed area (3,), Pa, on a face with a normal, and the follower pressure, Pa."""
        known: tuple[Floats, float] = self.action.traction_on(normal)
        return known


def _nearest_admissible_stresses(tensors: Tensors, known: Boundary) -> tuple[Floats, Any]:
    """Return the nearest stresses (n, 6), Pa, that satisfy known tractions, and a function to describe a mismatch."""
    S, normals = tensors.cauchy.copy(), known.normals
    n, wanted = normals.copy(), known.tractions - known.pressures[:, :, None] * normals
    if not tensors.small:
        F = tensors.F
        turned = np.linalg.det(F)[:, None, None] * np.einsum("nJi,nfJ->nfi", np.linalg.inv(F), normals)
        area = np.linalg.norm(turned, axis=2, keepdims=True)
        n = turned / np.where(area > 0.0, area, 1.0)
        wanted = known.tractions / np.where(area > 0.0, area, 1.0) - known.pressures[:, :, None] * n
    free = known.free & ~_conflicting_edge_points(n, wanted, known.free)[:, None, None]
    first = np.where(free, np.einsum("nij,nfj->nfi", S, n) - wanted, 0.0)
    acting = free.any(axis=2)
    for _ in range(ROUNDS if acting.sum(axis=1).max(initial=0) > 1 else 1):
        for f in range(FACES):
            r = np.where(free[:, f], np.einsum("nij,nj->ni", S, n[:, f]) - wanted[:, f], 0.0)
            along = (r * n[:, f]).sum(axis=1)[:, None, None]
            outer = np.einsum("ni,nj->nij", r, n[:, f])
            S -= outer + outer.swapaxes(1, 2) - along * np.einsum("ni,nj->nij", n[:, f], n[:, f])
    six = np.stack([S[:, i, j] for i, j in SYMMETRIC], axis=1)
    return six, partial(_worst_mismatch, tensors.cauchy, n, wanted, first, known.loads)


def _conflicting_edge_points(n: Floats, wanted: Floats, free: Bools) -> Bools:
    """Return a mask of the points (n,) on edges where no symmetric stress satisfies the tractions of both faces.

    An example is the edge between a sheared and a free face.
    """
    found = np.zeros(len(n), dtype=np.bool_)
    size = np.linalg.norm(wanted, axis=2).max(axis=1, initial=0.0)
    for a in range(FACES):
        for b in range(a):
            both = free[:, a].any(axis=1) & free[:, b].any(axis=1)
            across = np.einsum("ni,ni->n", n[:, a], wanted[:, b]) - np.einsum("ni,ni->n", n[:, b], wanted[:, a])
            found |= both & (np.abs(across) > SAME * size)
    return found


def _worst_mismatch(
    cauchy: Floats, n: Floats, wanted: Floats, r: Floats, loads: Sequence[tuple[str, ...]], i: int
) -> tuple[float, float, bool, tuple[str, ...]]:
    """Return the largest mismatch at point i: traction of the stress and applied one, Pa, whether normal, and loads."""
    f = int(np.linalg.norm(r[i], axis=1).argmax())
    found, normal = cauchy[i] @ n[i, f], n[i, f]
    along = abs(float(r[i, f] @ normal)) > 0.7 * float(np.linalg.norm(r[i, f]))
    if along:
        return float(found @ normal), float(wanted[i, f] @ normal), True, loads[i]
    across = [float(np.linalg.norm(t - (t @ normal) * normal)) for t in (found, wanted[i, f])]
    return across[0], across[1], False, loads[i]
