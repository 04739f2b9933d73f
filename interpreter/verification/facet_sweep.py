"""Selected parts of surface facets by a sweep of straight lines, as an independent check of the solver's selection.

The solver cuts facets into triangles along the borders of a condition. Here every facet is swept by straight
lines of its local coordinates: crossings of a border and a line are bisected, the condition is evaluated once
between two crossings, and strips between lines are halved until two Gauss rules agree. Both methods share
only the borders that do not cut facets, and the curved sides.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.mesh_group_conditions import facet_membership, split_by_groups
from softmark.interpreter.problem.surface_selection.loaded_surface_part import settled_borders, split_by_sides
from softmark.interpreter.verification.unverified_model_error import NoIndependentFormula
from softmark.records import dataclass
from softmark.solvers.independent_forces import solid_forces
from softmark.solvers.independent_forces.solid_forces import Floats, Ints

if TYPE_CHECKING:
    from softmark.solvers.mesh.mesh import Mesh

LINES = (12, 18)  # Gauss lines in a strip, of two rules
ALONG = 7  # Gauss points between two crossings
GRID = 12  # squared: Gauss points on whole facets whose area is no polynomial
ASKED = 25  # points of a line, and lines of a facet, used to search for borders
AGREE = 1e-11  # relative to a facet's local area: tolerance of two rules in a strip
HALVED = 14  # times
SURE = 3e-9  # relative to a facet's local area: claimed accuracy
MARGIN = 0.1  # relative to its size: how far a curved facet may extend beyond its sample points
MOST_UNSURE = 1e-6  # largest uncertain share of a load that counts as verified


def _conditions_by_facets(case: Case, mesh: Mesh, where: Condition) -> Iterator[tuple[Condition, Ints, Any]]:
    """Yield each condition on coordinates with its facets, and the map of these facets onto their curved side."""
    for condition, members in split_by_groups(where, facet_membership(mesh)):
        own = np.zeros(len(mesh.facets), dtype=np.bool_)
        own[members] = True
        for beside, out in split_by_sides(case.shape, mesh.points[mesh.facets]):
            yield condition, np.flatnonzero(own & beside), out


Points = tuple[Ints, Floats, Floats]  # facets (p, k), local points (p, 2), weights (p,) in local area
Swept = tuple[Ints, Points, tuple[Ints, Floats]]


def select_facets(where: Condition, case: Case, mesh: Mesh) -> list[Swept]:
    """Return the selected facets of each side of the body; computed once per mesh. Raises NoIndependentFormula.

    Each entry has whole facets (w, k), points on partly selected ones, and facets (v, k) with their uncertainty.
    """
    if (key := (select_facets, where)) not in mesh.selections:
        mesh.selections[key] = list(_sweep_sides(where, case, mesh))
    return list(mesh.selections[key])


def _sweep_sides(where: Condition, case: Case, mesh: Mesh) -> Iterator[Swept]:
    """Compute the entries of `select_facets`. Raises NoIndependentFormula."""
    facets = mesh.facets
    corners = mesh.points[facets]
    told = mesh.selections.get(where)
    if told is not None and told.remainder > MOST_UNSURE * told.area:  # the open share is reported already
        raise NoIndependentFormula("the border of the loaded area runs along the surface")
    extent = float(np.sqrt((np.ptp(mesh.points, axis=0) ** 2).sum()))
    empty = True
    for condition, which, out in _conditions_by_facets(case, mesh, where):
        settled, settling = settled_borders(case.shape, mesh, condition)
        sweep = FacetSweep(condition, corners[which], extent, out, settled[which], settling[which])
        whole, (f, xi, w), (g, left) = sweep.whole_and_parts()
        yield facets[which[whole]], (facets[which[f]], xi, w), (facets[which[g]], left)
        empty = empty and not (len(whole) or len(f))
    if empty:
        raise NoIndependentFormula("the loaded area is too small to be found independently")


def sample_facets(facets: Ints) -> Iterator[Points]:
    """Yield quadrature points on whole, possibly curved facets (f, k), in batches of facets."""
    x, v = np.polynomial.legendre.leggauss(GRID)
    a, b = (0.5 * (t.ravel() + 1.0) for t in np.meshgrid(x, x))
    w = 0.25 * np.outer(v, v).ravel()
    square = solid_forces.is_tensor_product(facets.shape[1])
    xi = np.stack([2 * a - 1, 2 * b - 1], axis=1) if square else np.stack([a, (1 - a) * b], axis=1)
    w = 4 * w if square else w * (1 - a)
    for at in range(0, len(facets), 500):
        some = facets[at : at + 500]
        yield np.repeat(some, len(w), axis=0), np.tile(xi, (len(some), 1)), np.tile(w, len(some))


@dataclass(frozen=True)
class FacetSweep:
    """Sweep over facets with nodes `corners` (f, k, 3), m, to find the parts that a condition selects.

    `out` maps points of the facets onto the exact surface of the body.
    """

    condition: Condition
    corners: Floats
    extent: float
    out: Any
    settled: Any  # (f, b): borders that do not cut a facet, where their levels are
    settling: Floats  # (f, b)

    @cached_property
    def through(self) -> Any:
        """Mask (b, f): whether border b of the condition cuts facet f; False for facets that were not checked."""
        return np.zeros((len(self.condition.borders), len(self.corners)), dtype=np.bool_)

    @property
    def _square(self) -> bool:
        return solid_forces.is_tensor_product(self.corners.shape[1])

    def whole_and_parts(self) -> tuple[Ints, tuple[Ints, Floats, Floats], tuple[Ints, Floats]]:
        """Return whole facets (w,), and two tuples about partly selected facets.

        The first tuple has quadrature points: their facets (p,), local coordinates (p, 2) and weights (p,). The second
        has facets (v,) on which two quadrature rules disagreed, and the local area of disagreement (v,).
        """
        told = self._selection_by_bounds()
        open_ = np.flatnonzero(told == 0)
        crossing, inside = self._find_crossing_borders(open_)
        cut = crossing.any(axis=0)
        self.through[:, open_] = crossing
        whole = np.concatenate([np.flatnonzero(told > 0), open_[inside & ~cut]])
        return np.sort(whole), *self._sweep_cut_facets(open_[cut])

    # -------------------------------------------------------------- facets that borders cut

    def _places(self, f: Ints, xi: Floats) -> Any:
        """Return the coordinates x, y, z at local points xi (l, m, 2) of facets f (l,), m."""
        kind = self.corners.shape[1]
        N = solid_forces.shape_functions(kind, xi.reshape(-1, 2)).reshape(*xi.shape[:2], self.corners.shape[1])
        X = (N @ self.corners[f]).transpose(2, 1, 0)
        return tuple(X) if self.out is None else self.out(tuple(X))

    def _selection_by_bounds(self) -> Ints:
        """Return 1 for each facet (f,) that is wholly selected by bounds, -1 if not selected at all, 0 if undecided."""
        n = len(self.corners)
        told = np.zeros(n, dtype=np.int64)
        if not n:
            return told
        places = solid_forces.node_positions(self.corners.shape[1])
        X = np.array(self._places(np.arange(n), np.broadcast_to(self._lattice(5, places), (n, 25 + len(places), 2))))
        low, high = X.min(axis=1).T, X.max(axis=1).T  # (f, 3)
        beyond = MARGIN * np.linalg.norm(high - low, axis=1, keepdims=True)
        flat = self.corners.shape[1] == 3 and self.out is None
        low, high = (low, high) if flat else (low - beyond, high + beyond)
        pending = [np.lexsort((0.5 * (low + high)).T)]
        while pending:
            some = pending.pop()
            box = tuple(low[some].min(axis=0).tolist()), tuple(high[some].max(axis=0).tolist())
            false, true = self.condition.over(*box, self.extent)
            if not (false and true):
                told[some] = 1 if true else -1
            elif len(some) > 1:
                pending += [some[: len(some) // 2], some[len(some) // 2 :]]
        return told

    def _lattice(self, n: int, more: Floats) -> Floats:
        """Return n by n local points of a facet, including points on its sides, followed by the points `more`."""
        a, b = (t.ravel() for t in np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), indexing="ij"))
        xi = np.stack([2 * b - 1, 2 * a - 1], axis=1) if self._square else np.stack([(1 - a) * b, a], axis=1)
        return np.concatenate([xi, more])

    def _find_crossing_borders(self, f: Ints) -> tuple[Any, Any]:
        """Return which borders cross a lattice of points on facets f, (b, f), and the facets with a selected point."""
        inside = np.zeros(len(f), dtype=np.bool_)
        cut = np.zeros((len(self.condition.borders), len(f)), dtype=np.bool_)
        xi = self._lattice(ASKED, np.zeros((0, 2)))
        for at in range(0, len(f), 1000):
            some = f[at : at + 1000]
            levels = self._levels(some, np.broadcast_to(xi, (len(some), *xi.shape)))  # (b, m, l)
            cut[:, at : at + 1000] = self._signs(levels).min(axis=1) != self._signs(levels).max(axis=1)
            middle = [level[[xi.shape[0] // 2]] for level in levels]
            inside[at : at + 1000] = np.broadcast_to(
                self.condition.holds_for_levels(middle, self.extent), (1, len(some))
            )[0]
        return cut, inside

    def _signs(self, levels: Floats) -> Floats:
        """Return the sign of levels (b, ...) of borders, -1 or 1; points within the tolerance of a border get 1."""
        slack = np.array([1e-9 * self.extent**b.power for b in self.condition.borders])
        sign: Floats = np.sign(np.where(np.abs(levels) <= slack.reshape(-1, *(1,) * (levels.ndim - 1)), 0.0, levels))
        return np.where(sign == 0.0, self._side_of_zero(sign), sign)

    @staticmethod
    def _side_of_zero(sign: Floats) -> Floats:
        """Return the signs with points on a border assigned to the side on which the other points of the facet lie."""
        most = sign.sum(axis=1, keepdims=True)
        return np.broadcast_to(np.where(most < 0.0, -1.0, 1.0), sign.shape)

    def _levels(self, f: Ints, xi: Floats) -> Floats:
        """Return levels (b, m, l) of all borders at local points xi (l, m, 2) of facets f (l,)."""
        x, y, z = self._places(f, xi)
        found = np.empty((len(self.condition.borders), xi.shape[1], len(f)))
        with np.errstate(all="ignore"):
            for b, border in enumerate(self.condition.borders):
                found[b] = np.where(self.settled[f, b], self.settling[f, b], border.at(x, y, z))
        return found

    # -------------------------------------------------------------- strips

    def _sweep_cut_facets(self, f: Ints) -> tuple[tuple[Ints, Floats, Floats], tuple[Ints, Floats]]:
        """Return quadrature points over the selected parts of facets f, and the area on which two rules disagreed."""
        own, low, high = self._panels(f)
        points, vague = [(own[:0], np.zeros((0, 2)), np.zeros(0))], [(f, np.full(len(f), SURE))]
        for halved in range(HALVED + 1):
            if not len(own):
                break
            few, _ = self._integrate_panels(own, low, high, LINES[0])
            many, (g, xi, w) = self._integrate_panels(own, low, high, LINES[1])
            apart = np.abs(few - many).max(axis=1)
            good = (apart <= AGREE) | (halved == HALVED)
            late = good & (apart > AGREE)
            vague.append((own[late], apart[late]))
            kept = good[g]
            points.append((own[g[kept]], xi[kept], w[kept]))
            bad, middle = ~good, 0.5 * (low + high)
            low, high = (np.concatenate(pair) for pair in ((low[bad], middle[bad]), (middle[bad], high[bad])))
            own = np.tile(own[bad], 2)
        f, xi, w = (np.concatenate(column) for column in zip(*points, strict=True))
        g, left = (np.concatenate(column) for column in zip(*vague, strict=True))
        return (f, xi, w), (g, left)

    def _panels(self, f: Ints) -> tuple[Ints, Floats, Floats]:
        """Return the strips (panels) into which the sweep divides facets f.

        Strips end at corners of a facet, where a border turns back, and where borders intersect. Each strip is given
        by its facet and by the coordinate a of its first and its last line.
        """
        found = [
            (f, np.zeros(len(f))),
            (f, np.ones(len(f))),
            *self._border_ends_on_sides(f),
            *self._turning_points_and_crossings(f),
        ]
        facet, place = (np.concatenate(column) for column in zip(*found, strict=True))
        order = np.lexsort((place, facet))
        facet, place = facet[order], place[order]
        real = (facet[1:] == facet[:-1]) & (place[1:] - place[:-1] > 1e-9)
        return facet[:-1][real], place[:-1][real], place[1:][real]

    def _border_ends_on_sides(self, f: Ints) -> list[tuple[Ints, Floats]]:
        """Return facets and coordinates a of lines at which borders meet the sides where lines begin or end."""
        t, found = np.linspace(0.0, 1.0, ASKED), []
        for end in (0.0, 1.0):
            grid = np.tile(t, (len(f), 1))
            levels = self._levels(f, self._local(grid, np.full_like(grid, end))[0])
            for b in range(len(levels)):

                def level(line: Ints, a: Floats, b: int = b, end: float = end) -> Floats:
                    return self._level(b, f[line], a, np.full_like(a, end))

                line, *between = _find_sign_changes(levels[b], t, level)
                found.append((f[line], _bisect(partial(level, line), *between)))
        return found

    def _turning_points_and_crossings(self, f: Ints) -> list[tuple[Ints, Floats]]:
        """Return facets and coordinates a of lines at which borders turn back or intersect, by Newton's method."""
        seeds, h, count = np.linspace(0.1, 0.9, 5), 1e-4, len(self.condition.borders)
        a0, b0 = (np.tile(t.ravel(), len(f)) for t in np.meshgrid(seeds, seeds))
        own, found = np.repeat(f, 25), []

        def turns(i: int) -> Callable[[Floats, Floats], tuple[Floats, Floats]]:
            def both(a: Floats, b: Floats) -> tuple[Floats, Floats]:
                up, down = self._level(i, own, a, b + h), self._level(i, own, a, b - h)
                return self._level(i, own, a, b), (up - down) / (2 * h)

            return both

        def meet(i: int, j: int) -> Callable[[Floats, Floats], tuple[Floats, Floats]]:
            return lambda a, b: (self._level(i, own, a, b), self._level(j, own, a, b))

        systems = [turns(i) for i in range(count)] + [meet(i, j) for i in range(count) for j in range(i)]
        for system in systems:
            a, moved = _newton(system, a0, b0, h)
            fine = moved & (a > 0.0) & (a < 1.0)
            _, first = np.unique(np.stack([own[fine], np.round(a[fine], 7)]), axis=1, return_index=True)
            found.append((own[fine][first], a[fine][first]))
        return found

    def _integrate_panels(
        self, f: Ints, low: Floats, high: Floats, n: int
    ) -> tuple[Floats, tuple[Ints, Floats, Floats]]:
        """Return the area and first moments (n, 3) of the selected parts of n strips, and their quadrature points.

        The points are given by their strip (p,), local coordinates (p, 2) and weights (p,). Lines are denser towards
        both ends, where the length of a chord may grow as a square root.
        """
        x, v = np.polynomial.legendre.leggauss(n)
        t, v = 0.5 * (x + 1.0), 0.5 * v
        a = (low[:, None] + (high - low)[:, None] * t**2 * (3.0 - 2.0 * t)).ravel()
        weight = ((high - low)[:, None] * v * 6.0 * t * (1.0 - t)).ravel()
        line, begin, end = self._selected_intervals(np.repeat(f, n), a)
        y, u = np.polynomial.legendre.leggauss(ALONG)
        b = 0.5 * (begin + end)[:, None] + 0.5 * (end - begin)[:, None] * y
        w = weight[line][:, None] * 0.5 * (end - begin)[:, None] * u
        xi, dw = self._local(np.broadcast_to(a[line][:, None], b.shape), b)
        w, strip = w * dw, np.repeat(line // n, ALONG)
        powers = (np.ones_like(b), xi[..., 0], xi[..., 1])
        parts = [np.bincount(strip, (w * m).ravel(), minlength=len(f)) for m in powers]
        return np.stack(parts, axis=1), (strip, xi.reshape(-1, 2), w.ravel())

    def _local(self, a: Floats, b: Floats) -> tuple[Floats, Floats]:
        """Return the local coordinates of points at the positions b along the lines a, and the local area of da db.

        Both a and b run from 0 to 1.
        """
        if self._square:
            return np.stack([2 * b - 1, 2 * a - 1], axis=-1), np.full_like(a, 4.0)
        return np.stack([(1 - a) * b, a], axis=-1), 1.0 - a

    def _selected_intervals(self, f: Ints, a: Floats) -> tuple[Ints, Floats, Floats]:
        """Return the intervals of sweep lines that the condition selects: index of the line, begin and end of each
        interval.

        Line i lies on facet f[i], at the local coordinate a[i]; f and a are (l,). Begin and end are positions along the
        line,
        from 0 to 1.
        """
        n, t = len(f), np.linspace(0.0, 1.0, ASKED)
        grid = np.broadcast_to(t, (n, ASKED))
        levels = self._levels(f, self._local(np.broadcast_to(a[:, None], grid.shape), grid)[0])  # (b, m, l)
        lines, cuts = [np.arange(n), np.arange(n)], [np.zeros(n), np.ones(n)]
        for b in range(len(levels)):

            def level(line: Ints, place: Floats, b: int = b) -> Floats:
                return self._level(b, f[line], a[line], place)

            line, *between = _find_sign_changes(levels[b], t, level)
            lines.append(line)
            cuts.append(_bisect(partial(level, line), *between))
        line, cut = np.concatenate(lines), np.concatenate(cuts)
        order = np.lexsort((cut, line))
        line, cut = line[order], cut[order]
        real = (line[:-1] == line[1:]) & (cut[1:] > cut[:-1])
        line, begin, end = line[:-1][real], cut[:-1][real], cut[1:][real]
        middle = self._local(a[line][:, None], 0.5 * (begin + end)[:, None])[0]
        sides = self._levels(f[line], middle)
        through = self.through[:, None, f[line]]  # on a cut facet no point counts as on the border
        sides = np.where(through, np.sign(sides) * 1e300, sides)
        inside = np.broadcast_to(self.condition.holds_for_levels([*sides], self.extent), (1, len(line)))[0]
        return line[inside], begin[inside], end[inside]

    def _level(self, b: int, f: Ints, a: Floats, places: Floats) -> Floats:
        """Return the level of border b at one position on each of the lines a (l,) of facets f."""
        x, y, z = self._places(f, self._local(a[:, None], places[:, None])[0])
        with np.errstate(all="ignore"):
            level = np.broadcast_to(self.condition.borders[b].at(x, y, z), (1, len(f)))[0]
        found: Floats = np.where(self.settled[f, b], self.settling[f, b], level)
        return found


def _find_sign_changes(
    level: Floats, t: Floats, at: Callable[[Ints, Floats], Floats]
) -> tuple[Ints, Floats, Floats, Floats]:
    """Return where a level (m, l) changes its sign along lines: the lines (c,), the two positions, and the sign before.

    `t` (m,) are the positions on the lines. Where a level only approaches zero, the minimum of a parabola shows
    whether it crosses zero.
    """
    sign = np.where(level >= 0.0, 1.0, -1.0)
    i, line = np.nonzero(sign[:-1] * sign[1:] < 0.0)
    found = [(line, t[i], t[i + 1], sign[i, line])]
    size, step = np.abs(level), t[1] - t[0]
    near = (size[1:-1] <= size[:-2]) & (size[1:-1] <= size[2:])
    near &= (sign[1:-1] == sign[:-2]) & (sign[1:-1] == sign[2:])
    i, line = np.nonzero(near)
    before, here, after = level[i, line], level[i + 1, line], level[i + 2, line]
    bend = before - 2.0 * here + after
    low = t[i + 1] + 0.5 * step * np.clip((before - after) / np.where(bend == 0.0, 1.0, bend), -1.0, 1.0)
    beyond = at(line, low) * sign[i + 1, line] < 0.0
    i, line, low = i[beyond], line[beyond], low[beyond]
    found += [(line, t[i], low, sign[i, line]), (line, low, t[i + 2], -sign[i, line])]
    lines, begins, ends, signs = (np.concatenate(column) for column in zip(*found, strict=True))
    return lines, begins, ends, signs


def _bisect(level: Callable[[Floats], Floats], low: Floats, high: Floats, sign: Floats) -> Floats:
    """Return positions at which a level changes the sign it has at `low`, by bisection and secant steps."""
    for _ in range(20 if len(low) else 0):
        middle = 0.5 * (low + high)
        same = np.where(level(middle) >= 0.0, 1.0, -1.0) == sign
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    before, behind = level(low), level(high)
    apart = np.where(before == behind, 1.0, before - behind)
    found: Floats = low + np.clip(before / apart, 0.0, 1.0) * (high - low)
    return found


def _newton(
    system: Callable[[Floats, Floats], tuple[Floats, Floats]], a: Floats, b: Floats, h: float
) -> tuple[Floats, Any]:
    """Return the coordinate a of the roots of two functions of (a, b), and a mask of the roots within the facet."""
    with np.errstate(all="ignore"):
        for _ in range(14):
            (g, k), da, db = system(a, b), system(a + h, b), system(a, b + h)
            ga, gb, ka, kb = (da[0] - g) / h, (db[0] - g) / h, (da[1] - k) / h, (db[1] - k) / h
            det = ga * kb - gb * ka
            det = np.where(np.abs(det) > 1e-12 * (np.abs(ga * kb) + np.abs(gb * ka)), det, np.nan)
            one, two = (g * kb - k * gb) / det, (k * ga - g * ka) / det
            long = np.maximum(1.0, np.hypot(one, two) / 0.5)
            a, b = a - one / long, b - two / long
    return a, np.isfinite(a) & (np.hypot(one, two) < 1e-8) & (b > -1e-6) & (b < 1.0 + 1e-6)
