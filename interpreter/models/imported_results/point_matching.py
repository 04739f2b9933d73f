"""Matching of a result file to a body: undeformed points, displacements over time, and distances of outlying points."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.models.imported_results.matching_error import SAME, Unmatched
from softmark.interpreter.models.imported_results.plane_slices import must_be_one_layer, slice_of
from softmark.interpreter.models.imported_results.result_file import ResultFile
from softmark.records import dataclass
from softmark.solvers.mesh.element_interpolation import locate_points
from softmark.solvers.mesh.mesh import Mesh

Floats = NDArray[np.float64]

POSITION = "position"
USUALLY = 0.9  # quantile of the distances to the nearest point that is the typical distance
USUAL = ("displacement", "displacements", "disp", "u", "deplacement", "displ")  # names of it, in lower case
# meaning of vectors that are not displacements, by the beginning of their names in lower case
OTHERS = (
    "velo",
    "acce",
    "forc",
    "reac",
    "norm",
    "stre",
    "stra",
    "trac",
    "flux",
    "heat",
    "grad",
    "coor",
    "mome",
    "rota",
)


@dataclass(frozen=True)
class MatchedResults:
    """Undeformed points `X` (n, 3), m, of a result file, and their displacements `u` (t, n, 3), m.

    `times` (t,), s, are those of the states, if known. `mesh` connects the points; None if there are only points.
    `name` is the file's name of the displacements. In a `flat` body, a plane slice, z is ignored. In a `wired`
    body, made of rods, displacements are known only at the points.
    """

    X: Floats
    u: Floats
    times: Floats | None
    mesh: Mesh | None
    name: str
    flat: bool = False
    wired: bool = False

    @cached_property
    def extent(self) -> float:
        """Diagonal of the bounding box of the points, m."""
        return float(np.linalg.norm(np.ptp(self.X, axis=0)))

    def at(self, X: Floats, u: Floats) -> Floats:
        """Return displacements (t, k, 3), m, of points X (k, 3), m, from those of file points, u (t, n, 3), m."""
        which, share = self.places(X)[:2]
        found: Floats = np.einsum("ka,tkai->tki", share, u[:, which])
        return found

    def outside(self, X: Floats) -> Floats:
        """Return the distances (k,), m, by which points X (k, 3), m, lie outside the file's points."""
        return self.places(X)[2]

    def places(self, X: Floats) -> tuple[Any, Floats, Floats]:
        """Return the data for interpolation at points X (k, 3), m, from points of the file.

        They are indices of file points (k, a), their weights (k, a), and the distances (k,), m, by which X lies
        outside.
        """
        X = self._project_to_slice(X)
        if self.mesh is None:
            return self._interpolation_without_cells(X)
        place = locate_points(self.mesh, X)
        return place.nodes, place.N, place.outside

    def _project_to_slice(self, X: Floats) -> Floats:
        """Return points (k, 3), m, with the z of the file's points if the body is a slice."""
        if not self.flat:
            return X
        return np.column_stack([X[:, :2], np.full(len(X), 0.5 * (self.X[:, 2].min() + self.X[:, 2].max()))])

    def _interpolation_without_cells(self, X: Floats) -> tuple[Any, Floats, Floats]:
        """Return the results of `places` for a file without cells.

        A point X is interpolated from the coincident file point, from a simplex of file points, or from the nearest
        one.
        """
        far, nearest = self._tree.query(X)
        many = self.spatial_dimension + 1
        which, share = np.repeat(nearest[:, None], many, axis=1), np.tile(np.eye(many)[0], (len(X), 1))
        beside = np.flatnonzero(far > SAME * self.extent)
        if not len(beside):
            return which, share, np.zeros(len(X))
        outside = np.where(far > SAME * self.extent, far, 0.0)
        if not self.can_interpolate:
            return which, share, outside
        X = X[:, : self.spatial_dimension]
        simplex = self._simplices.find_simplex(X[beside])
        within, simplex = beside[simplex >= 0], simplex[simplex >= 0]
        T = self._simplices.transform[simplex]
        first = np.einsum("kij,kj->ki", T[:, :-1], X[within] - T[:, -1])
        which[within] = self._simplices.simplices[simplex]
        share[within] = np.column_stack([first, 1.0 - first.sum(axis=1)])
        outside[within] = 0.0
        return which, share, outside

    def nearest_point_distances(self, X: Floats) -> Floats:
        """Return the distances of points X (k, 3), m, from the nearest point of the file (k,), m."""
        found: Floats = self._tree.query(self._project_to_slice(X))[0]
        return found

    @property
    def usual(self) -> float:
        """Typical distance between neighbouring points of the file, m."""
        return float(np.quantile(self._tree.query(self.X, k=2)[0][:, 1], USUALLY))

    @property
    def spatial_dimension(self) -> int:
        """Dimension of the space that the points should span: 2 for a plane slice, else 3."""
        return 2 if self.flat else 3

    @cached_property
    def can_interpolate(self) -> bool:
        """True if values can be interpolated between the points, which do not lie along a line or on a surface."""
        if self.mesh is not None or self.wired:
            return not self.wired
        X = self.X[:, : self.spatial_dimension]
        extents = np.linalg.svd(X - X.mean(axis=0), compute_uv=False)
        return len(extents) == self.spatial_dimension and bool(extents[-1] > SAME * extents[0])

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self.X)

    @cached_property
    def _simplices(self) -> Any:
        """Triangulation of the points. Raises Unmatched if they span no volume."""
        from scipy.spatial import Delaunay, QhullError

        try:
            return Delaunay(self.X[:, : self.spatial_dimension])
        except (QhullError, ValueError):
            reason = "its points span almost no volume, so nothing can be interpolated between them"
            raise Unmatched(
                reason, "write a file with cells, or a table with exactly the points of the probes"
            ) from None


