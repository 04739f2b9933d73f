"""Structured meshes: quadrilaterals in a section, extruded to hexahedra.

Functions of cell_splitting.py make tetrahedra of the hexahedra. The split into five tetrahedra draws, on every
quadrilateral face, the diagonal between its two points of a certain colour. Points are coloured like a chessboard along
the edges. A plane mesh of quadrilaterals always has such a colouring, because all its faces have an even number of
edges. So neighbouring cells agree on their diagonals, and the split favours no direction, unlike the split into six
(Kuhn).
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from softmark.records import dataclass
from softmark.solvers.elements import element_of
from softmark.solvers.mesh.cell_counts import (
    OFF_CENTRE,
    circle_radii,
    count_disc_cells,
    count_divisions,
    count_rectangle_cells,
)
from softmark.solvers.mesh.cell_splitting import mesh_hexahedra
from softmark.solvers.mesh.conforming_planes import SAME, Cut, cuts_along, grid_lines
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh
from softmark.solvers.mesh.shape import CurvedSide


@dataclass(frozen=True)
class PlaneMesh:
    """A plane mesh of quadrilaterals: `points` (n, 2), `quads` (q, 4) counter-clockwise, `colour` (n,) 0 or 1."""

    points: Floats
    quads: Ints
    colour: Ints


def mesh_rectangle(width: float, height: float, size: float, cuts: tuple[Cut, ...] = ()) -> PlaneMesh:
    """Return the mesh of a rectangle of width times height, m, centred on the origin, of cells of about `size`, m.

    Grid lines lie on the `cuts` of both coordinates. The numbers of cells are even, so that a mesh of split cells is as
    symmetric as the rectangle.
    """
    nx, ny = count_rectangle_cells(width, height, size)
    x = _even_grid_lines(-width / 2, width / 2, nx, cuts_along(cuts, "first"))
    return grid_between_lines(x, _even_grid_lines(-height / 2, height / 2, ny, cuts_along(cuts, "second")))


def grid(nx: int, ny: int, first: tuple[Cut, ...] = (), second: tuple[Cut, ...] = ()) -> PlaneMesh:
    """Return the unit square divided into nx by ny cells, with grid lines at cuts of either coordinate."""
    return grid_between_lines(_even_grid_lines(0.0, 1.0, nx, first), _even_grid_lines(0.0, 1.0, ny, second))


def _even_grid_lines(low: float, high: float, count: int, cuts: tuple[Cut, ...]) -> Floats:
    """Return grid lines (n,), m, between `low` and `high`: `count` equal cells unless a cut requires others."""
    found = grid_lines(low, high, count, cuts)
    return np.linspace(low, high, count + 1) if found is None else np.array(found)


def lines_through(low: float, high: float, size: float, at: Iterable[float], cuts: tuple[Cut, ...]) -> Floats:
    """Return grid lines (n,), m, from `low` to `high` and about `size` apart, through the positions `at` and cuts."""
    known = sorted({low, high, *at})
    ends = [low, *(b for a, b in pairwise(known) if b - a > SAME * (high - low))]
    ends[-1] = high
    found = [
        _even_grid_lines(a, b, count_divisions(b - a, size), tuple(c for c in cuts if c.graded or a < c.at < b))
        for a, b in pairwise(ends)
    ]
    return np.concatenate([found[0], *(more[1:] for more in found[1:])])


def grid_between_lines(x: Floats, y: Floats) -> PlaneMesh:
    """Return the grid of cells between lines at x (n,) and lines at y (m,), m."""
    nx, ny = len(x), len(y)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"))
    index = np.arange(nx * ny).reshape(nx, ny)
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1).reshape(-1, 4)
    return PlaneMesh(np.stack([x[i], y[j]], axis=1), quads, (i + j) % 2)


def mesh_disc(
    radius: float, size: float, corner: float = 0.73, bulge: float = 0.4, cuts: tuple[Cut, ...] = ()
) -> PlaneMesh:
    """Return the mesh of a disc (an O-grid): a rounded square grid in the middle and rings of cells around it.

    `corner` is the distance of the square's corners from the centre as a fraction of `radius`. `bulge` is 0 for
    straight sides of the square and 1 for sides along a concentric circle. With the defaults the tetrahedra have a
    mean-ratio quality above 0.55 from coarse to fine meshes. Rings lie on the cuts of `radius`; without such cuts, the
    straight line through the middle lies on the first cut of `chord`.
    """
    n, rings = count_disc_cells(radius, size)
    core, *outer = circle_radii(radius, size, cuts)
    if outer:
        rings = count_divisions(0.4 * core, size)
    inner = grid_between_lines(np.linspace(-1, 1, n + 1), np.linspace(-1, 1, n + 1))
    rim = grid_outline(n)  # (4n,) indices of the square's outline, counter-clockwise
    angle = -0.75 * np.pi + 0.5 * np.pi * np.arange(4 * n) / n
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    square = inner.points[rim] / np.sqrt(2)
    outline = corner * ((1 - bulge) * square + bulge * circle)
    points = [
        _coons_patch(outline, n),
        *(outline + t * (circle - outline) for t in np.arange(1, rings + 1) / rings),
        *(r / core * circle for r in outer),
    ]
    quads, colours = [inner.quads], [inner.colour]
    ring = rim
    for k in range(rings + len(outer)):
        following = len(inner.points) + 4 * n * k + np.arange(4 * n)
        quads.append(np.stack([ring, following, np.roll(following, -1), np.roll(ring, -1)], axis=1))
        colours.append((inner.colour[rim] + k + 1) % 2)
        ring = following
    section = PlaneMesh(core * np.concatenate(points), np.concatenate(quads), np.concatenate(colours))
    chords = () if outer else cuts_along(cuts, "chord")
    return _move_line_to_chord(section, radius, chords[0]) if chords else section


def mesh_ring(inner: float, radius: float, around: int, size: float, cuts: tuple[Cut, ...] = ()) -> PlaneMesh:
    """Return the mesh of a ring between two circles, with circles of nodes on cuts of `radius`.

    `around`, an even number, is the number of cells along each circle. The mesh is rotated so that nodes lie on the
    straight line of the first cut of `chord`, which goes through the centre.
    """
    radii = _even_grid_lines(inner, radius, count_divisions(radius - inner, size), cuts_along(cuts, "radius"))
    turn = next((cut.turn for cut in cuts_along(cuts, "chord")), 0.0) + 2 * np.pi * np.arange(around) / around
    points = np.stack([np.cos(turn), np.sin(turn)], axis=1) * radii[:, None, None]
    index = np.arange(len(radii) * around).reshape(len(radii), around)
    following = np.roll(index, -1, axis=1)
    quads = np.stack([index[:-1], index[1:], following[1:], following[:-1]], axis=-1).reshape(-1, 4)
    colour = np.add.outer(np.arange(len(radii)), np.arange(around)).ravel() % 2
    return PlaneMesh(points.reshape(-1, 2), quads, colour)


def _move_line_to_chord(section: PlaneMesh, radius: float, chord: Cut) -> PlaneMesh:
    """Return the disc mapped to itself so that a straight grid line through its middle becomes a chord.

    The mesh is rotated and then moved like the hyperbolic plane in Klein's model. This projective map takes lines to
    lines, and keeps convex cells convex and the circle a circle. A chord too near to the rim is ignored.
    """
    v = chord.at / radius
    quarter = chord.turn - 0.5 * np.pi * round(chord.turn / (0.5 * np.pi))  # both middle lines are straight
    if abs(v) > OFF_CENTRE or (abs(v) <= SAME and abs(quarter) <= SAME):
        return section
    normal = np.array([np.cos(chord.turn), np.sin(chord.turn)])
    across = np.array([-normal[1], normal[0]])
    c, s = np.cos(quarter), np.sin(quarter)
    turned = section.points @ np.array([[c, s], [-s, c]]) / radius
    p, q = turned @ normal, turned @ across
    scale = radius / (1.0 + v * p)
    points = np.outer(scale * (p + v), normal) + np.outer(scale * np.sqrt(1.0 - v * v) * q, across)
    return PlaneMesh(points, section.quads, section.colour)


def grid_outline(n: int) -> Ints:
    """Return the border points (4n,) of an (n + 1) x (n + 1) grid, counter-clockwise from its lower left corner."""
    index = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    rim: Ints = np.concatenate([index[:-1, 0], index[-1, :-1], index[:0:-1, -1], index[0, :0:-1]])
    return rim


def _coons_patch(outline: Floats, n: int) -> Floats:
    """Return the grid points inside a closed outline (4n, 2), by transfinite interpolation.

    Source: Coons (1967).
    """
    low, right = outline[: n + 1], outline[n : 2 * n + 1]
    top = outline[2 * n : 3 * n + 1][::-1]
    left = np.concatenate([outline[3 * n :], outline[:1]])[::-1]
    s = np.linspace(0, 1, n + 1)
    u, v = s[:, None, None], s[None, :, None]
    sides = (1 - v) * low[:, None] + v * top[:, None] + (1 - u) * left[None] + u * right[None]
    corners = (1 - u) * ((1 - v) * low[0] + v * top[0]) + u * ((1 - v) * low[-1] + v * top[-1])
    grid: Floats = (sides - corners).reshape(-1, 2)
    return grid


def extrude(section: PlaneMesh, length: float, size: float, cuts: tuple[Cut, ...] = ()) -> tuple[Floats, Ints, Ints]:
    """Extrude a section along z from 0 to `length`, with layers ending at the cuts of `along`.

    Return points (n, 3), cells (m, 8) and point colours (n,).
    """
    return extrude_layers(
        section, _even_grid_lines(0.0, length, count_divisions(length, size), cuts_along(cuts, "along"))
    )


def extrude_layers(section: PlaneMesh, z: Floats) -> tuple[Floats, Ints, Ints]:
    """Extrude a section along z, with layers between the coordinates z (n,), m.

    Return points (n, 3), cells (m, 8) and point colours (n,).
    """
    layers = len(z) - 1
    count = len(section.points)
    points = np.concatenate([np.tile(section.points, (layers + 1, 1)), np.repeat(z, count)[:, None]], axis=1)
    lower = section.quads[None] + count * np.arange(layers)[:, None, None]
    cells = np.concatenate([lower, lower + count], axis=2).reshape(-1, 8)
    colour = (np.tile(section.colour, layers + 1) + np.repeat(np.arange(layers + 1), count)) % 2
    return points, cells, colour


def mesh_extrusion(section: PlaneMesh, length: float, size: float, kind: str, cuts: tuple[Cut, ...] = ()) -> Mesh:
    """Return an extruded section as a mesh of hexahedra, or of tetrahedra, with straight edges.

    Raises UnknownElement.
    """
    element = element_of(kind)
    return mesh_hexahedra(*extrude(section, length, size, cuts), element)


def project_midside_nodes(mesh: Mesh, sides: Iterable[CurvedSide], within: Iterable[CurvedSide] = ()) -> Mesh:
    """Return the mesh with midside nodes moved onto the curved sides of a shape.

    A facet belongs to a side if all its corners lie on it; only the midside nodes of such facets are moved. The
    surfaces `within` lie inside the body and are treated in the same way.
    """
    corners = mesh.element.facet.corners
    points = mesh.points.copy()
    inner = list(within) if mesh.element.nodes > mesh.element.corners else []
    every = mesh.cells[:, np.array(mesh.element.facets)].reshape(-1, mesh.element.facet.nodes) if inner else mesh.facets
    for side, facets in [*((side, mesh.facets) for side in sides), *((side, every) for side in inner)]:
        own = facets[side.of(mesh.points[facets[:, :corners]])]
        middles = np.unique(own[:, corners:])
        points[middles] = np.stack(side.project_points(tuple(mesh.points[middles].T)), axis=1)
    return Mesh(points, mesh.cells, mesh.kind)
