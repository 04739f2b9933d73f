"""Contact between deformable bodies, and self-contact: incremental potential contact (IPC) with the library ipctk.

The pressure is the derivative of a barrier energy of the distance between sample points on one surface and triangles of
the other. It is integrated over both surfaces, each with weight one half, so that a uniform pressure is transmitted
between meshes that do not match. A sample near several triangles counts each of them once, minus their common sides,
plus their common corners (Li et al. 2023, "Convergent incremental potential contact", arXiv:2307.15908, section 4).

A second, much weaker barrier between all vertices and triangles and between all edges prevents every other intersection
(Li et al. 2020, "Incremental potential contact", ACM Trans. Graph. 39:49). Newton steps end before any of these meet.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.contact.contact_surface import ContactSurface
from softmark.solvers.energies.energy import DynamicPatternEnergy, Floats, Ints

FAINT = 1e-3  # of the barrier pressure: keeps edges apart, which samples do not detect
PATIENCE = 1000  # steps of the conservative advance until two faces meet
LEAVES = 0.9  # of a gap: largest part that a step may use up
PARALLEL = 1e-14  # squared sine of the angle between edges with a zero mollified distance (Li et al. 2020, section 5.1)
HALF = 0.5  # weight of each surface: both are integrated over


class IpctkMissing(Exception):
    """Raised if the package ipctk is not installed."""


def import_ipctk() -> Any:
    """Return the package ipctk, with its messages off. Raises IpctkMissing.

    It uses one thread, so that sums do not depend on the order of threads.
    """
    try:
        import ipctk
    except ImportError as error:
        raise IpctkMissing(str(error)) from error
    ipctk.set_logger_level(ipctk.LoggerLevel.error)
    if ipctk.get_num_threads() != 1:
        ipctk.set_num_threads(1)
    return ipctk


@dataclass(frozen=True)
class IpcContact(DynamicPatternEnergy):
    """Barrier energy of contact between deformable surfaces: E = sum of A phi(d) over samples at distances d.

    There is no pressure beyond `distance` (m); below it the pressure is `stiffness` (Pa) times f(d) = (1 - s^2) (2 (1 -
    s^2) / s - 4 s ln s^2), s = d / distance, which is 4.3 at half the distance. If `alone` is True, no piece of the
    body has contact with itself. `thickness` (m) is that of a slice, or the circumference of the middle ring of an
    axisymmetric model. Contact results are reported for the nodes in the mask `reaction_nodes`, at rest at `X` (n, 3),
    m; without `X` no moments are reported.
    """

    skin: ContactSurface
    distance: float
    stiffness: float
    alone: bool = False
    thickness: float = 1.0
    reaction_nodes: Any = None  # nodes (n,) of all pieces but the first
    X: Any = None
    conservative: bool = True

    @cached_property
    def _cached_results(self) -> dict[str, Any]:
        """Cache of results for the last state."""
        return {}

    @cached_property
    def _length_unit(self) -> float:
        """Size of the surface, m, used as the unit of length in ipctk, whose tolerances are absolute."""
        return float(np.ptp(self.skin.X, axis=0).max())

    @cached_property
    def _face_collision_mesh(self) -> Any:
        """ipctk collision mesh of the faces, without samples; faces must not intersect."""
        skin = self.skin
        mesh = self._build_collision_mesh(skin.X[: skin.corners])
        if self.alone:
            mesh.can_collide = import_ipctk().make_vertex_patches_filter(skin.patch[: skin.corners].astype(np.int32))
        return mesh

    @cached_property
    def _sample_collision_mesh(self) -> Any:
        """ipctk collision mesh of the faces and the samples."""
        skin = self.skin
        mesh = self._build_collision_mesh(skin.X)
        which = skin.patch if self.alone else np.arange(len(skin.X)) >= skin.corners
        mesh.can_collide = import_ipctk().make_vertex_patches_filter(which.astype(np.int32))
        return mesh

    def _build_collision_mesh(self, X: Floats) -> Any:
        """Return an ipctk collision mesh of the faces, with vertices at X (v, d), m."""
        skin, kind = self.skin, np.int32
        faces = np.zeros((0, 3), dtype=kind) if skin.flat else skin.faces.astype(kind)
        each = (np.asfortranarray(own) for own in (X / self._length_unit, skin.edges.astype(kind), faces))
        return import_ipctk().CollisionMesh(*each)

    @cached_property
    def _neighbouring_facets(self) -> Any:
        """Sparse matrix (f, f), nonzero for pairs of mesh facets that share a corner of a face."""
        skin = self.skin
        n = 1 + int(max(skin.home.max(), skin.of.max(initial=0)))
        rows = (np.ones(skin.faces.size), (np.repeat(skin.home, skin.faces.shape[1]), skin.faces.ravel()))
        corners = sparse.csr_matrix(rows, shape=(n, skin.corners))
        return (corners @ corners.T).tocsr()

    @cached_property
    def _sample_barrier(self) -> Any:
        """ipctk barrier potential between samples and faces."""
        return import_ipctk().BarrierPotential(
            self._scaled_barrier_distance, HALF * self.stiffness * self._length_unit, True
        )

    @cached_property
    def _intersection_barrier(self) -> Any:
        """Weak ipctk barrier potential between all vertices, edges and faces; it only prevents intersections."""
        size = self._length_unit ** self.skin.X.shape[1]  # area times distance in units of ipctk
        return import_ipctk().BarrierPotential(
            self._scaled_barrier_distance, FAINT * self.thickness * self.stiffness * size, True
        )

    @property
    def _scaled_barrier_distance(self) -> float:
        """Barrier distance divided by the surface size."""
        return self.distance / self._length_unit

    # ------------------------------------------------------------------ collision candidates

    def _scaled_positions(self, x: Floats) -> tuple[Floats, Floats]:
        """Return positions of all points (v, d), and of the corners only, for ipctk.

        They have the length unit and the memory order that ipctk expects.
        """
        V = self.skin.places(x) / self._length_unit
        return np.asfortranarray(V), np.asfortranarray(V[: self.skin.corners])

    def _collisions_and_positions(self, x: Floats) -> tuple[Any, Any, Floats, Floats]:
        """Return the collisions of a state x: of samples, of faces, and the vertex positions for both.

        The result for the last state is cached.
        """
        if self._cached_results.get("x") is x:
            found: tuple[Any, Any, Floats, Floats] = self._cached_results["near"]
            return found
        V, corners = self._scaled_positions(x)
        self._cached_results.clear()
        pairs, self._cached_results["beside"] = self._sample_collisions(V)
        self._cached_results["x"], self._cached_results["near"] = x, (pairs, self._face_collisions(corners), V, corners)
        return self._collisions_and_positions(x)

    def nearby_sample_face_pairs(self, x: Floats) -> Ints:
        """Return pairs (p, 2) of a sample and a face near it in a state x.

        A sample is given by its row of the contact surface, a face by its number.
        """
        self._collisions_and_positions(x)
        found: Ints = self._cached_results["beside"]
        return found

    def _face_collisions(self, corners: Floats) -> Any:
        """Return the vertex-triangle and edge-edge collisions of faces at corner positions (c, d)."""
        ipc = import_ipctk()
        near = ipc.Candidates()
        near.build(self._face_collision_mesh, corners, self._scaled_barrier_distance)
        self._remove_parallel_edge_pairs(near, corners)
        guard = ipc.NormalCollisions()
        guard.use_area_weighting = True
        guard.build(near, self._face_collision_mesh, corners, self._scaled_barrier_distance)
        return guard

    def _remove_parallel_edge_pairs(self, near: Any, corners: Floats) -> None:
        """Remove pairs of parallel edges from the candidates `near`.

        Parallel edges meet first at a corner, and the pair with this corner is a candidate of its own.
        """
        each = list(near.ee_candidates)
        if not each:
            return
        ids = np.array([(c.edge0_id, c.edge1_id) for c in each])
        ends = corners[self._face_collision_mesh.edges[ids]]
        way = ends[:, :, 1] - ends[:, :, 0]
        across = np.sum(np.cross(way[:, 0], way[:, 1]) ** 2, axis=1)
        kept = across > PARALLEL * np.prod(np.sum(way**2, axis=2), axis=1)
        near.ee_candidates = [each[i] for i in np.flatnonzero(kept)]

    def _sample_collisions(self, V: Floats) -> tuple[Any, Ints]:
        """Return the collisions of samples at positions V (v, d) with faces, and pairs (p, 2) of sample and face.

        The collisions are with faces, edges and corners near a sample, and are weighted with the sample areas.
        """
        ipc, skin = import_ipctk(), self.skin
        near = ipc.Candidates()
        near.build(self._sample_collision_mesh, V, self._scaled_barrier_distance)
        name = "ev_candidates" if skin.flat else "fv_candidates"
        each = list(getattr(near, name))
        face = "edge_id" if skin.flat else "face_id"
        ids = np.array([(c.vertex_id, getattr(c, face)) for c in each], dtype=np.int64).reshape(-1, 2)
        wanted = ids[:, 0] >= skin.corners
        if not self.alone and wanted.any():
            own = ids[wanted]
            facets = skin.of[own[:, 0] - skin.corners], skin.home[own[:, 1]]
            wanted[wanted] = np.asarray(self._neighbouring_facets[facets]).ravel() == 0
        for other in ("vv_candidates", "ev_candidates", "ee_candidates", "fv_candidates"):
            setattr(near, other, [each[i] for i in np.flatnonzero(wanted)] if other == name else [])
        pairs = ipc.NormalCollisions()
        pairs.collision_set_type = ipc.NormalCollisions.CollisionSetType.IMPROVED_MAX_APPROX
        pairs.build(near, self._sample_collision_mesh, V, self._scaled_barrier_distance)
        edges, faces = self._sample_collision_mesh.edges, self._sample_collision_mesh.faces
        for pair in (pairs[i] for i in range(len(pairs))):
            pair.weight *= skin.A[max(pair.vertex_ids(edges, faces)) - skin.corners]
        return pairs, ids[wanted]

    # ------------------------------------------------------------------ energy

    def intersects(self, x: Floats) -> bool:
        """Return whether any two faces intersect in a state x."""
        return bool(import_ipctk().has_intersections(self._face_collision_mesh, self._scaled_positions(x)[1]))

    def least(self, x: Floats) -> float:
        """Return the least distance between two faces, m; infinity if it exceeds the barrier distance."""
        _, guard, _, corners = self._collisions_and_positions(x)
        return (
            self._length_unit * float(np.sqrt(guard.compute_minimum_distance(self._face_collision_mesh, corners)))
            if len(guard)
            else np.inf
        )

    def value(self, x: Floats) -> float:
        """Return the energy of the barrier, J; infinite if surfaces intersect."""
        if self.intersects(x):
            return np.inf
        pairs, guard, V, corners = self._collisions_and_positions(x)
        return float(
            self._sample_barrier(pairs, self._sample_collision_mesh, V)
            + self._intersection_barrier(guard, self._face_collision_mesh, corners)
        )

    def forces(self, x: Floats) -> Floats:
        """Return derivatives (v, d), N, of the energy by the positions of corners and samples.

        The result for the last state is cached.
        """
        pairs, guard, V, corners = self._collisions_and_positions(x)
        if "forces" in self._cached_results:
            known: Floats = self._cached_results["forces"]
            return known
        g = self._sample_barrier.gradient(pairs, self._sample_collision_mesh, V)
        g[: corners.size] += self._intersection_barrier.gradient(guard, self._face_collision_mesh, corners)
        found: Floats = np.asarray(g).reshape(V.shape) / self._length_unit
        self._cached_results["forces"] = found
        return found

    def stored(self, x: Floats) -> float:
        """Return the recoverable energy of a state x, J: all of the barrier energy."""
        return self.value(x)

    def samples_in_contact(self, x: Floats) -> NDArray[np.bool_]:
        """Return a mask (points,) of the samples in contact."""
        return np.asarray(self.forces(x)[self.skin.corners :].any(axis=1), dtype=np.bool_)

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add `scale` times the gradient of the energy, N, to g (dofs,): the negative contact forces on nodes."""
        f = self.skin.M.T @ self.forces(x).ravel()
        g[: len(f)] += scale * f

    def matrix(self, x: Floats, projected: bool = False) -> Any:
        """Return the Hessian d2E/dx2, sparse (dofs, dofs), N/m; positive semidefinite if `projected`."""
        pairs, guard, V, corners = self._collisions_and_positions(x)
        psd = import_ipctk().PSDProjectionMethod
        way = psd.CLAMP if projected else psd.NONE
        M = self.skin.M
        with (_without_negative_weights if projected else nullcontext)(pairs):
            H = M.T @ (self._sample_barrier.hessian(pairs, self._sample_collision_mesh, V, way) @ M)
        if len(guard):
            M = M[: corners.size]
            H = H + M.T @ (self._intersection_barrier.hessian(guard, self._face_collision_mesh, corners, way) @ M)
        H = H.tocsr() / self._length_unit**2
        H.resize((len(x), len(x)))  # pressure unknowns, if any, come last
        return H

    def sample_barrier_hessian(self, x: Floats) -> Any:
        """Return the Hessian of the sample barrier by the positions of corners and samples, sparse (d v, d v), N/m."""
        pairs, _, V, _ = self._collisions_and_positions(x)
        none = import_ipctk().PSDProjectionMethod.NONE
        return self._sample_barrier.hessian(pairs, self._sample_collision_mesh, V, none).tocsr() / self._length_unit**2

    def limit(self, x: Floats, d: Floats) -> float:
        """Return the largest fraction, at most 1, of a step d (dofs,) from x for which no two faces meet.

        No step uses up more than nine tenths of a distance between faces.
        """
        here, there = self._scaled_positions(x)[1], self._scaled_positions(x + d)[1]
        ipc = import_ipctk()
        near = ipc.Candidates()
        near.build(self._face_collision_mesh, here, there)
        self._remove_parallel_edge_pairs(near, here)
        ccd = ipc.AdditiveCCD(PATIENCE, LEAVES)
        return float(near.compute_collision_free_stepsize(self._face_collision_mesh, here, there, 0.0, ccd))

    def rounding(self, x: Floats) -> float:
        """Return the error of the contact forces due to rounding of positions, N."""
        size = float(np.abs(self.skin.X).max())
        return float(np.finfo(np.float64).eps * size * np.linalg.norm(self.matrix(x).data))


@contextmanager
def _without_negative_weights(pairs: Any) -> Iterator[None]:
    """Set negative weights of collision pairs to zero within a `with` block.

    The matrix assembled in the block is then positive semidefinite.
    """
    weights = [(i, pairs[i].weight) for i in range(len(pairs))]
    taken = [(i, weight) for i, weight in weights if weight < 0.0]
    for i, _ in taken:
        pairs[i].weight = 0.0
    yield
    for i, weight in taken:
        pairs[i].weight = weight
