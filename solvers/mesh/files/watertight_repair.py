"""Surfaces of triangles that enclose a body: what is wrong with one, mended where that is certain, and said.

Nothing is dropped in silence: each repair is words with numbers, and what encloses no volume is refused.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass
from softmark.solvers.mesh.files.mesh_validation import COINCIDENT, UnreadableMesh, at, components, sharing, used
from softmark.solvers.mesh.files.triangle_proximity import crossing, ends_of
from softmark.solvers.mesh.mesh import Floats, Ints

OPEN = 0.02  # of the area of a surface: holes as large are no defects of it
SPECK = 1e-3  # of the volume of the largest shell: what floats beside it is left out
THIN = 1e-6  # of the extent: what is no thicker encloses nothing

NO_VOLUME, SHELLS = "E573", "E574"
ONE_SKIN = "a body is what one closed surface encloses: close it in the program that made it, or name a mesh of cells"


@dataclass(frozen=True)
class Closed:
    """`points` (n, 3) in m and `triangles` (t, 3), outward; `repairs` in words.

    `crossings` are triangles that pass through others, `capped` the area of holes that were closed, m^2.
    """

    points: Floats
    triangles: Ints
    repairs: tuple[str, ...]
    crossings: int
    capped: float

    @cached_property
    def volume(self) -> float:
        """That it encloses, m^3; where it passes through itself, parts count twice."""
        return signed(self.points, self.triangles)

    @cached_property
    def area(self) -> float:
        """m^2."""
        return float(areas(self.points, self.triangles).sum())

    @cached_property
    def extent(self) -> float:
        """Diagonal of its bounds, m."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    @property
    def doubt(self) -> float:
        """Of the volume: what may be wrong with it for holes, as if each cap were bulged by half its radius."""
        return float(self.capped**1.5 / (4.0 * np.sqrt(np.pi)) / self.volume)


def signed(points: Floats, triangles: Ints) -> float:
    """Volume that triangles enclose, m^3, positive where they look outward."""
    a, b, c = (points[triangles[:, i]] - points.mean(axis=0) for i in range(3))
    return float(np.einsum("ti,ti->", a, np.cross(b, c)) / 6.0)


def normals(points: Floats, triangles: Ints) -> Floats:
    """Of each triangle (t, 3), outward; zero of one without an area."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    found: Floats = np.cross(b - a, c - a)
    length = np.linalg.norm(found, axis=1, keepdims=True)
    return found / np.where(length > 0.0, length, 1.0)


def areas(points: Floats, triangles: Ints) -> Floats:
    """Of each triangle (t,), m^2."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    found: Floats = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return found


def closed(points: Floats, triangles: Ints) -> Closed:
    """The surface of one body, of triangles (t, 3) as a file has them. Raises UnreadableMesh."""
    points, triangles, _ = used(points, triangles)
    repairs: list[str] = []
    points, triangles = joined(points, triangles, repairs)
    triangles = _once(triangles, repairs)
    triangles = _turned(points, triangles, repairs)
    whole = float(areas(points, triangles).sum())
    points, triangles, capped = _capped(points, triangles, repairs)
    if capped > OPEN * whole:
        raise UnreadableMesh(
            f"its surface is open: {100 * capped / (whole + capped):.2g} % of what would close it is missing",
            NO_VOLUME, ONE_SKIN,
        )  # fmt: skip
    triangles = _shells(points, triangles, repairs)
    points, triangles, _ = used(points, triangles)
    through = crossing(points, triangles)
    if through.any():
        first = points[triangles[int(np.argmax(through))]].mean(axis=0)
        repairs.append(f"{_count(int(through.sum()), 'triangle')} passing through others united, near {at(first)}")
    return Closed(points, triangles, tuple(repairs), int(through.sum()), capped)


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _nothing(why: str) -> UnreadableMesh:
    return UnreadableMesh(f"its surface encloses no volume: {why}", NO_VOLUME, ONE_SKIN)


# ------------------------------------------------------------------ points and triangles


def joined(points: Floats, triangles: Ints, repairs: list[str]) -> tuple[Floats, Ints]:
    """Points at one place made one: each triangle of an STL file has its own. Triangles without extent are dropped."""
    from scipy.spatial import cKDTree

    exact, number = np.unique(points, axis=0, return_inverse=True)
    triangles = number.ravel()[triangles]
    flat = _twice(triangles)
    edges = np.linalg.norm(exact[triangles] - exact[np.roll(triangles, 1, axis=1)], axis=2)[~flat]
    if not edges.size:
        raise _nothing("all its triangles are points or lines")
    extent = float(np.linalg.norm(np.ptp(exact, axis=0)))
    pairs = cKDTree(exact).query_pairs(min(COINCIDENT * extent, 0.01 * float(np.median(edges))), output_type="ndarray")
    if len(pairs):
        part = components(len(exact), *pairs.T)
        first = np.unique(part, return_index=True)[1]
        repairs.append(f"{_count(len(exact) - len(first), 'point')} joined to others next to them")
        exact, triangles = exact[first], part[triangles]
        flat = _twice(triangles)
    if flat.any():
        repairs.append(f"{_count(int(flat.sum()), 'triangle')} without area dropped")
    return exact, triangles[~flat]


