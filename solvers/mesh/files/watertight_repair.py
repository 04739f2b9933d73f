"""Repair of triangle surfaces that enclose a body: certain flaws are mended and reported.

Each repair is reported with its numbers, and a surface that encloses no volume is refused.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass
from softmark.solvers.mesh.files.mesh_validation import (
    COINCIDENT,
    UnreadableMesh,
    components_of_rows,
    drop_unused_points,
    find_components,
    format_position,
)
from softmark.solvers.mesh.files.triangle_proximity import edges_of_triangles, find_intersecting_triangles
from softmark.solvers.mesh.mesh import Floats, Ints

OPEN = 0.02  # relative to the surface area: larger holes are not repaired
SPECK = 1e-3  # relative to the volume of the largest shell: smaller separate shells are dropped
THIN = 1e-6  # relative to the extent: thinner bodies enclose no volume

NO_VOLUME, SHELLS = "E573", "E574"
ONE_SKIN = "close the surface in the program that made it, or name a mesh with cells: a body needs one closed surface"


@dataclass(frozen=True)
class ClosedSurface:
    """A closed surface: `points` (n, 3), m, and `triangles` (t, 3), facing outward.

    `repairs` describes the repairs as text, `crossings` is the number of triangles that intersect others, and `capped`
    the area of holes that were closed, m^2.
    """

    points: Floats
    triangles: Ints
    repairs: tuple[str, ...]
    crossings: int
    capped: float

    @cached_property
    def volume(self) -> float:
        """Enclosed volume, m^3; self-intersecting parts count twice."""
        return signed_volume(self.points, self.triangles)

    @cached_property
    def area(self) -> float:
        """Area, m^2."""
        return float(areas(self.points, self.triangles).sum())

    @cached_property
    def extent(self) -> float:
        """Diagonal of the bounding box, m."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    @property
    def relative_volume_uncertainty(self) -> float:
        """Relative uncertainty of the volume due to closed holes, as if each cap bulged by half its radius."""
        return float(self.capped**1.5 / (4.0 * np.sqrt(np.pi)) / self.volume)


def signed_volume(points: Floats, triangles: Ints) -> float:
    """Return the volume enclosed by triangles (t, 3), m^3: positive if they face outward."""
    a, b, c = (points[triangles[:, i]] - points.mean(axis=0) for i in range(3))
    return float(np.einsum("ti,ti->", a, np.cross(b, c)) / 6.0)


def normals(points: Floats, triangles: Ints) -> Floats:
    """Return the unit normal of each triangle, facing outward, shape (t, 3); zero for a triangle without area."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    found: Floats = np.cross(b - a, c - a)
    length = np.linalg.norm(found, axis=1, keepdims=True)
    return found / np.where(length > 0.0, length, 1.0)


def areas(points: Floats, triangles: Ints) -> Floats:
    """Return the area of each triangle (t,), m^2."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    found: Floats = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return found


def close_surface(points: Floats, triangles: Ints) -> ClosedSurface:
    """Return the closed surface of one body from the triangles (t, 3) of a file. Raises UnreadableMesh."""
    points, triangles, _ = drop_unused_points(points, triangles)
    repairs: list[str] = []
    points, triangles = merge_points(points, triangles, repairs)
    triangles = _drop_duplicate_triangles(triangles, repairs)
    triangles = _orient_triangles(points, triangles, repairs)
    whole = float(areas(points, triangles).sum())
    points, triangles, capped = _cap_holes(points, triangles, repairs)
    if capped > OPEN * whole:
        raise UnreadableMesh(
            f"its surface is open: {100 * capped / (whole + capped):.2g} % of the closing area is missing",
            NO_VOLUME, ONE_SKIN,
        )  # fmt: skip
    triangles = _orient_shells(points, triangles, repairs)
    points, triangles, _ = drop_unused_points(points, triangles)
    through = find_intersecting_triangles(points, triangles)
    if through.any():
        first = points[triangles[int(np.argmax(through))]].mean(axis=0)
        repairs.append(
            f"{_count_phrase(int(through.sum()), 'triangle')} that intersect others united, near "
            f"{format_position(first)}"
        )
    return ClosedSurface(points, triangles, tuple(repairs), int(through.sum()), capped)