def match_points(
    told: ResultFile,
    at: str,
    rest: ResultFile | None,
    unit: float,
    time: float,
    nodes: Mesh | None,
    depth: float | None = None,
    wired: bool = False,
) -> MatchedResults:
    """Return a result file matched to a body by the name of its displacements, by `position`, or by node numbers.

    `nodes` is the body's mesh for matching by node numbers. `depth`, m, is the thickness of a plane body, None for
    a solid. A body of rods is `wired` and has only points. Raises Unmatched.
    """
    name, X, u = _displacements(told, at, rest)
    times = None if told.times is None else time * np.asarray(told.times, dtype=np.float64)
    if times is not None and np.any(np.diff(times) <= 0.0):
        raise Unmatched("its times do not increase", "write the series in increasing time, each time once")
    if nodes is not None:
        if len(X) != len(nodes.points):
            reason = f"it has {len(X)} points, but the mesh of the body has {len(nodes.points)} nodes"
            raise Unmatched(reason, "write `by = place`, or name the file of the solved mesh")
        return MatchedResults(nodes.points, unit * u, times, nodes, name)
    if depth is not None and (made := slice_of(unit * X, told, depth)) is not None:
        slab, which = made
        return MatchedResults(slab.points, unit * u[:, which], times, slab, name, flat=True)
    mesh = None if wired else _mesh(unit * X, told)
    if depth is not None:
        must_be_one_layer(unit * X, mesh)
    if mesh is None:
        _must_be_unique(X, u)
    return MatchedResults(unit * X, unit * u, times, mesh, name, depth is not None, wired)


def _displacements(told: ResultFile, at: str, rest: ResultFile | None) -> tuple[str, Floats, Floats]:
    """Return undeformed points (n, 3) and displacements (t, n, 3) in the file's unit, after the name of the latter.

    `at` names the displacements in the file; `position` stands for moved points, whose undeformed positions are in the
    file `rest`, or in the first state if that is None. Raises Unmatched.
    """
    if at == POSITION:
        x = told.points[None] if told.moved is None else told.moved
        if rest is None and told.moved is None:
            reason = "it has one set of points, and their undeformed positions are unknown"
            raise Unmatched(reason, 'name a file with the undeformed points: `rest = "..."`')
        X = x[0] if rest is None else rest.points
        if len(X) != x.shape[1]:
            reason = f"it has {x.shape[1]} points, but the undeformed file has {len(X)}"
            raise Unmatched(reason, "write files of the same mesh")
        return POSITION, X, x - X
    name = _displacement_field_name(told, at)
    u = told.fields[name]
    if told.moved is None:
        return name, told.points, u
    X = told.moved - u  # files with deformed points and also displacements
    if np.abs(X - X[0]).max() > SAME * max(float(np.ptp(X[0], axis=0).max()), 1e-300):
        reason = f"its points move over time, but not by `{name}`"
        raise Unmatched(reason, 'use the moved points: `at = "position"`')
    return name, X[0], u


def _displacement_field_name(told: ResultFile, at: str) -> str:
    """Return the name of the vectors that are displacements. Raises Unmatched."""
    other = 'for moved points write `at = "position"`'
    if not told.fields:
        raise Unmatched("it has no vectors at its points", f"write displacements there; {other}")
    has = f"it has {', '.join(f'`{n}`' for n in told.fields)}"
    if at:
        if at not in told.fields:
            raise Unmatched(f"it has no vectors `{at}` at its points", f"{has}; {other}")
        return at
    usual = [n for n in told.fields if n.lower() in USUAL]
    if len(usual) == 1:
        return usual[0]
    if len(told.fields) == 1 and not (only := next(iter(told.fields))).lower().startswith(OTHERS):
        return only
    raise Unmatched(
        f"it has several vectors, and none is known to be displacements: {has}",
        f'write their name, `at = "..."`; {other}',
    )


def _must_be_unique(X: Floats, u: Floats) -> None:
    """Raise Unmatched if points X (n, 3) without cells coincide but have different displacements u (t, n, 3)."""
    extent = float(np.ptp(X, axis=0).max())
    order = np.lexsort(np.round(X / (SAME * extent or 1.0)).T)
    same = np.abs(np.diff(X[order], axis=0)).max(axis=1, initial=0.0) <= SAME * extent
    apart = np.abs(np.diff(u[:, order], axis=1)).max(axis=(0, 2)) > SAME * max(float(np.abs(u).max()), 1e-300)
    if len(wrong := np.flatnonzero(same & apart)):
        one, other = sorted(order[wrong[0] : wrong[0] + 2].tolist())
        reason = f"its points {one} and {other}, counted from 0, are at the same place but move differently"
        raise Unmatched(reason, "remove one of them, or write a file with cells, which distinguish the points")


def _mesh(X: Floats, told: ResultFile) -> Mesh | None:
    """Return the mesh that connects points X (n, 3), m. Raises Unmatched if cells are inverted."""
    if told.cells is None or told.kind is None:
        return None
    mesh = Mesh(np.ascontiguousarray(X), told.cells, told.kind)
    turned = int(np.count_nonzero(mesh.volumes <= 0.0))
    if turned:
        reason = f"{turned} of its {len(mesh.cells)} undeformed cells are inverted or flat"
        raise Unmatched(
            reason,
            "if its points are deformed, name a file with the undeformed points, `rest`; otherwise repair the mesh",
        )
    return mesh