def _twice(triangles: Ints) -> NDArray[np.bool_]:
    """Which triangles name a point twice."""
    found: NDArray[np.bool_] = (triangles == np.roll(triangles, 1, axis=1)).any(axis=1)
    return found


def _once(triangles: Ints, repairs: list[str]) -> Ints:
    """Each triangle once; two that look opposite ways are a flap without thickness, and dropped both."""
    least = np.argmin(triangles, axis=1)
    rows = np.stack([triangles[np.arange(len(triangles)), (least + k) % 3] for k in range(3)], axis=1)
    sense = np.where(rows[:, 1] < rows[:, 2], 1, -1)
    _, first, which, count = np.unique(
        np.sort(triangles, axis=1), axis=0, return_index=True, return_inverse=True, return_counts=True
    )
    which = which.ravel()
    total = np.zeros(len(first), dtype=np.int64)
    np.add.at(total, which, sense)
    flaps, again = (count > 1) & (total == 0), (count > 1) & (total != 0)
    if flaps.any():
        repairs.append(f"{_count(int(count[flaps].sum()), 'triangle')} of walls without thickness dropped")
    if again.any():
        repairs.append(f"{_count(int((count[again] - 1).sum()), 'triangle')} given more than once dropped")
    kept = np.zeros(len(triangles), dtype=bool)
    kept[first[~flaps]] = True
    if not kept.any():
        raise _nothing("each of its triangles has a twin that looks the other way")
    return triangles[kept]


# ------------------------------------------------------------------ which way they look


def _edges(triangles: Ints) -> tuple[Ints, NDArray[np.bool_], Ints]:
    """The edges of all triangles (3 t,): their numbers, whether they go up, and how often each number is there."""
    ends = ends_of(triangles)
    number, count = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True, return_counts=True)[1:]
    return number.ravel().astype(np.int64), ends[:, 0] < ends[:, 1], count


def _partners(triangles: Ints) -> tuple[Ints, Ints, NDArray[np.bool_]]:
    """Pairs of triangles that share an edge with no third, and whether both look the same way there."""
    number, up, count = _edges(triangles)
    order = np.argsort(number, kind="stable")
    pairs = order[count[number[order]] == 2].reshape(-1, 2)
    return pairs[:, 0] // 3, pairs[:, 1] // 3, up[pairs[:, 0]] != up[pairs[:, 1]]


def _turned(points: Floats, triangles: Ints, repairs: list[str]) -> Ints:
    """Neighbours look the same way: of each patch the fewer triangles are turned. Raises UnreadableMesh."""
    a, b, alike = _partners(triangles)
    n = len(triangles)
    rows, columns = np.concatenate([a, a + n]), np.concatenate([np.where(alike, b, b + n), np.where(alike, b + n, b)])
    part = components(2 * n, rows, columns)
    upright, turned = part[:n], part[n:]
    if (upright == turned).any():
        place = points[triangles[int(np.argmax(upright == turned))]].mean(axis=0)
        raise _nothing(f"near {at(place)} it has but one side, as a Moebius strip has")
    patch = np.minimum(upright, turned)
    ways = np.where(upright == patch, 1, -1)
    total = np.bincount(patch, ways, minlength=2 * n)
    wrong = ways * total[patch] < 0
    if wrong.any():
        repairs.append(f"{_count(int(wrong.sum()), 'triangle')} turned to look as those around")
    triangles = triangles.copy()
    triangles[wrong] = triangles[wrong][:, ::-1]
    return triangles


# ------------------------------------------------------------------ holes


def _capped(points: Floats, triangles: Ints, repairs: list[str]) -> tuple[Floats, Ints, float]:
    """Holes closed, each by a fan around its middle; and the area that was missing, m^2."""
    number, _, count = _edges(triangles)
    ends = ends_of(triangles)[count[number] == 1]
    if not len(ends):
        return points, triangles, 0.0
    loops = _loops(ends[:, ::-1])
    new, fans = [points], [triangles]
    for loop in loops:
        ring = np.array(loop)
        if len(ring) == 3:
            fans.append(ring[None])
            continue
        middle = sum(map(len, new))
        new.append(points[ring].mean(axis=0)[None])
        fans.append(np.stack([np.full(len(ring), middle), ring, np.roll(ring, -1)], axis=1))
    found = np.concatenate(new), np.concatenate(fans)
    missing = float(areas(found[0], np.concatenate(fans[1:])).sum())
    share, place = missing / float(areas(points, triangles).sum()), at(points[loops[0]].mean(axis=0))
    repairs.append(f"{_count(len(loops), 'hole')} of {100 * share:.2g} % of the area closed, the first at {place}")
    return *found, missing


