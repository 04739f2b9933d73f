"""Adaptive quadrature over the cells of a mesh, for functions that vary too fast within a cell for its Gauss points.

The reference cell is halved along one of its edges, and its halves again, until two rules agree in every part and
bounds of the function over a part exclude a feature between the points. Source of the scheme: Berntsen, Espelid and
Genz (1991), "An adaptive algorithm for the approximate calculation of multiple integrals"; bounds by interval
arithmetic are those of Moore (1966).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.elements import CELLS
from softmark.solvers.elements.element import Element
from softmark.solvers.elements.reference_cells import determinants
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh

Bools = Any  # (n,) of numpy
Values = Callable[[Floats], Floats]  # of points (n, 3), m: values of g functions (g, n)
Bounds = Callable[[Floats, Floats], tuple[Floats, Floats]]  # of boxes (n, 3), m: least and largest values (g, n)

ROUNDS = 48  # times that parts are halved
BULGE = 0.1  # bulge of curved sides beyond a part's vertices, relative to its extent
VISIBLE = 1.0  # relative to the range of sampled values: excess of the bounds that is accepted
STRAIGHT = 1e-12  # relative to the mesh extent: tolerance of midside nodes on straight edges
SLABS = 4  # pieces along each edge to find the best direction to halve a part
ALL_HIDDEN = 5.0  # relative to the tolerance: accepted hidden part of a cell
CLOSER = 3  # halvings for narrower bounds: those of a bounding box are wide, especially for tetrahedra
BATCH = 4000  # parts evaluated at once: 50 MB of shape functions

# Edges of the reference cell that are parallel: a part is halved across one of these bundles.
BUNDLES: dict[str, tuple[tuple[tuple[int, int], ...], ...]] = {
    "hexahedra": (
        ((0, 1), (3, 2), (4, 5), (7, 6)), ((0, 3), (1, 2), (4, 7), (5, 6)), ((0, 4), (1, 5), (2, 6), (3, 7)),
    ),
    "wedges": (((0, 1), (3, 4)), ((1, 2), (4, 5)), ((2, 0), (5, 3)), ((0, 3), (1, 4), (2, 5))),
    "tetrahedra": (((0, 1),), ((1, 2),), ((0, 2),), ((0, 3),), ((1, 3),), ((2, 3),)),
}  # fmt: skip


@dataclass(frozen=True)
class FineRule:
    """Quadrature points of some cells, sorted by cell: `cell` (n,), local points `xi` (n, 3), volumes `w` (n,), m^3.

    `values` (g, n) are the functions at the points. `error` (g, m) estimates the error of the integral of each function
    over each cell, and `hidden` (g, m) is the part that the points may miss, from bounds of the function.
    """

    cell: Ints
    xi: Floats
    w: Floats
    values: Floats
    error: Floats
    hidden: Floats


@dataclass
class _Parts:
    """Parts of reference cells: the cell of each, `cell` (n,), and its local `vertices` (n, v, 3)."""

    cell: Ints
    vertices: Floats

    def __getitem__(self, which: Any) -> _Parts:
        return _Parts(self.cell[which], self.vertices[which])

    def __len__(self) -> int:
        return len(self.cell)


def family_of(element: type[Element]) -> str:
    """Return the reference cell of an element: `hexahedra`, `wedges` or `tetrahedra`."""
    return {8: "hexahedra", 6: "wedges", 4: "tetrahedra"}[element.corners]


def rules_of(element: type[Element]) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
    """Return a coarse and a fine rule of the reference cell, degrees 3 and 5 (tetrahedra 2 and 5, wedges 2 and 4)."""
    family = family_of(element)
    if family == "hexahedra":
        return CELLS["hex8"].quadrature(), CELLS["hex20"].quadrature()
    pair = ("tet10", "tet4") if family == "tetrahedra" else ("wedge15", "wedge6")
    return CELLS[pair[0]].quadrature(), CELLS[pair[1]].mass_quadrature()


def adaptive_rule(
    mesh: Mesh, values: Values, bounds: Bounds, tolerance: float, most: int, axes: Floats, floor: Floats, degree: int,
) -> FineRule:  # fmt: skip
    """Return quadrature points in every cell that integrate g functions to a relative tolerance.

    `tolerance` is relative to the integral of each function's magnitude over its cell; `most` is the largest number of
    parts. `axes` (3,) is 1 for coordinates that the functions depend on and else 0. `floor` (g,) is added to the
    magnitude of each function, in its unit: a function that vanishes in a cell needs no relative accuracy. The points
    of each part are exact for polynomials of a `degree` of at most five.
    """
    element, count = mesh.element, len(mesh.cells)
    grid = _CellFunctions(mesh, values, bounds, axes)
    whole = np.broadcast_to(element.places()[: element.corners], (count, element.corners, 3)).copy()
    parts, done = _Parts(np.arange(count), whole), list[tuple[_Parts, Floats, Floats]]()
    size, left = np.zeros((len(floor), count)), np.zeros((len(floor), count))
    taken = 0
    for turn in range(ROUNDS + 1):
        seen = [grid.integrate_parts(parts[at : at + BATCH]) for at in range(0, len(parts), BATCH)]
        magnitude, volume, error, hidden = (np.concatenate(each, axis=-1) for each in zip(*seen, strict=True))
        if turn == 0:
            cells = volume
            size = magnitude + floor[:, None] * volume
        else:  # a peak found later increases the magnitude of its cell
            now = np.zeros_like(size)
            for g in range(len(floor)):
                now[g] = np.bincount(parts.cell, magnitude[g], minlength=count)
            size = np.maximum(size, now)
        share, part = tolerance * size[:, parts.cell], volume / cells[parts.cell]
        behind = np.array([np.bincount(parts.cell, h, minlength=count) for h in hidden]) + left
        many = (behind > ALL_HIDDEN * tolerance * size)[:, parts.cell] & (hidden > ALL_HIDDEN * share * part)
        rough = ((error > share * np.sqrt(part)) | (hidden > share) | many).any(axis=0)
        if turn == ROUNDS:
            rough[:] = False
        room = most - taken - len(parts)
        if rough.sum() > room:  # halve the worst parts while the limit allows
            worst = ((error + hidden) / share).max(axis=0)
            worst[~rough] = 0.0
            rough[:] = False
            rough[np.argsort(worst)[::-1][: max(0, room)]] = True
            rough &= worst > 0.0
        left += [np.bincount(parts.cell[~rough], h, minlength=count) for h in hidden[:, ~rough]]
        done.append((parts[~rough], error[:, ~rough], hidden[:, ~rough]))
        taken += int((~rough).sum())
        parts = grid.halved(parts[rough], np.maximum(floor, 1e-300))
        if not len(parts):
            break
    return grid.collected(done, count, degree)


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
    """Return the affine map x = r_0 + xi R of every cell as rows r_0 and R (m, 4, 3), m; None if a cell is curved."""
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
    beyond = np.where(np.isfinite(beyond), beyond, largest - least)  # nothing is known of it
    return np.where(beyond <= VISIBLE * (largest - least), 0.0, beyond)


class _CellFunctions:
    """Evaluation of functions over parts of the cells of a mesh."""

    def __init__(self, mesh: Mesh, values: Values, bounds: Bounds, axes: Floats) -> None:
        self.values, self.bounds, self.axes = values, bounds, axes
        self.mesh = drop_straight_midnodes(mesh)  # whose shape functions are fewer
        self.element = self.mesh.element
        self.linear = CELLS[self.element.linear]
        self.affine = _affine_maps(self.mesh)
        self.coarse, self.fine = rules_of(self.element)
        self.bundles = [np.array(b) for b in BUNDLES[family_of(self.element)]]

    def places(self, cell: Ints, xi: Floats) -> Floats:
        """Return the positions (n, q, 3), m, of local points xi (n, q, 3) in cells (n,)."""
        if self.affine is not None:
            return np.asarray(self.affine[cell, :1] + xi @ self.affine[cell, 1:])
        N = self.element.shape(xi.reshape(-1, 3)).reshape(*xi.shape[:2], -1)
        return np.asarray(N @ self.mesh.points[self.mesh.cells[cell]])

    def within(self, parts: _Parts, rule: tuple[Floats, Floats]) -> tuple[Floats, Floats, Floats]:
        """Return local points (n, q, 3), positions (n, q, 3) in m and volumes (n, q) in m^3 of a rule in every part."""
        xi = self.linear.shape(rule[0]) @ parts.vertices
        edges = np.einsum("nvi,vj->nij", parts.vertices, self.linear.gradient(np.array([self.element.centre]))[0])
        share = np.abs(determinants(edges.swapaxes(1, 2)))
        if self.affine is not None:
            size = share * determinants(self.affine[parts.cell, 1:])
            return xi, self.places(parts.cell, xi), size[:, None] * rule[1]
        dN = self.element.gradient(xi.reshape(-1, 3)).reshape(*xi.shape[:2], -1, 3)
        corners = self.mesh.points[self.mesh.cells[parts.cell]]
        J = corners.swapaxes(1, 2)[:, None] @ dN
        w = rule[1] * share[:, None] * determinants(J.swapaxes(2, 3))
        return xi, self.places(parts.cell, xi), w

    def at(self, X: Floats) -> Floats:
        """Return the function values (g, n, q) at points (n, q, 3), m."""
        found = self.values(X.reshape(-1, 3))
        return found.reshape(len(found), *X.shape[:2])

    def box(self, parts: _Parts) -> tuple[Floats, Floats]:
        """Return the bounding boxes (n, 3) of parts, m."""
        X = self.places(parts.cell, parts.vertices)
        low, high = X.min(axis=1), X.max(axis=1)
        if self.element.order > 1:
            reach = BULGE * (high - low)
            low, high = low - reach, high + reach
        return low, high

    def integrate_parts(self, parts: _Parts) -> tuple[Floats, Floats, Floats, Floats]:
        """Return integrals of magnitudes (g, n), volumes (n,), their errors (g, n) and possibly hidden parts (g, n)."""
        _, X, w = self.within(parts, self.fine)
        fine = self.at(X)
        _, Y, v = self.within(parts, self.coarse)
        coarse = self.at(Y)
        volume = np.abs(w.sum(axis=1))
        error = np.abs((fine * w).sum(axis=2) - (coarse * v).sum(axis=2))
        seen = np.concatenate([fine, coarse], axis=2)  # no rule has points at vertices
        least, largest = seen.min(axis=2), seen.max(axis=2)
        beyond = _excess_over_samples(self.bounds(*self.box(parts)), least, largest)
        wide = np.flatnonzero((beyond > 0.0).any(axis=0))
        if len(wide):
            closer = self.closer_bounds(parts[wide])
            beyond[:, wide] = _excess_over_samples(closer, least[:, wide], largest[:, wide])
        return np.abs(fine * w).sum(axis=2), volume, error, beyond * volume

    def closer_bounds(self, parts: _Parts) -> tuple[Floats, Floats]:
        """Return bounds of the functions over parts (g, n), from bounds over eight pieces of each."""
        pieces = parts
        for _ in range(CLOSER):
            pieces = self.bisected(pieces)
        low, high = self.bounds(*self.box(pieces))
        each = (len(low), len(parts), 2**CLOSER)
        return low.reshape(each).min(axis=2), high.reshape(each).max(axis=2)

    def bisected(self, parts: _Parts) -> _Parts:
        """Return both halves of each part, one behind the other, cut across the edges that are longest along `axes`."""
        X = self.places(parts.cell, parts.vertices)
        ends = [b.T for b in self.bundles]
        length = np.array([(np.abs(X[:, b] - X[:, a]).max(axis=1) * self.axes).max(axis=1) for a, b in ends])
        which = length.argmax(axis=0)
        halves = np.repeat(parts.vertices[:, None], 2, axis=1)
        for k, (a, b) in enumerate(ends):
            some = np.flatnonzero(which == k)
            middle = 0.5 * (parts.vertices[some[:, None], a] + parts.vertices[some[:, None], b])
            halves[some[:, None], 0, b] = halves[some[:, None], 1, a] = middle
        return _Parts(np.repeat(parts.cell, 2), halves.reshape(-1, *parts.vertices.shape[1:]))

    def halved(self, parts: _Parts, size: Floats) -> _Parts:
        """Return both halves of each part, cut where bounds of the functions become narrowest, else across the longest
        edge.

        `size` (g,) is the order of magnitude of each function.
        """
        if not len(parts):
            return parts
        found = [self._halved(parts[at : at + BATCH], size) for at in range(0, len(parts), BATCH)]
        return _Parts(np.concatenate([p.cell for p in found]), np.concatenate([p.vertices for p in found]))

    def _halved(self, parts: _Parts, size: Floats) -> _Parts:
        X = self.places(parts.cell, parts.vertices)
        widths, lengths, halves = [], [], []
        for bundle in self.bundles:
            a, b = bundle.T
            middle = 0.5 * (parts.vertices[:, a] + parts.vertices[:, b])
            one, other = parts.vertices.copy(), parts.vertices.copy()
            one[:, b], other[:, a] = middle, middle
            halves.append((one, other))
            width = np.zeros(len(parts))
            for k in range(SLABS):  # two halves do not reveal a central peak or short waves
                slab = parts.vertices.copy()
                slab[:, a] += k / SLABS * (parts.vertices[:, b] - parts.vertices[:, a])
                slab[:, b] -= (1.0 - (k + 1) / SLABS) * (parts.vertices[:, b] - parts.vertices[:, a])
                low, high = self.bounds(*self.box(_Parts(parts.cell, slab)))
                with np.errstate(invalid="ignore"):
                    width = width + (np.nan_to_num(high - low, nan=0.0, posinf=1e300) / size[:, None]).sum(axis=0)
            widths.append(width)
            lengths.append((np.abs(X[:, b] - X[:, a]).max(axis=1) * self.axes).max(axis=1))
        width, length = np.array(widths), np.array(lengths)
        length /= np.maximum(length.max(axis=0), 1e-300)
        near = width <= 1.05 * width.min(axis=0)  # among equally good edges, the longest
        which = np.where(near, length, -1.0).argmax(axis=0)
        every = np.array(halves)  # (d, 2, n, v, 3)
        rows = np.arange(len(parts))
        return _Parts(np.repeat(parts.cell, 2), every[which, :, rows].reshape(-1, *parts.vertices.shape[1:]))

    def collected(self, done: list[tuple[_Parts, Floats, Floats]], count: int, degree: int) -> FineRule:
        """Return fine rule in the parts of cells with few parts, and else the coarse rule if its degree suffices."""
        parts = _Parts(np.concatenate([p.cell for p, *_ in done]), np.concatenate([p.vertices for p, *_ in done]))
        error, hidden = (np.concatenate([each[i] for each in done], axis=1) for i in (1, 2))
        enough = degree <= (3 if family_of(self.element) == "hexahedra" else 2)
        many = (np.bincount(parts.cell, minlength=count)[parts.cell] > FEW) & enough
        cells, xis, ws, values = [], [], [], []
        for which, rule in ((~many, self.fine), (many, self.coarse)):
            some = parts[which]
            for at in range(0, len(some), BATCH):
                xi, X, w = self.within(some[at : at + BATCH], rule)
                cells.append(np.repeat(some.cell[at : at + BATCH], w.shape[1]))
                xis.append(xi.reshape(-1, 3))
                ws.append(w.ravel())
                values.append(self.values(X.reshape(-1, 3)))
        cell = np.concatenate(cells)
        order = np.argsort(cell, kind="stable")
        each = [np.array([np.bincount(parts.cell, e, minlength=count) for e in rows]) for rows in (error, hidden)]
        return FineRule(cell[order], np.concatenate(xis)[order], np.concatenate(ws)[order],
                        np.concatenate(values, axis=1)[:, order], *each)  # fmt: skip


FEW = 16  # parts of a cell up to which each has the fine rule
