"""Contact between deformable bodies, and self-contact: incremental potential contact (IPC) with the library ipctk.

The pressure comes from a barrier of the distance between samples on the facets of each surface and the triangles of
the other. It is integrated over both surfaces, half each, so that a uniform pressure is transmitted through meshes
that do not match. A sample over several triangles counts each of them once, minus their common sides, plus their
common corners (Li et al. 2023, "Convergent incremental potential contact", arXiv:2307.15908, section 4). A second,
faint barrier between all vertices and triangles and between all edges prevents any other intersection (Li et al. 2020,
"Incremental potential contact", ACM Trans. Graph. 39:49), and steps end before any of these would meet.
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

FAINT = 1e-3  # of the pressure of the barrier: what keeps edges from edges, which points do not see
PATIENCE = 1000  # steps of an advance until two faces meet, which are on the safe side
LEAVES = 0.9  # of a gap: the most that an advance takes of it
PARALLEL = 1e-14  # the square of a sine: edges whose mollified distance is nothing (Li et al. 2020, section 5.1)
HALF = 0.5  # of each surface: both are integrated over


class IpctkMissing(Exception):
    """Raised if the package ipctk is not installed."""


def import_ipctk() -> Any:
    """Return the package ipctk, silent and with one thread, so that sums are reproducible. Raises IpctkMissing."""
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
    """IPC energy E = sum of A phi(d) over samples: no pressure beyond a `distance` (m), `stiffness` (Pa) times f(d)
    below.

    f(d) = (1 - s^2) (2 (1 - s^2) / s - 4 s ln s^2), s = d / distance, is 4.3 at half the distance. `alone` excludes
    contact of a piece with itself. `thickness` (m) is that of a slice, or the circumference of the middle ring. Contact
    results are reported for the nodes `told`, at rest at `X` (n, 3), m; without `X` no moments are reported.
    """

    skin: ContactSurface
    distance: float
    stiffness: float
    alone: bool = False
    thickness: float = 1.0
    told: Any = None  # nodes (n,) of all pieces but the first
    X: Any = None
    conservative: bool = True

    @cached_property
    def _kept(self) -> dict[str, Any]:
        """Cache of results for the last state."""
        return {}

    @cached_property
    def _unit(self) -> float:
        """Size of the surface, m, used as the unit of length in ipctk, whose tolerances are absolute."""
        return float(np.ptp(self.skin.X, axis=0).max())

    @cached_property
    def _surface(self) -> Any:
        """Collision mesh of the faces only, which must not intersect."""
        skin = self.skin
        mesh = self._mesh(skin.X[: skin.corners])
        if self.alone:
            mesh.can_collide = import_ipctk().make_vertex_patches_filter(skin.patch[: skin.corners].astype(np.int32))
        return mesh

    @cached_property
    def _sampled(self) -> Any:
        """Collision mesh of the faces and the samples."""
        skin = self.skin
        mesh = self._mesh(skin.X)
        which = skin.patch if self.alone else np.arange(len(skin.X)) >= skin.corners
        mesh.can_collide = import_ipctk().make_vertex_patches_filter(which.astype(np.int32))
        return mesh

    def _mesh(self, X: Floats) -> Any:
        """Return an ipctk collision mesh of the points X and the faces."""
        skin, kind = self.skin, np.int32
        faces = np.zeros((0, 3), dtype=kind) if skin.flat else skin.faces.astype(kind)
        each = (np.asfortranarray(own) for own in (X / self._unit, skin.edges.astype(kind), faces))
        return import_ipctk().CollisionMesh(*each)

    @cached_property
    def _beside(self) -> Any:
        """Sparse matrix (f, f) of the mesh facets that share a corner of a face."""
        skin = self.skin
        n = 1 + int(max(skin.home.max(), skin.of.max(initial=0)))
        rows = (np.ones(skin.faces.size), (np.repeat(skin.home, skin.faces.shape[1]), skin.faces.ravel()))
        corners = sparse.csr_matrix(rows, shape=(n, skin.corners))
        return (corners @ corners.T).tocsr()

    @cached_property
    def _potential(self) -> Any:
        """Barrier potential of the samples."""
        return import_ipctk().BarrierPotential(self._reach, HALF * self.stiffness * self._unit, True)

    @cached_property
    def _faint(self) -> Any:
        """Faint barrier potential between all vertices, edges and faces."""
        size = self._unit ** self.skin.X.shape[1]  # of areas and the distance, in its units
        return import_ipctk().BarrierPotential(self._reach, FAINT * self.thickness * self.stiffness * size, True)

    @property
    def _reach(self) -> float:
        """Barrier distance in units of the surface size."""
        return self.distance / self._unit

    # ------------------------------------------------------------------ what is near what

    def _places(self, x: Floats) -> tuple[Floats, Floats]:
        """Return positions of all points, and of the corners only, in the units and memory order of ipctk."""
        V = self.skin.places(x) / self._unit
        return np.asfortranarray(V), np.asfortranarray(V[: self.skin.corners])

    def _near(self, x: Floats) -> tuple[Any, Any, Floats, Floats]:
        """Return collisions of samples and of faces with the positions of both; cached for the last state."""
        if self._kept.get("x") is x:
            found: tuple[Any, Any, Floats, Floats] = self._kept["near"]
            return found
        V, corners = self._places(x)
        self._kept.clear()
        pairs, self._kept["beside"] = self._pairs(V)
        self._kept["x"], self._kept["near"] = x, (pairs, self._guard(corners), V, corners)
        return self._near(x)

    def beside(self, x: Floats) -> Ints:
        """Return pairs (p, 2) of samples, by rows of the surface, and faces that may press on them in a state."""
        self._near(x)
        found: Ints = self._kept["beside"]
        return found

    def _guard(self, corners: Floats) -> Any:
        """Return the collisions of vertices with triangles and of edges with edges that are near each other."""
        ipc = import_ipctk()
        near = ipc.Candidates()
        near.build(self._surface, corners, self._reach)
        self._crossing(near, corners)
        guard = ipc.NormalCollisions()
        guard.use_area_weighting = True
        guard.build(near, self._surface, corners, self._reach)
        return guard

    def _crossing(self, near: Any, corners: Floats) -> None:
        """Remove pairs of parallel edges: these meet at a corner, which has a pair of its own."""
        each = list(near.ee_candidates)
        if not each:
            return
        ids = np.array([(c.edge0_id, c.edge1_id) for c in each])
        ends = corners[self._surface.edges[ids]]
        way = ends[:, :, 1] - ends[:, :, 0]
        across = np.sum(np.cross(way[:, 0], way[:, 1]) ** 2, axis=1)
        kept = across > PARALLEL * np.prod(np.sum(way**2, axis=2), axis=1)
        near.ee_candidates = [each[i] for i in np.flatnonzero(kept)]

    def _pairs(self, V: Floats) -> tuple[Any, Ints]:
        """Return collisions of samples with near faces, edges and corners, weighted with the sample areas, and pairs
        (p, 2).

        The pairs are numbers of samples and faces.
        """
        ipc, skin = import_ipctk(), self.skin
        near = ipc.Candidates()
        near.build(self._sampled, V, self._reach)
        name = "ev_candidates" if skin.flat else "fv_candidates"
        each = list(getattr(near, name))
        face = "edge_id" if skin.flat else "face_id"
        ids = np.array([(c.vertex_id, getattr(c, face)) for c in each], dtype=np.int64).reshape(-1, 2)
        wanted = ids[:, 0] >= skin.corners
        if not self.alone and wanted.any():
            own = ids[wanted]
            facets = skin.of[own[:, 0] - skin.corners], skin.home[own[:, 1]]
            wanted[wanted] = np.asarray(self._beside[facets]).ravel() == 0
        for other in ("vv_candidates", "ev_candidates", "ee_candidates", "fv_candidates"):
            setattr(near, other, [each[i] for i in np.flatnonzero(wanted)] if other == name else [])
        pairs = ipc.NormalCollisions()
        pairs.collision_set_type = ipc.NormalCollisions.CollisionSetType.IMPROVED_MAX_APPROX
        pairs.build(near, self._sampled, V, self._reach)
        edges, faces = self._sampled.edges, self._sampled.faces
        for pair in (pairs[i] for i in range(len(pairs))):
            pair.weight *= skin.A[max(pair.vertex_ids(edges, faces)) - skin.corners]
        return pairs, ids[wanted]

    # ------------------------------------------------------------------ energy

    def intersects(self, x: Floats) -> bool:
        """Return whether any two faces intersect."""
        return bool(import_ipctk().has_intersections(self._surface, self._places(x)[1]))

    def least(self, x: Floats) -> float:
        """Return the least distance between two faces, m, if below that of the barrier; else infinity."""
        _, guard, _, corners = self._near(x)
        return (
            self._unit * float(np.sqrt(guard.compute_minimum_distance(self._surface, corners)))
            if len(guard)
            else np.inf
        )

    def value(self, x: Floats) -> float:
        """Return the energy of the barrier, J; infinite if surfaces intersect."""
        if self.intersects(x):
            return np.inf
        pairs, guard, V, corners = self._near(x)
        return float(self._potential(pairs, self._sampled, V) + self._faint(guard, self._surface, corners))

    def forces(self, x: Floats) -> Floats:
        """Return derivatives of the energy by positions of corners and samples (v, d), N; cached for the last state."""
        pairs, guard, V, corners = self._near(x)
        if "forces" in self._kept:
            known: Floats = self._kept["forces"]
            return known
        g = self._potential.gradient(pairs, self._sampled, V)
        g[: corners.size] += self._faint.gradient(guard, self._surface, corners)
        found: Floats = np.asarray(g).reshape(V.shape) / self._unit
        self._kept["forces"] = found
        return found

    def stored(self, x: Floats) -> float:
        """Return the recoverable energy, J."""
        return self.value(x)

    def pressed(self, x: Floats) -> NDArray[np.bool_]:
        """Return a mask of the samples in contact (p,)."""
        return np.asarray(self.forces(x)[self.skin.corners :].any(axis=1), dtype=np.bool_)

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the gradient, minus the forces on all nodes, N."""
        f = self.skin.M.T @ self.forces(x).ravel()
        g[: len(f)] += scale * f

    def matrix(self, x: Floats, projected: bool = False) -> Any:
        """Return the Hessian d2E/dx2, sparse (dofs, dofs), N/m."""
        pairs, guard, V, corners = self._near(x)
        psd = import_ipctk().PSDProjectionMethod
        way = psd.CLAMP if projected else psd.NONE
        M = self.skin.M
        with (_without_negative_weights if projected else nullcontext)(pairs):
            H = M.T @ (self._potential.hessian(pairs, self._sampled, V, way) @ M)
        if len(guard):
            M = M[: corners.size]
            H = H + M.T @ (self._faint.hessian(guard, self._surface, corners, way) @ M)
        H = H.tocsr() / self._unit**2
        H.resize((len(x), len(x)))  # pressures, where there are any, come last
        return H

    def stiff(self, x: Floats) -> Any:
        """Return the Hessian of the sample barrier by positions of corners and samples: sparse (d v, d v), N/m."""
        pairs, _, V, _ = self._near(x)
        none = import_ipctk().PSDProjectionMethod.NONE
        return self._potential.hessian(pairs, self._sampled, V, none).tocsr() / self._unit**2

    def limit(self, x: Floats, d: Floats) -> float:
        """Return the fraction of d, at most 1, before any two faces meet or use up nine tenths of their gap."""
        here, there = self._places(x)[1], self._places(x + d)[1]
        ipc = import_ipctk()
        near = ipc.Candidates()
        near.build(self._surface, here, there)
        self._crossing(near, here)
        ccd = ipc.AdditiveCCD(PATIENCE, LEAVES)
        return float(near.compute_collision_free_stepsize(self._surface, here, there, 0.0, ccd))

    def rounding(self, x: Floats) -> float:
        """Return the error of the forces due to rounding of positions, N."""
        size = float(np.abs(self.skin.X).max())
        return float(np.finfo(np.float64).eps * size * np.linalg.norm(self.matrix(x).data))


@contextmanager
def _without_negative_weights(pairs: Any) -> Iterator[None]:
    """Set negative weights of pairs to zero while a definite matrix is assembled."""
    weights = [(i, pairs[i].weight) for i in range(len(pairs))]
    taken = [(i, weight) for i, weight in weights if weight < 0.0]
    for i, _ in taken:
        pairs[i].weight = 0.0
    yield
    for i, weight in taken:
        pairs[i].weight = weight