def _count_phrase(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _no_volume_error(why: str) -> UnreadableMesh:
    return UnreadableMesh(f"its surface encloses no volume: {why}", NO_VOLUME, ONE_SKIN)


# ------------------------------------------------------------------ points and triangles


def merge_points(points: Floats, triangles: Ints, repairs: list[str]) -> tuple[Floats, Ints]:
    """Return points and triangles with coincident points merged, and without triangles that contain a point twice.

    In STL files each triangle has its own points. Repairs are added to the texts `repairs`.
    """
    from scipy.spatial import cKDTree

    exact, number = np.unique(points, axis=0, return_inverse=True)
    triangles = number.ravel()[triangles]
    flat = _is_degenerate(triangles)
    edges = np.linalg.norm(exact[triangles] - exact[np.roll(triangles, 1, axis=1)], axis=2)[~flat]
    if not edges.size:
        raise _no_volume_error("all its triangles are degenerate (points or lines)")
    extent = float(np.linalg.norm(np.ptp(exact, axis=0)))
    pairs = cKDTree(exact).query_pairs(min(COINCIDENT * extent, 0.01 * float(np.median(edges))), output_type="ndarray")
    if len(pairs):
        part = find_components(len(exact), *pairs.T)
        first = np.unique(part, return_index=True)[1]
        repairs.append(f"{_count_phrase(len(exact) - len(first), 'point')} merged with neighbours")
        exact, triangles = exact[first], part[triangles]
        flat = _is_degenerate(triangles)
    if flat.any():
        repairs.append(f"{_count_phrase(int(flat.sum()), 'triangle')} without area removed")
    return exact, triangles[~flat]


def _is_degenerate(triangles: Ints) -> NDArray[np.bool_]:
    """Return a mask (t,) of the triangles that contain a point twice."""
    found: NDArray[np.bool_] = (triangles == np.roll(triangles, 1, axis=1)).any(axis=1)
    return found


def _drop_duplicate_triangles(triangles: Ints, repairs: list[str]) -> Ints:
    """Return the triangles (t, 3), each once, without pairs of coinciding triangles of opposite orientation.

    Such a pair is a flap without thickness, and both triangles are dropped.
    """
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
        repairs.append(f"{_count_phrase(int(count[flaps].sum()), 'triangle')} of walls without thickness removed")
    if again.any():
        repairs.append(f"{_count_phrase(int((count[again] - 1).sum()), 'triangle')} removed as duplicates")
    kept = np.zeros(len(triangles), dtype=bool)
    kept[first[~flaps]] = True
    if not kept.any():
        raise _no_volume_error("each of its triangles has a twin with the opposite orientation")
    return triangles[kept]


# ------------------------------------------------------------------ orientation


def _edge_numbers_and_counts(triangles: Ints) -> tuple[Ints, NDArray[np.bool_], Ints]:
    """Return the number and direction of all triangle edges (3 t,), and how often each numbered edge occurs.

    The direction is True if the point numbers ascend.
    """
    ends = edges_of_triangles(triangles)
    number, count = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True, return_counts=True)[1:]
    return number.ravel().astype(np.int64), ends[:, 0] < ends[:, 1], count


def _neighbour_pairs(triangles: Ints) -> tuple[Ints, Ints, NDArray[np.bool_]]:
    """Return pairs of triangles that share an edge with no third triangle, as two arrays (p,).

    Return also whether both have the same orientation (p,).
    """
    number, up, count = _edge_numbers_and_counts(triangles)
    order = np.argsort(number, kind="stable")
    pairs = order[count[number[order]] == 2].reshape(-1, 2)
    return pairs[:, 0] // 3, pairs[:, 1] // 3, up[pairs[:, 0]] != up[pairs[:, 1]]


def _orient_triangles(points: Floats, triangles: Ints, repairs: list[str]) -> Ints:
    """Return triangles (t, 3) with the same orientation in each connected patch. Raises UnreadableMesh.

    In each patch the minority of triangles is reversed.
    """
    a, b, alike = _neighbour_pairs(triangles)
    n = len(triangles)
    rows, columns = np.concatenate([a, a + n]), np.concatenate([np.where(alike, b, b + n), np.where(alike, b + n, b)])
    part = find_components(2 * n, rows, columns)
    upright, turned = part[:n], part[n:]
    if (upright == turned).any():
        place = points[triangles[int(np.argmax(upright == turned))]].mean(axis=0)
        raise _no_volume_error(f"near {format_position(place)} its surface has only one side, like a Moebius strip")
    patch = np.minimum(upright, turned)
    ways = np.where(upright == patch, 1, -1)
    total = np.bincount(patch, ways, minlength=2 * n)
    wrong = ways * total[patch] < 0
    if wrong.any():
        repairs.append(f"{_count_phrase(int(wrong.sum()), 'triangle')} reoriented to match neighbours")
    triangles = triangles.copy()
    triangles[wrong] = triangles[wrong][:, ::-1]
    return triangles


# ------------------------------------------------------------------ holes


