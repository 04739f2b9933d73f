"""What a file tells, matched to a body: undeformed points, displacements from time to time, and what lies outside."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.models.results.told import Told
from softmark.records import dataclass
from softmark.solvers.mesh.interpolation import locate
from softmark.solvers.mesh.mesh import Mesh

Floats = NDArray[np.float64]

POSITION = "position"
USUAL = ("displacement", "displacements", "disp", "u", "deplacement", "displ")  # names of it, in small letters
SAME = 1e-6  # of the extent: points that are one


class Unmatched(Exception):
    """Why what a file tells cannot be matched: a reason and a remedy, in words for users."""

    def __init__(self, reason: str, remedy: str) -> None:
        super().__init__(f"{reason}; {remedy}")
        self.reason, self.remedy = reason, remedy


@dataclass(frozen=True)
class Matched:
    """Undeformed points `X` (n, 3), m, and their displacements `u` (t, n, 3), m, at `times` (t,), s, if the file has
    some. `mesh` is what connects them, None of points alone; `name` is what the file calls the displacements."""

    X: Floats
    u: Floats
    times: Floats | None
    mesh: Mesh | None
    name: str

    @cached_property
    def extent(self) -> float:
        """The diagonal of the points, m."""
        return float(np.linalg.norm(np.ptp(self.X, axis=0)))

    def at(self, X: Floats, u: Floats) -> Floats:
        """Displacements of material points X (k, 3), m, by those of its points u (t, n, 3): (t, k, 3), m."""
        which, share = self._places(X)[:2]
        found: Floats = np.einsum("ka,tkai->tki", share, u[:, which])
        return found

    def outside(self, X: Floats) -> Floats:
        """How far points X (k, 3), m, lie outside of what it covers (k,), m."""
        return self._places(X)[2]

    def _places(self, X: Floats) -> tuple[Any, Floats, Floats]:
        """Points (k, a) with shares (k, a) of them, and how far outside (k,), m."""
        if self.mesh is None:
            return self._between(X)
        place = locate(self.mesh, X)
        return place.nodes, place.N, place.outside

    def _between(self, X: Floats) -> tuple[Any, Floats, Floats]:
        """Of points alone: the nearest where it is the same, those of the simplex around it, or the nearest outside."""
        far, nearest = self._tree.query(X)
        which, share = np.repeat(nearest[:, None], 4, axis=1), np.tile([1.0, 0.0, 0.0, 0.0], (len(X), 1))
        beside = np.flatnonzero(far > SAME * self.extent)
        if not len(beside):
            return which, share, np.zeros(len(X))
        outside = np.where(far > SAME * self.extent, far, 0.0)
        if not self.spans:
            return which, share, outside
        simplex = self._simplices.find_simplex(X[beside])
        within, simplex = beside[simplex >= 0], simplex[simplex >= 0]
        T = self._simplices.transform[simplex]
        first = np.einsum("kij,kj->ki", T[:, :3], X[within] - T[:, 3])
        which[within] = self._simplices.simplices[simplex]
        share[within] = np.column_stack([first, 1.0 - first.sum(axis=1)])
        outside[within] = 0.0
        return which, share, outside

    @cached_property
    def spans(self) -> bool:
        """Whether anything lies between its points: those of a table along a line or on a surface alone span nothing,
        and are known at themselves."""
        if self.mesh is not None:
            return True
        extents = np.linalg.svd(self.X - self.X.mean(axis=0), compute_uv=False)
        return len(extents) == 3 and bool(extents[-1] > SAME * extents[0])

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self.X)

    @cached_property
    def _simplices(self) -> Any:
        """Raises Unmatched where the points span no volume."""
        from scipy.spatial import Delaunay, QhullError

        try:
            return Delaunay(self.X)
        except (QhullError, ValueError):
            reason = "its points span next to no volume, and nothing can be told between them"
            raise Unmatched(reason, "give a file with cells, or a table at the points of the probes alone") from None


def matched(told: Told, at: str, rest: Told | None, unit: float, time: float, nodes: Mesh | None) -> Matched:
    """By the name of the displacements or `position`; by `nodes` where their mesh is given. Raises Unmatched."""
    name, X, u = _moved(told, at, rest)
    times = None if told.times is None else time * np.asarray(told.times, dtype=np.float64)
    if times is not None and np.any(np.diff(times) <= 0.0):
        raise Unmatched("its times do not grow", "write the series in the order of time, each time once")
    if nodes is not None:
        if len(X) != len(nodes.points):
            reason = f"it has {len(X)} points, and the mesh of the body has {len(nodes.points)} nodes"
            raise Unmatched(reason, "match `by = place`, or give the file of the mesh that was solved on")
        return Matched(nodes.points, unit * u, times, nodes, name)
    mesh = _mesh(unit * X, told)
    return Matched(unit * X, unit * u, times, mesh, name)


def _moved(told: Told, at: str, rest: Told | None) -> tuple[str, Floats, Floats]:
    """The name of what moves, undeformed points (n, 3) and displacements (t, n, 3), in the file's unit."""
    if at == POSITION:
        x = told.points[None] if told.moved is None else told.moved
        if rest is None and told.moved is None:
            reason = "it has one set of points, and nothing says where they were undeformed"
            raise Unmatched(reason, 'name a file with them undeformed: `rest = "..."`')
        X = x[0] if rest is None else rest.points
        if len(X) != x.shape[1]:
            reason = f"it has {x.shape[1]} points, and the undeformed file {len(X)}"
            raise Unmatched(reason, "give files of the same mesh")
        return POSITION, X, x - X
    name = _name(told, at)
    u = told.fields[name]
    if told.moved is None:
        return name, told.points, u
    X = told.moved - u  # files of deformed meshes that have their displacements as well
    if np.abs(X - X[0]).max() > SAME * max(float(np.ptp(X[0], axis=0).max()), 1e-300):
        reason = f"its points move from time to time, and not by `{name}`"
        raise Unmatched(reason, 'take the points themselves: `at = "position"`')
    return name, X[0], u


def _name(told: Told, at: str) -> str:
    """Which of the vectors are the displacements. Raises Unmatched."""
    known = ", ".join(f"`{n}`" for n in told.fields)
    has = f"it has {known}" if known else "it has no vectors at points"
    other = 'for points that moved `at = "position"`'
    if at:
        if at not in told.fields:
            raise Unmatched(f"it has no vectors `{at}` at its points", f"{has}; {other}")
        return at
    usual = [n for n in told.fields if n.lower() in USUAL]
    if len(usual) == 1 or len(told.fields) == 1:
        return (usual or list(told.fields))[0]
    raise Unmatched(f"it does not say which vectors are displacements: {has}", f'name them, `at = "..."`; {other}')


def _mesh(X: Floats, told: Told) -> Mesh | None:
    """What connects points at X (n, 3), m. Raises Unmatched where cells are inside out."""
    if told.cells is None or told.kind is None:
        return None
    mesh = Mesh(np.ascontiguousarray(X), told.cells, told.kind)
    turned = int(np.count_nonzero(mesh.volumes <= 0.0))
    if turned:
        reason = f"{turned} of its {len(mesh.cells)} cells are inside out or flat, undeformed"
        raise Unmatched(reason, "its points may be deformed ones: name a file with them undeformed, `rest`, or mend it")
    return mesh