def _loops(ends: Ints) -> list[list[int]]:
    """Directed edges (e, 2) as closed loops of points; chains that end at an edge of three triangles are closed too."""
    follow: dict[int, list[int]] = {}
    surplus: dict[int, int] = {}
    for a, b in ends.tolist():
        follow.setdefault(a, []).append(b)
        surplus[a] = surplus.get(a, 0) + 1
        surplus[b] = surplus.get(b, 0) - 1
    starts = [point for point, more in surplus.items() for _ in range(more)]  # of chains; loops have none
    loops = []
    while follow:
        loop = [starts.pop() if starts else next(iter(follow))]
        while (ways := follow.get(loop[-1])) is not None:
            there = ways.pop()
            if not ways:
                del follow[loop[-1]]
            if there == loop[0]:
                break
            loop.append(there)
        if len(loop) > 2:
            loops.append(loop)
    return loops


# ------------------------------------------------------------------ shells


def _shells(points: Floats, triangles: Ints, repairs: list[str]) -> Ints:
    """The outer shell looks outward, and hollows within it inward; specks are left out. Raises UnreadableMesh."""
    part = _parts(triangles)
    shells = [triangles[part == k] for k in range(int(part.max()) + 1)]
    volumes = np.array([signed(points, shell) for shell in shells])
    thickness = np.array([2.0 * abs(v) / areas(points, s).sum() for v, s in zip(volumes, shells, strict=True)])
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    order = np.argsort(-np.abs(volumes), kind="stable")
    main = int(order[0])
    if thickness[main] < THIN * extent:
        raise _nothing("it has no thickness")
    specks = np.abs(volumes) < SPECK * abs(volumes[main])
    if specks.any():
        share = float(np.abs(volumes[specks]).sum() / abs(volumes[main]))
        repairs.append(f"{_count(int(specks.sum()), 'speck')} of {100 * share:.2g} % of the volume left out")
    rest = [int(k) for k in order[1:] if not specks[k]]
    for k in rest:
        _beside(points, shells[main], shells[k], volumes[main] * volumes[k] < 0.0)
    for i, k in enumerate(rest):
        if any(_inside(points[shells[k][0, 0]], points[shells[j]]) for j in rest[:i]):
            raise UnreadableMesh("it has a shell within a hollow, which touches nothing", SHELLS, _each())
    kept = np.concatenate([shells[main], *(shells[k] for k in rest)])
    if volumes[main] < 0.0:
        repairs.append(f"all {len(kept)} triangles turned: the surface was inside out")
        kept = kept[:, ::-1]
    return kept


def _parts(triangles: Ints) -> Ints:
    """Which shell each triangle belongs to (t,): shells share no edge."""
    found: Ints = np.unique(sharing(_edges(triangles)[0].reshape(-1, 3)), return_inverse=True)[1].astype(np.int64)
    return found


def _each() -> str:
    return "a body is one piece: write each shell to a file of its own and declare a body for each"


def _beside(points: Floats, outer: Ints, shell: Ints, opposite: bool) -> None:
    """Refuse a shell that is neither a hollow of the outer one nor united with it by passing through it."""
    place = at(points[shell[0, 0]])
    if crossing(points, np.concatenate([outer, shell]))[len(outer) :].any():
        if opposite:
            raise UnreadableMesh(
                f"it has two shells that pass through each other and look opposite ways, the smaller at {place}",
                SHELLS, "turn the smaller one, and the two are united",
            )  # fmt: skip
        return
    if not _inside(points[shell[0, 0]], points[outer]):
        raise UnreadableMesh(f"it has two shells side by side, the smaller at {place}", SHELLS, _each())
    if not opposite:
        raise UnreadableMesh(
            f"it has a shell within another that looks outward as well, at {place}: neither a hollow nor more matter",
            SHELLS, "turn its triangles for a hollow, or leave it out for a solid body",
        )  # fmt: skip


def _inside(point: Floats, corners: Floats) -> bool:
    """Whether triangles (t, 3, 3) are around a point: the solid angle under which it sees them is 4 pi, else 0.

    Source: Van Oosterom and Strackee 1983, IEEE Trans. Biomed. Eng. 30:125.
    """
    a, b, c = (corners[:, i] - point for i in range(3))
    x, y, z = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    det = np.einsum("ti,ti->t", a, np.cross(b, c))
    dots = (np.einsum("ti,ti->t", p, q) * r for p, q, r in ((a, b, z), (b, c, x), (c, a, y)))
    return abs(float(np.arctan2(det, x * y * z + sum(dots)).sum())) > np.pi