def _cap_holes(points: Floats, triangles: Ints, repairs: list[str]) -> tuple[Floats, Ints, float]:
    """Return points and triangles with each hole closed by a fan of triangles, and the total area of the caps, m^2."""
    number, _, count = _edge_numbers_and_counts(triangles)
    loops = _trace_edge_loops(edges_of_triangles(triangles)[count[number] == 1][:, ::-1])
    if not loops:
        return points, triangles, 0.0
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
    share, place = missing / float(areas(points, triangles).sum()), format_position(points[loops[0]].mean(axis=0))
    repairs.append(
        f"{_count_phrase(len(loops), 'hole')} closed, with {100 * share:.2g} % of the area, the first at {place}"
    )
    return *found, missing


def _trace_edge_loops(ends: Ints) -> list[list[int]]:
    """Return directed edges (e, 2) as closed loops of points.

    Chains that end at an edge of three triangles are closed, too.
    """
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


def _orient_shells(points: Floats, triangles: Ints, repairs: list[str]) -> Ints:
    """Return triangles with the outer shell facing outward and hollows facing inward. Raises UnreadableMesh.

    Tiny shells are dropped.
    """
    part = _shell_of_triangles(triangles)
    shells = [triangles[part == k] for k in range(int(part.max()) + 1)]
    volumes = np.array([signed_volume(points, shell) for shell in shells])
    thickness = np.array([2.0 * abs(v) / areas(points, s).sum() for v, s in zip(volumes, shells, strict=True)])
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    order = np.argsort(-np.abs(volumes), kind="stable")
    main = int(order[0])
    if thickness[main] < THIN * extent:
        raise _no_volume_error("it has no thickness")
    specks = np.abs(volumes) < SPECK * abs(volumes[main])
    if specks.any():
        share = float(np.abs(volumes[specks]).sum() / abs(volumes[main]))
        repairs.append(f"{_count_phrase(int(specks.sum()), 'speck')} removed, with {100 * share:.2g} % of the volume")
    rest = [int(k) for k in order[1:] if not specks[k]]
    for k in rest:
        _refuse_separate_shell(points, shells[main], shells[k], volumes[main] * volumes[k] < 0.0)
    for i, k in enumerate(rest):
        if any(_is_enclosed(points[shells[k][0, 0]], points[shells[j]]) for j in rest[:i]):
            raise UnreadableMesh("it has a separate shell inside a cavity", SHELLS, _one_shell_remedy())
    kept = np.concatenate([shells[main], *(shells[k] for k in rest)])
    if volumes[main] < 0.0:
        repairs.append(f"all {len(kept)} triangles reoriented: the surface was inside out")
        kept = kept[:, ::-1]
    return kept


def _shell_of_triangles(triangles: Ints) -> Ints:
    """Return the shell of each triangle (t,); a shell is a set of triangles connected by edges."""
    found: Ints = np.unique(
        components_of_rows(_edge_numbers_and_counts(triangles)[0].reshape(-1, 3)), return_inverse=True
    )[1].astype(np.int64)
    return found


def _one_shell_remedy() -> str:
    return "write each shell to a file and declare a body for each: a body must be one piece"


def _refuse_separate_shell(points: Floats, outer: Ints, shell: Ints, opposite: bool) -> None:
    """Raise UnreadableMesh unless a shell is a hollow inside the outer shell or can be united with it.

    Shells can be united if they intersect and have the same orientation. `outer` and `shell` (t, 3) are triangles;
    `opposite` is True if the two shells have opposite orientations.
    """
    place = format_position(points[shell[0, 0]])
    if find_intersecting_triangles(points, np.concatenate([outer, shell]))[len(outer) :].any():
        if opposite:
            raise UnreadableMesh(
                f"it has two intersecting shells with opposite orientations, the smaller one at {place}",
                SHELLS, "reorient the smaller shell; then both are united",
            )  # fmt: skip
        return
    if not _is_enclosed(points[shell[0, 0]], points[outer]):
        raise UnreadableMesh(
            f"it has two separate shells side by side, the smaller one at {place}", SHELLS, _one_shell_remedy()
        )
    if not opposite:
        raise UnreadableMesh(
            f"it has a shell at {place} inside another with the same orientation, which is neither a cavity "
            "nor additional material",
            SHELLS, "reorient its triangles for a cavity, or remove it for a solid body",
        )  # fmt: skip


def _is_enclosed(point: Floats, corners: Floats) -> bool:
    """Return whether triangles (t, 3, 3) enclose a point: their solid angle seen from the point is 4 pi, else 0.

    Source: Van Oosterom and Strackee (1983), IEEE Trans. Biomed. Eng. 30:125.
    """
    a, b, c = (corners[:, i] - point for i in range(3))
    x, y, z = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    det = np.einsum("ti,ti->t", a, np.cross(b, c))
    dots = (np.einsum("ti,ti->t", p, q) * r for p, q, r in ((a, b, z), (b, c, x), (c, a, y)))
    return abs(float(np.arctan2(det, x * y * z + sum(dots)).sum())) > np.pi
