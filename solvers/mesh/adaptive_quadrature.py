"""Adaptive quadrature over the cells of a mesh, for functions that vary within cells more than Gauss points can see.

The reference cell is halved along one of its edges, and its halves again, until two rules agree in every part and
bounds of the function over a part leave no room for a feature between the points. Source of the scheme: Berntsen,
Espelid and Genz (1991), "An adaptive algorithm for the approximate calculation of multiple integrals"; bounds by
interval arithmetic are those of Moore (1966).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import combinations, product

import numpy as np

from softmark.records import dataclass
from softmark.solvers.elements import CELLS
from softmark.solvers.elements.boundary_facets import Tri3, Tri6
from softmark.solvers.elements.element import Element
from softmark.solvers.elements.reference_cells import determinants
from softmark.solvers.elements.reference_wedge import wedge_rule
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh
from softmark.solvers.mesh.quadrature_parts import Bools, CellTotals, Integrals, Parts

Values = Callable[[Floats], Floats]  # of points (n, 3), m: values of g functions (g, n)
Bounds = Callable[[Floats, Floats], tuple[Floats, Floats]]  # of boxes (n, 3), m: least and largest values (g, n)

ROUNDS = 48  # times that parts are halved
BULGE = 0.1  # of the extent of a part: how far curved sides may reach beyond its vertices
VISIBLE = 0.5  # of the range of the values seen in a part: bounds that exceed it by less hide nothing of weight
STRAIGHT = 1e-12  # of the extent of a mesh: how far nodes may lie from the middle between corners
SLABS = 4  # that a part is cut into, along each edge, to see which way bounds become narrowest
CLOSER = (
    3  # times that a part is halved for narrower bounds: those of its bounding box are wide, of tetrahedra above all
)
LATTICE = 16384  # points that see whether few parts miss much of a cell
PLASTIC = 1.2207440846057596  # root of x^4 = x + 1, whose powers make an even lattice in three dimensions
BATCH = 4000  # parts that are looked at together: 50 MB of shape functions

# Edges of the reference cell that are parallel: a part is halved across one of these bundles.
BUNDLES: dict[str, tuple[tuple[tuple[int, int], ...], ...]] = {
    "hexahedra": (
        ((0, 1), (3, 2), (4, 5), (7, 6)), ((0, 3), (1, 2), (4, 7), (5, 6)), ((0, 4), (1, 5), (2, 6), (3, 7)),
    ),
    "wedges": (((0, 1), (3, 4)), ((1, 2), (4, 5)), ((2, 0), (5, 3)), ((0, 3), (1, 4), (2, 5))),
    "tetrahedra": (((0, 1),), ((1, 2),), ((0, 2),), ((0, 3),), ((1, 3),), ((2, 3),)),
}  # fmt: skip

# A coarse and a fine rule of slices of tetrahedra, which narrow to an edge or a point and need two degrees more along.
SLICES = wedge_rule((1 / 6 + 0.5 * np.array(Tri3.rim), np.full(3, 1 / 6)), 3), wedge_rule(Tri6.quadrature(), 4)


@dataclass(frozen=True)
class FineRule:
    """Quadrature points of some cells, sorted by cell: `cell` (n,), local points `xi` (n, 3), volumes `w` (n,), m^3.

    `values` (g, n) are the functions at the points. `error` (g, m) estimates by how much the integral of each function
    over each cell is off, and `hidden` (g, m) bounds what the points cannot see by the bounds of the function.
    """

    cell: Ints
    xi: Floats
    w: Floats
    values: Floats
    error: Floats
    hidden: Floats


def family_of(element: type[Element]) -> str:
    """The reference cell of an element: `hexahedra`, `wedges` or `tetrahedra`."""
    return {8: "hexahedra", 6: "wedges", 4: "tetrahedra"}[element.corners]


def rules_of(element: type[Element]) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
    """A coarse and a fine rule of the reference cell, of degrees 3 and 5 (2 and 5 in tetrahedra, 2 and 4 in wedges)."""
    family = family_of(element)
    if family == "hexahedra":
        return CELLS["hex8"].quadrature(), CELLS["hex20"].quadrature()
    pair = ("tet10", "tet4") if family == "tetrahedra" else ("wedge15", "wedge6")
    return CELLS[pair[0]].quadrature(), CELLS[pair[1]].mass_quadrature()


def adaptive_rule(
    mesh: Mesh, values: Values, bounds: Bounds, tolerance: float, most: int, axes: Floats, floor: Floats, degree: int,
) -> FineRule:  # fmt: skip
    """Quadrature points in every cell by which functions (g of them) are integrated to a tolerance.

    `tolerance` is relative to the integral of each function's magnitude over its cell, `most` the number of parts in
    all. `axes` (3,) is 1 along coordinates that the functions depend on and else 0. `floor` (g,) is added to the
    magnitude of each function, in its unit: a function that vanishes in a cell needs no relative accuracy. Each part is
    given points that are exact for polynomials of a `degree` of five at most.
    """
    element, count = mesh.element, len(mesh.cells)
    grid = whole_cells = _CellFunctions(mesh, values, bounds, axes)
    whole = np.broadcast_to(element.places()[: element.corners], (count, element.corners, 3)).copy()
    parts, magnitudes = Parts(np.arange(count), whole), np.maximum(floor, 1e-300)
    found = grid.integrate(parts)
    totals = CellTotals(found, floor, tolerance)
    for turn in range(ROUNDS + 1):
        rough = totals.find_rough(parts, found)
        if turn == ROUNDS:
            rough[:] = False
        room = most - totals.taken - len(parts)
        if rough.sum() > room:
            rough = _keep_worst(rough, totals.excess(parts, found), room)
        totals.accept(parts[~rough], found[~rough])
        parts = parts[rough]
        if not len(parts):
            break
        if turn == 0 and element.corners == 4:
            parts, grid = grid.slices(parts, magnitudes), _CellFunctions(mesh, values, bounds, axes, sliced=True)
        else:
            parts = grid.halved(parts, magnitudes)
        found = grid.integrate(parts)
        totals.enlarge_cells(parts, found)
    rule = _join_rules([(whole_cells, totals.done[:1]), (grid, totals.done[1:])], count, degree, totals)
    much = totals.cells_with_much_hidden()
    return replace(rule, hidden=whole_cells.sampled_again(rule, much)) if len(much) else rule


def _keep_worst(rough: Bools, excess: Floats, room: int) -> Bools:
    """Return the worst of the rough parts (n,), as many as there is room for."""
    worst = np.where(rough, excess, 0.0)
    chosen = np.zeros_like(rough)
    chosen[np.argsort(worst)[::-1][: max(0, room)]] = True
    return chosen & (worst > 0.0)


def _join_rules(
    done: list[tuple[_CellFunctions, list[Parts]]], count: int, degree: int, totals: CellTotals
) -> FineRule:
    """The points of all parts: by the fine rule in cells with few, else by the coarse where that is of the degree."""
    parts = np.concatenate([own.cell for _, each in done for own in each])
    often, found = np.bincount(parts, minlength=count), []
    for grid, each in done:
        enough = degree <= (3 if family_of(grid.linear) == "hexahedra" else 2)
        for own in each:
            found += list(grid.points(own, (often[own.cell] > FEW) & enough))
    cells, xis, ws, values = zip(*found, strict=True)
    cell = np.concatenate(cells)
    order = np.argsort(cell, kind="stable")
    return FineRule(cell[order], np.concatenate(xis)[order], np.concatenate(ws)[order],
                    np.concatenate(values, axis=1)[:, order], totals.errors, totals.hidden)  # fmt: skip


def closed_rule(element: type[Element]) -> tuple[Floats, Floats]:
    """A rule of degree 3 with points at the corners of the reference cell, midway between any two, and in its centre.

    In hexahedra it is Simpson's. Weights may be negative: it is only compared with others.
    """
    corners = element.places()[: element.corners]
    middles = [0.5 * (a + b) for a, b in combinations(corners, 2)]
    points = np.unique(np.round([*corners, *middles, corners.mean(axis=0)], 12), axis=0)
    if element.corners == 8:
        return points, np.prod(np.where(points == 0.0, 4.0, 1.0), axis=1) / 27.0
    xi, w = rules_of(element)[1]
    powers = [p for p in product(range(4), repeat=3) if sum(p) <= 3]
    rows, known = (np.array([np.prod(x ** np.array(p), axis=1) for p in powers]) for x in (points, xi))
    found: Floats = np.linalg.lstsq(rows, known @ w, rcond=1e-12)[0]
    return points, found


def lattice_points(element: type[Element]) -> Floats:
    """LATTICE points (n, 3) that are spread evenly over the reference cell, by multiples of irrational numbers."""
    t = (0.5 + np.arange(1, LATTICE + 1)[:, None] * PLASTIC ** -np.arange(1.0, 4.0)) % 1.0
    if element.corners == 8:
        return 2.0 * t - 1.0
    if element.corners == 6:
        x, y = np.sort(t[:, :2], axis=1).T
        return np.stack([x, 1.0 - y, 2.0 * t[:, 2] - 1.0], axis=1)
    ordered = np.sort(t, axis=1)
    return np.diff(ordered, axis=1, prepend=0.0)


def drop_straight_midnodes(mesh: Mesh) -> Mesh:
    """Return the mesh with corner nodes only if all other nodes lie midway between corners; else the mesh itself."""
    element = mesh.element
    if element.linear == mesh.kind:
        return mesh
    corners = mesh.points[mesh.cells[:, : element.corners]]
    middles = np.stack([corners[:, list(ends)].mean(axis=1) for ends in element.between], axis=1)
    off = np.abs(middles - mesh.points[mesh.cells[:, element.corners :]]).max(initial=0.0)
    return (
        Mesh(mesh.points, mesh.cells[:, : element.corners], element.linear) if off <= STRAIGHT * mesh.extent else mesh
    )


def _affine_maps(mesh: Mesh) -> Floats | None:
    """x = r_0 + xi R of every cell, as rows r_0 and R (m, 4, 3), m; None where a cell is not mapped like that."""
    local = mesh.element.places()
    rows = np.column_stack([np.ones(len(local)), local])
    corners = mesh.points[mesh.cells]
    found: Floats = np.linalg.pinv(rows) @ corners
    off = np.abs(rows @ found - corners).max(initial=0.0)
    return found if off <= STRAIGHT * mesh.extent else None


def _excess_over_samples(bounds: tuple[Floats, Floats], least: Floats, largest: Floats) -> Floats:
    """Return by how much bounds (g, n) exceed the extremes of sampled values; 0 where the excess is negligible."""
    low, high = bounds
    beyond = np.maximum(high - largest, 0.0) + np.maximum(least - low, 0.0)
    known = np.isfinite(beyond)  # else nothing is known of it
    return np.where(known & (beyond > VISIBLE * (largest - least)), beyond, 0.0)


class _CellFunctions:
    """Functions over parts of the cells of a mesh."""

    def __init__(self, mesh: Mesh, values: Values, bounds: Bounds, axes: Floats, sliced: bool = False) -> None:
        self.values, self.bounds, self.axes, self.sliced = values, bounds, axes, sliced
        self.mesh = drop_straight_midnodes(mesh)  # whose shape functions are fewer
        self.element = self.mesh.element
        self.scale = 2.0 / np.ptp(self.element.places(), axis=0)
        self.linear = CELLS["wedge6" if sliced else self.element.linear]
        self.affine = _affine_maps(self.mesh)
        self.coarse, self.fine = SLICES if sliced else rules_of(self.element)
        rules = (self.fine, self.coarse, closed_rule(self.linear))
        self.all = np.concatenate([xi for xi, _ in rules]), np.ones(sum(len(w) for _, w in rules))
        n = [len(w) for _, w in rules]
        weights = np.zeros((3, sum(n)))  # of each rule at all points
        for row, (_, w), end in zip(weights, rules, np.cumsum(n), strict=True):
            row[end - len(w) : end] = w
        self.weights, self.others = weights[0], weights[0] - weights[1:]
        self.bundles = [np.array(b) for b in BUNDLES[family_of(self.linear)]]

    def places(self, cell: Ints, xi: Floats) -> Floats:
        """Positions (n, q, 3), m, of local points xi (n, q, 3) in cells (n,)."""
        if self.affine is not None:
            return np.asarray(self.affine[cell, :1] + xi @ self.affine[cell, 1:])
        N = self.element.shape(xi.reshape(-1, 3)).reshape(*xi.shape[:2], -1)
        return np.asarray(N @ self.mesh.points[self.mesh.cells[cell]])

    def within(self, parts: Parts, rule: tuple[Floats, Floats]) -> tuple[Floats, Floats, Floats]:
        """Local points (n, q, 3), positions (n, q, 3) in m and volumes (n, q) in m^3 of a rule in every part."""
        xi = self.linear.shape(rule[0]) @ parts.vertices
        known = rule[0] if self.sliced else np.array([self.linear.centre])  # other parts are mapped by one matrix
        edges = parts.vertices.swapaxes(1, 2)[:, None] @ self.linear.gradient(known)
        share = np.abs(determinants(edges.swapaxes(2, 3)))
        if self.affine is not None:
            size = share * determinants(self.affine[parts.cell, 1:])[:, None]
            return xi, self.places(parts.cell, xi), size * rule[1]
        dN = self.element.gradient(xi.reshape(-1, 3)).reshape(*xi.shape[:2], -1, 3)
        corners = self.mesh.points[self.mesh.cells[parts.cell]]
        J = corners.swapaxes(1, 2)[:, None] @ dN
        w = rule[1] * share * determinants(J.swapaxes(2, 3))
        return xi, self.places(parts.cell, xi), w

    def at(self, X: Floats) -> Floats:
        """Values (g, n, q) at points (n, q, 3), m."""
        found = self.values(X.reshape(-1, 3))
        return found.reshape(len(found), *X.shape[:2])

    def box(self, parts: Parts) -> tuple[Floats, Floats]:
        """Bounding boxes (n, 3) of parts, m."""
        X = self.places(parts.cell, parts.vertices)
        low, high = X.min(axis=1), X.max(axis=1)
        if self.element.order > 1:
            reach = BULGE * (high - low)
            low, high = low - reach, high + reach
        return low, high

    def integrate(self, parts: Parts) -> Integrals:
        """Integrate the functions over any number of parts, and compare the rules."""
        groups = range(0, len(parts), BATCH)
        return Integrals.joined([self._integrate(parts[at : at + BATCH]) for at in groups])

    def _integrate(self, parts: Parts) -> Integrals:
        """Compare the fine rule with the others in a few parts.

        A function that is odd about the middle of a part has the same integral by any symmetric rule, but is not seen
        by it unless it is a polynomial; times a coordinate it is even.
        """
        xi, X, v = self.within(parts, self.all)
        c = self.at(X)
        weighed = c * v
        volume = np.abs(v @ self.weights)
        off = np.einsum("gnq,rq->grn", weighed, self.others, optimize=True)
        error = np.abs(off).max(axis=1)
        xi = (xi - parts.vertices.mean(axis=1, keepdims=True)) * self.scale
        for other in self.others:
            moments = np.einsum("gnq,nqi->gni", weighed * other, xi, optimize=True)
            error = np.maximum(error, np.abs(moments).max(axis=2))
        seen = c[..., : len(self.fine[1]) + len(self.coarse[1])] if self.sliced else c  # slices may end without an area
        least, largest = seen.min(axis=2), seen.max(axis=2)
        beyond = _excess_over_samples(self.bounds(*self.box(parts)), least, largest)
        wide = np.flatnonzero((beyond > 0.0).any(axis=0))
        if len(wide):
            closer = self.closer_bounds(parts[wide])
            beyond[:, wide] = _excess_over_samples(closer, least[:, wide], largest[:, wide])
        return Integrals(np.abs(weighed) @ self.weights, volume, off, error, beyond * volume)

    def sampled_again(self, rule: FineRule, cells: Ints) -> Floats:
        """Return what the points of a rule may miss (g, m), by points of a lattice in `cells` that have too few parts.

        Bounds of parts say what could be missed at most, which is far more than is. They stay where the values of
        many points do not reach the bounds of the function over the cell.
        """
        hidden = rule.hidden.copy()
        xi = lattice_points(self.element)
        corners = self.linear.places()
        for cell in cells:
            one = Parts(np.array([cell]), corners[None])
            _, X, v = self.within(one, (xi, np.full(len(xi), self.fine[1].sum() / len(xi))))
            c = self.at(X)[:, 0]
            if _excess_over_samples(
                self.bounds(*self.box(one)), c.min(axis=1, keepdims=True), c.max(axis=1, keepdims=True)
            ).any():
                continue
            own = slice(*np.searchsorted(rule.cell, [cell, cell + 1]))
            halves = np.stack([2.0 * (c * v[0])[:, k::2].sum(axis=1) for k in (0, 1)])
            off = np.abs(halves.mean(axis=0) - rule.values[:, own] @ rule.w[own]) + np.abs(halves[0] - halves[1])
            hidden[:, cell] = np.minimum(hidden[:, cell], off)
        return hidden

    def closer_bounds(self, parts: Parts) -> tuple[Floats, Floats]:
        """Bounds of the functions over parts (g, n), from those over eight pieces of each."""
        pieces = parts
        for _ in range(CLOSER):
            pieces = self.bisected(pieces)
        low, high = self.bounds(*self.box(pieces))
        each = (len(low), len(parts), 2**CLOSER)
        return low.reshape(each).min(axis=2), high.reshape(each).max(axis=2)

    def bisected(self, parts: Parts) -> Parts:
        """Both halves of each part, one behind the other, cut across the edges that are longest along `axes`."""
        X = self.places(parts.cell, parts.vertices)
        ends = [b.T for b in self.bundles]
        length = np.array([(np.abs(X[:, b] - X[:, a]).max(axis=1) * self.axes).max(axis=1) for a, b in ends])
        which = length.argmax(axis=0)
        halves = np.repeat(parts.vertices[:, None], 2, axis=1)
        for k, (a, b) in enumerate(ends):
            some = np.flatnonzero(which == k)
            middle = 0.5 * (parts.vertices[some[:, None], a] + parts.vertices[some[:, None], b])
            halves[some[:, None], 0, b] = halves[some[:, None], 1, a] = middle
        return Parts(np.repeat(parts.cell, 2), halves.reshape(-1, *parts.vertices.shape[1:]))

    def halved(self, parts: Parts, size: Floats) -> Parts:
        """Both halves of each part, cut where bounds of the functions become narrowest, else across the longest edge.

        `size` (g,) is the order of magnitude of each function.
        """
        if not len(parts):
            return parts
        found = [self._halved(parts[at : at + BATCH], size) for at in range(0, len(parts), BATCH)]
        return Parts(np.concatenate([p.cell for p in found]), np.concatenate([p.vertices for p in found]))

    def slices(self, parts: Parts, size: Floats) -> Parts:
        """Cut tetrahedra into wedges between parallel planes through their vertices; some edges have no length.

        The planes are across the axis of the space along which slabs of the bounding box have the narrowest bounds.
        Halves of such wedges are slabs of a function that varies along that axis; those of tetrahedra are not.
        """
        low, high = self.box(parts)
        width = np.zeros((3, len(parts)))
        for axis in range(3):
            for k in range(SLABS):
                a, b = low.copy(), high.copy()
                a[:, axis] += k / SLABS * (high - low)[:, axis]
                b[:, axis] -= (1.0 - (k + 1) / SLABS) * (high - low)[:, axis]
                least, most = self.bounds(a, b)
                with np.errstate(invalid="ignore"):
                    width[axis] += (np.nan_to_num(most - least, nan=0.0, posinf=1e300) / size[:, None]).sum(axis=0)
        near = (width <= 1.05 * width.min(axis=0)).T * self.axes  # as good: that along which it is longest
        axis = ((high - low) * near + 1e-300 * self.axes).argmax(axis=1)
        rows = np.arange(len(parts))
        height = self.places(parts.cell, parts.vertices)[rows, :, axis]
        order = height.argsort(axis=1)
        s = np.take_along_axis(height, order, axis=1)
        v = np.take_along_axis(parts.vertices, order[:, :, None], axis=1)
        a, b, c, d = v.swapaxes(0, 1)

        def on(i: int, j: int, k: int) -> Floats:  # the edge from vertex i to j, as high as vertex k
            span = s[:, j] - s[:, i]
            t = (s[:, k] - s[:, i]) / np.where(span > 0.0, span, 1.0)
            return np.asarray(v[:, i] + t[:, None] * (v[:, j] - v[:, i]))

        p, q, r, t = on(0, 2, 1), on(0, 3, 1), on(1, 3, 2), on(0, 3, 2)
        found = np.stack([np.stack(each, axis=1) for each in (
            (a, a, a, b, p, q), (b, p, q, c, c, t), (b, q, b, c, t, r), (c, r, t, d, d, d),
        )], axis=1)  # fmt: skip
        thick = np.diff(s, axis=1)[:, [0, 1, 1, 2]] > STRAIGHT * (s[:, -1:] - s[:, :1])
        return Parts(np.repeat(parts.cell, 4)[thick.ravel()], found.reshape(-1, 6, 3)[thick.ravel()])

    def _halved(self, parts: Parts, size: Floats) -> Parts:
        X = self.places(parts.cell, parts.vertices)
        widths, lengths, halves = [], [], []
        for bundle in self.bundles:
            a, b = bundle.T
            middle = 0.5 * (parts.vertices[:, a] + parts.vertices[:, b])
            one, other = parts.vertices.copy(), parts.vertices.copy()
            one[:, b], other[:, a] = middle, middle
            halves.append((one, other))
            width = np.zeros(len(parts))
            for k in range(SLABS):  # halves alone do not tell where a peak lies in the middle, or waves are short
                slab = parts.vertices.copy()
                slab[:, a] += k / SLABS * (parts.vertices[:, b] - parts.vertices[:, a])
                slab[:, b] -= (1.0 - (k + 1) / SLABS) * (parts.vertices[:, b] - parts.vertices[:, a])
                low, high = self.bounds(*self.box(Parts(parts.cell, slab)))
                with np.errstate(invalid="ignore"):
                    width = width + (np.nan_to_num(high - low, nan=0.0, posinf=1e300) / size[:, None]).sum(axis=0)
            widths.append(width)
            lengths.append((np.abs(X[:, b] - X[:, a]).max(axis=1) * self.axes).max(axis=1))
        width, length = np.array(widths), np.array(lengths)
        length /= np.maximum(length.max(axis=0), 1e-300)
        near = width <= 1.05 * width.min(axis=0)  # as good: the longest of these
        which = np.where(near, length, -1.0).argmax(axis=0)
        every = np.array(halves)  # (d, 2, n, v, 3)
        rows = np.arange(len(parts))
        return Parts(np.repeat(parts.cell, 2), every[which, :, rows].reshape(-1, *parts.vertices.shape[1:]))

    def points(self, parts: Parts, many: Bools) -> Iterator[tuple[Ints, Floats, Floats, Floats]]:
        """Yield cells, local points, volumes and values by the fine rule, in parts that are `many` by the coarse."""
        for which, rule in ((~many, self.fine), (many, self.coarse)):
            some = parts[which]
            for at in range(0, len(some), BATCH):
                xi, X, w = self.within(some[at : at + BATCH], rule)
                cell = np.repeat(some.cell[at : at + BATCH], w.shape[1])
                yield cell, xi.reshape(-1, 3), w.ravel(), self.values(X.reshape(-1, 3))


FEW = 16  # parts of a cell up to which each has the fine rule
