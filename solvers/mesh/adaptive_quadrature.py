"""Adaptive quadrature over the cells of a mesh, for functions that vary between the Gauss points of a cell.

The reference cell is halved across one of its edges, and the halves are halved again. Each piece is called a part of
the cell. Halving ends when two quadrature rules agree in every part and when bounds of the function over a part exclude
a peak between the points.
Source: Berntsen, Espelid and Genz (1991), "An adaptive algorithm for the approximate calculation of multiple
integrals"; bounds by interval arithmetic: Moore (1966).
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

Values = Callable[[Floats], Floats]  # maps points (n, 3), m, to values of g functions (g, n)
Bounds = Callable[[Floats, Floats], tuple[Floats, Floats]]  # maps corners of boxes (n, 3), m, to bounds (g, n)

ROUNDS = 48  # largest number of times that a part is halved
BULGE = 0.1  # relative to a part's extent: how far curved sides may reach beyond its vertices
VISIBLE = 0.5  # relative to the range of the samples in a part: bounds that exceed it by less are close enough
STRAIGHT = 1e-12  # relative to a mesh's extent: how far nodes may lie from the middle between corners
SLABS = 4  # number of slabs of a part, in each direction, whose bounds are compared to choose the cut
CLOSER = (
    3  # number of times that a part is halved for tighter bounds: its bounding box, above all a tetrahedron's, is large
)
LATTICE = 16384  # points used to check whether the rule of a cell with few parts misses a peak
PLASTIC = 1.2207440846057596  # root of x^4 = x + 1, whose powers make an even lattice in three dimensions
BATCH = 4000  # parts processed at once: 50 MB of shape functions

# Edges of the reference cell that are parallel: a part is halved across one of these bundles.
BUNDLES: dict[str, tuple[tuple[tuple[int, int], ...], ...]] = {
    "hexahedra": (
        ((0, 1), (3, 2), (4, 5), (7, 6)), ((0, 3), (1, 2), (4, 7), (5, 6)), ((0, 4), (1, 5), (2, 6), (3, 7)),
    ),
    "wedges": (((0, 1), (3, 4)), ((1, 2), (4, 5)), ((2, 0), (5, 3)), ((0, 3), (1, 4), (2, 5))),
    "tetrahedra": (((0, 1),), ((1, 2),), ((0, 2),), ((0, 3),), ((1, 3),), ((2, 3),)),
}  # fmt: skip

# Coarse and fine rule for slices of tetrahedra. Slices narrow to an edge or a point: two degrees more along the height.
SLICES = wedge_rule((1 / 6 + 0.5 * np.array(Tri3.rim), np.full(3, 1 / 6)), 3), wedge_rule(Tri6.quadrature(), 4)


@dataclass(frozen=True)
class FineRule:
    """Quadrature points of all m cells, sorted by cell, with error estimates for g functions.

    `cell` (n,) is the cell of each point, `xi` (n, 3) its local coordinates and `w` (n,) its volume, m^3. `values` (g,
    n) are the values of the functions at the points. `error` (g, m) estimates the error of the integral of each
    function over each cell. `hidden` (g, m) is an upper bound of the integral that peaks between the points contribute.
    """

    cell: Ints
    xi: Floats
    w: Floats
    values: Floats
    error: Floats
    hidden: Floats


def reference_cell_kind(element: type[Element]) -> str:
    """Return the kind of reference cell of an element: `hexahedra`, `wedges` or `tetrahedra`."""
    return {8: "hexahedra", 6: "wedges", 4: "tetrahedra"}[element.corners]


def rules_of(element: type[Element]) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
    """Return a coarse and a fine quadrature rule of an element's reference cell, each as points and weights.

    Their degrees are 3 and 5 in hexahedra, 2 and 5 in tetrahedra, 2 and 4 in wedges.
    """
    family = reference_cell_kind(element)
    if family == "hexahedra":
        return CELLS["hex8"].quadrature(), CELLS["hex20"].quadrature()
    pair = ("tet10", "tet4") if family == "tetrahedra" else ("wedge15", "wedge6")
    return CELLS[pair[0]].quadrature(), CELLS[pair[1]].mass_quadrature()


def adaptive_rule(
    mesh: Mesh, values: Values, bounds: Bounds, tolerance: float, most: int, axes: Floats, floor: Floats, degree: int,
) -> FineRule:  # fmt: skip
    """Return quadrature points in every cell that integrate the g functions `values` to a tolerance.

    Each cell is divided into parts until the tolerance is met. `values` returns the functions (g, n) at positions (n,
    3), m, and `bounds` their least and largest values over boxes. `tolerance` is relative to the integral of each
    function's magnitude over its cell. `most` is the largest total number of parts. `axes` (3,) is 1 for coordinates on
    which the functions depend, else 0. `floor` (g,) is added to the magnitude of each function, in the unit of the
    function, because a function that vanishes in a cell needs no relative accuracy. The points of each part are exact
    for polynomials of `degree`, at most five.
    """
    element, count = mesh.element, len(mesh.cells)
    grid = whole_cells = _CellFunctions(mesh, values, bounds, axes)
    whole = np.broadcast_to(element.places()[: element.corners], (count, element.corners, 3)).copy()
    parts, magnitudes = Parts(np.arange(count), whole), np.maximum(floor, 1e-300)
    found = grid.integrate(parts)
    totals = CellTotals(found, floor, tolerance)
    for turn in range(ROUNDS + 1):
        rough = totals.inaccurate_part_mask(parts, found)
        if turn == ROUNDS:
            rough[:] = False
        room = most - totals.taken - len(parts)
        if rough.sum() > room:
            rough = _mask_worst_parts(rough, totals.error_tolerance_ratio(parts, found), room)
        totals.accept(parts[~rough], found[~rough])
        parts = parts[rough]
        if not len(parts):
            break
        if turn == 0 and element.corners == 4:
            parts, grid = (
                grid.slice_tetrahedra(parts, magnitudes),
                _CellFunctions(mesh, values, bounds, axes, sliced=True),
            )
        else:
            parts = grid.bisect_by_bounds(parts, magnitudes)
        found = grid.integrate(parts)
        totals.enlarge_cells(parts, found)
    rule = _join_rules([(whole_cells, totals.done[:1]), (grid, totals.done[1:])], count, degree, totals)
    much = totals.cells_with_much_hidden()
    return replace(rule, hidden=whole_cells.resample_hidden(rule, much)) if len(much) else rule


def _mask_worst_parts(rough: Bools, excess: Floats, room: int) -> Bools:
    """Return a mask (n,) of the parts to halve if not all `rough` ones (a mask (n,)) can be halved.

    It marks at most `room` of the rough parts, those with the largest `excess` (n,) of error over tolerance.
    """
    worst = np.where(rough, excess, 0.0)
    chosen = np.zeros_like(rough)
    chosen[np.argsort(worst)[::-1][: max(0, room)]] = True
    return chosen & (worst > 0.0)


def _join_rules(
    done: list[tuple[_CellFunctions, list[Parts]]], count: int, degree: int, totals: CellTotals
) -> FineRule:
    """Return the quadrature points of all accepted parts as one rule.

    `done` pairs the functions with groups of accepted parts, `count` is the number of cells, and `totals` has the error
    estimates. Cells with few parts get the fine rule in each part. Cells with many parts get the coarse rule, if it is
    exact for polynomials of `degree`.
    """
    parts = np.concatenate([own.cell for _, each in done for own in each])
    often, found = np.bincount(parts, minlength=count), []
    for grid, each in done:
        enough = degree <= (3 if reference_cell_kind(grid.linear) == "hexahedra" else 2)
        for own in each:
            found += list(grid.points(own, (often[own.cell] > FEW) & enough))
    cells, xis, ws, values = zip(*found, strict=True)
    cell = np.concatenate(cells)
    order = np.argsort(cell, kind="stable")
    return FineRule(cell[order], np.concatenate(xis)[order], np.concatenate(ws)[order],
                    np.concatenate(values, axis=1)[:, order], totals.errors, totals.hidden)  # fmt: skip


def closed_rule(element: type[Element]) -> tuple[Floats, Floats]:
    """Return points (q, 3) and weights (q,) of a quadrature rule of degree 3 that includes the cell's corners.

    The points are the corners, the middles between each two corners, and the centre. In hexahedra it is Simpson's rule.
    Weights may be negative, because the rule is used only to estimate the error of another rule.
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
    """Return local points (LATTICE, 3) spread evenly over the reference cell, by multiples of irrational numbers."""
    t = (0.5 + np.arange(1, LATTICE + 1)[:, None] * PLASTIC ** -np.arange(1.0, 4.0)) % 1.0
    if element.corners == 8:
        return 2.0 * t - 1.0
    if element.corners == 6:
        x, y = np.sort(t[:, :2], axis=1).T
        return np.stack([x, 1.0 - y, 2.0 * t[:, 2] - 1.0], axis=1)
    ordered = np.sort(t, axis=1)
    return np.diff(ordered, axis=1, prepend=0.0)


def drop_straight_midnodes(mesh: Mesh) -> Mesh:
    """Return the mesh with corner nodes only, if all midside nodes lie midway between corners.

    Otherwise return the mesh unchanged.
    """
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
    """Return the affine map x = r_0 + xi R of every cell as an array (m, 4, 3), m; None if a map is not affine.

    The first of the four rows is r_0, and the others are R.
    """
    local = mesh.element.places()
    rows = np.column_stack([np.ones(len(local)), local])
    corners = mesh.points[mesh.cells]
    found: Floats = np.linalg.pinv(rows) @ corners
    off = np.abs(rows @ found - corners).max(initial=0.0)
    return found if off <= STRAIGHT * mesh.extent else None


def _excess_over_samples(bounds: tuple[Floats, Floats], least: Floats, largest: Floats) -> Floats:
    """Return how far bounds (g, n) of functions lie beyond the least and largest sampled values, as an array (g, n).

    An excess that is small compared with the range of the samples is set to 0.
    """
    low, high = bounds
    beyond = np.maximum(high - largest, 0.0) + np.maximum(least - low, 0.0)
    known = np.isfinite(beyond)  # infinite bounds give no information
    return np.where(known & (beyond > VISIBLE * (largest - least)), beyond, 0.0)


class _CellFunctions:
    """Functions to be integrated over parts of the cells of a mesh, with quadrature rules and ways to cut parts.

    If `sliced`, parts are wedges made of tetrahedra by `slices`, instead of pieces of the reference cell.
    """

    def __init__(self, mesh: Mesh, values: Values, bounds: Bounds, axes: Floats, sliced: bool = False) -> None:
        self.values, self.bounds, self.axes, self.sliced = values, bounds, axes, sliced
        self.mesh = drop_straight_midnodes(mesh)  # fewer shape functions are faster
        self.element = self.mesh.element
        self.scale = 2.0 / np.ptp(self.element.places(), axis=0)
        self.linear = CELLS["wedge6" if sliced else self.element.linear]
        self.affine = _affine_maps(self.mesh)
        self.coarse, self.fine = SLICES if sliced else rules_of(self.element)
        rules = (self.fine, self.coarse, closed_rule(self.linear))
        self.all = np.concatenate([xi for xi, _ in rules]), np.ones(sum(len(w) for _, w in rules))
        n = [len(w) for _, w in rules]
        weights = np.zeros((3, sum(n)))  # each row has the weights of one rule, and zeros at the points of the others
        for row, (_, w), end in zip(weights, rules, np.cumsum(n), strict=True):
            row[end - len(w) : end] = w
        self.weights, self.others = weights[0], weights[0] - weights[1:]
        self.bundles = [np.array(b) for b in BUNDLES[reference_cell_kind(self.linear)]]

    def places(self, cell: Ints, xi: Floats) -> Floats:
        """Return the positions (n, q, 3), m, of local points xi (n, q, 3) in cells (n,)."""
        if self.affine is not None:
            return np.asarray(self.affine[cell, :1] + xi @ self.affine[cell, 1:])
        N = self.element.shape(xi.reshape(-1, 3)).reshape(*xi.shape[:2], -1)
        return np.asarray(N @ self.mesh.points[self.mesh.cells[cell]])

    def within(self, parts: Parts, rule: tuple[Floats, Floats]) -> tuple[Floats, Floats, Floats]:
        """Map the points and weights of a quadrature rule into every part.

        Return local points (n, q, 3), positions (n, q, 3), m, and weights (n, q), m^3, whose sum over a part is its
        volume.
        """
        xi = self.linear.shape(rule[0]) @ parts.vertices
        # maps of parts that are no slices are affine: one point suffices
        known = rule[0] if self.sliced else np.array([self.linear.centre])
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
        """Return the values (g, n, q) of the functions at positions X (n, q, 3), m."""
        found = self.values(X.reshape(-1, 3))
        return found.reshape(len(found), *X.shape[:2])

    def box(self, parts: Parts) -> tuple[Floats, Floats]:
        """Return the lowest and highest corner of the bounding box of each part, both (n, 3), m."""
        X = self.places(parts.cell, parts.vertices)
        low, high = X.min(axis=1), X.max(axis=1)
        if self.element.order > 1:
            reach = BULGE * (high - low)
            low, high = low - reach, high + reach
        return low, high

    def integrate(self, parts: Parts) -> Integrals:
        """Return the integrals of the functions over parts by several rules, with the differences between the rules."""
        groups = range(0, len(parts), BATCH)
        return Integrals.joined([self._integrate_batch(parts[at : at + BATCH]) for at in groups])

    def _integrate_batch(self, parts: Parts) -> Integrals:
        """Return the integrals of the functions over one batch of parts, with the differences from the fine rule.

        The integral of a function that is odd about the middle of a part vanishes in every symmetric rule, so the rules
        agree although they may miss the function. Its product with a coordinate is even, so such products are compared
        too.
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
            closer = self.tighten_bounds(parts[wide])
            beyond[:, wide] = _excess_over_samples(closer, least[:, wide], largest[:, wide])
        return Integrals(np.abs(weighed) @ self.weights, volume, off, error, beyond * volume)

    def resample_hidden(self, rule: FineRule, cells: Ints) -> Floats:
        """Return tighter bounds (g, m) of the integral that a rule may miss, updated in the given `cells`.

        In each of these cells the functions are summed over a lattice of many points and compared with the rule. The
        bounds of the rule overestimate the missed integral by far. They are kept only if the values at the lattice
        points do not come near the bounds of the functions over the cell.
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

    def tighten_bounds(self, parts: Parts) -> tuple[Floats, Floats]:
        """Return tighter lower and upper bounds (g, n) of the functions over parts, from eight pieces of each part."""
        pieces = parts
        for _ in range(CLOSER):
            pieces = self.bisect_longest_edges(pieces)
        low, high = self.bounds(*self.box(pieces))
        each = (len(low), len(parts), 2**CLOSER)
        return low.reshape(each).min(axis=2), high.reshape(each).max(axis=2)

    def bisect_longest_edges(self, parts: Parts) -> Parts:
        """Return both halves of each part, one after the other.

        A part is cut across the bundle of parallel edges that is longest along the coordinates in `axes`.
        """
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

    def bisect_by_bounds(self, parts: Parts, size: Floats) -> Parts:
        """Return both halves of each part, one after the other, cut where bounds of the functions become narrowest.

        A part is cut across one of its bundles of parallel edges: the one along which the bounds become narrowest, or
        the longest of several that are equally good. `size` (g,) is the order of magnitude of each function.
        """
        if not len(parts):
            return parts
        found = [self._bisect_batch_by_bounds(parts[at : at + BATCH], size) for at in range(0, len(parts), BATCH)]
        return Parts(np.concatenate([p.cell for p in found]), np.concatenate([p.vertices for p in found]))

    def slice_tetrahedra(self, parts: Parts, size: Floats) -> Parts:
        """Cut tetrahedra into wedges between parallel planes through their vertices.

        Some edges of these wedges have no length. The planes are normal to the coordinate axis along which slabs of the
        bounding box have the narrowest bounds. If a function varies along that axis, halves of the wedges are slabs of
        nearly constant value, while halves of tetrahedra are not. `size` (g,) is the order of magnitude of each
        function.
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
        near = (width <= 1.05 * width.min(axis=0)).T * self.axes  # of several equally good axes, the longest is taken
        axis = ((high - low) * near + 1e-300 * self.axes).argmax(axis=1)
        rows = np.arange(len(parts))
        height = self.places(parts.cell, parts.vertices)[rows, :, axis]
        order = height.argsort(axis=1)
        s = np.take_along_axis(height, order, axis=1)
        v = np.take_along_axis(parts.vertices, order[:, :, None], axis=1)
        a, b, c, d = v.swapaxes(0, 1)

        def on(i: int, j: int, k: int) -> Floats:  # point of the edge from vertex i to j at the height of vertex k
            span = s[:, j] - s[:, i]
            t = (s[:, k] - s[:, i]) / np.where(span > 0.0, span, 1.0)
            return np.asarray(v[:, i] + t[:, None] * (v[:, j] - v[:, i]))

        p, q, r, t = on(0, 2, 1), on(0, 3, 1), on(1, 3, 2), on(0, 3, 2)
        found = np.stack([np.stack(each, axis=1) for each in (
            (a, a, a, b, p, q), (b, p, q, c, c, t), (b, q, b, c, t, r), (c, r, t, d, d, d),
        )], axis=1)  # fmt: skip
        thick = np.diff(s, axis=1)[:, [0, 1, 1, 2]] > STRAIGHT * (s[:, -1:] - s[:, :1])
        return Parts(np.repeat(parts.cell, 4)[thick.ravel()], found.reshape(-1, 6, 3)[thick.ravel()])

    def _bisect_batch_by_bounds(self, parts: Parts, size: Floats) -> Parts:
        X = self.places(parts.cell, parts.vertices)
        widths, lengths, halves = [], [], []
        for bundle in self.bundles:
            a, b = bundle.T
            middle = 0.5 * (parts.vertices[:, a] + parts.vertices[:, b])
            one, other = parts.vertices.copy(), parts.vertices.copy()
            one[:, b], other[:, a] = middle, middle
            halves.append((one, other))
            width = np.zeros(len(parts))
            for k in range(SLABS):  # two halves would not reveal a peak in the middle or short waves
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
        near = width <= 1.05 * width.min(axis=0)  # of several equally good bundles, the longest is taken
        which = np.where(near, length, -1.0).argmax(axis=0)
        every = np.array(halves)  # (d, 2, n, v, 3)
        rows = np.arange(len(parts))
        return Parts(np.repeat(parts.cell, 2), every[which, :, rows].reshape(-1, *parts.vertices.shape[1:]))

    def points(self, parts: Parts, many: Bools) -> Iterator[tuple[Ints, Floats, Floats, Floats]]:
        """Yield the quadrature points of all parts in batches: cells, local points, weights and values.

        Shapes are (k,), (k, 3), (k,), m^3, and (g, k). Parts marked in the mask `many` (n,) get the coarse rule, all
        others the fine one. Points come in batches.
        """
        for which, rule in ((~many, self.fine), (many, self.coarse)):
            some = parts[which]
            for at in range(0, len(some), BATCH):
                xi, X, w = self.within(some[at : at + BATCH], rule)
                cell = np.repeat(some.cell[at : at + BATCH], w.shape[1])
                yield cell, xi.reshape(-1, 3), w.ravel(), self.values(X.reshape(-1, 3))


FEW = 16  # parts of a cell up to which each has the fine rule
