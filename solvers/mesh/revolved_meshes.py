"""Meshes of bodies of revolution about z: swept sections with a core or wedges at the axis, and tapered discs."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from softmark.solvers.elements import UnknownElement, element_of
from softmark.solvers.elements.reference_cells import Tetrahedron
from softmark.solvers.mesh.cell_splitting import mesh_hexahedra
from softmark.solvers.mesh.conforming_planes import Cut
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh
from softmark.solvers.mesh.polygons import Corners
from softmark.solvers.mesh.quadrilateral_meshing import mesh_polygon
from softmark.solvers.mesh.structured_meshes import PlaneMesh, extrude, extrude_layers, grid, grid_outline, mesh_disc

CORE = 0.5  # radius of the core relative to the nearest corner's
NEAR = 1e-9  # relative to the largest radius: tolerance of the axis and of the core's border
CAP = 0.4  # part of a pointed cone whose cells close over the tip, relative to its length
SUNK = 0.25  # distance of the core's end below it, relative to that part
FADE = 0.3  # length below that part with bent sections, relative to the cone


def sweep_polygon(outline: Corners, count: int, size: float, kind: str, touches: bool, cored: bool) -> Mesh:
    """Return the mesh of a counter-clockwise polygon of corners (r, z), m, swept around z in `count` steps.

    `touches` is True if the polygon meets the axis, and `cored` if the mesh then has a core. Raises UnknownElement.
    """
    if touches and not cored:
        return _sweep_tetrahedra(mesh_polygon(outline, size), count, kind)
    if not cored:
        points, cells, colour = _sweep_hexahedra(mesh_polygon(outline, size), count)
        return mesh_hexahedra(points, cells, colour, element_of(kind))
    radius = CORE * min(r for r, _ in outline if r > _axis_tolerance(outline))
    return _sweep_around_core(outline, radius, count, size, kind)


def _axis_tolerance(outline: Corners) -> float:
    return NEAR * max(r for r, _ in outline)


def _section_angles(count: int) -> Floats:
    """Return the angles (count,) of the swept sections, which match the rim points of a disc mesh."""
    turns: Floats = -0.75 * np.pi + 2.0 * np.pi * np.arange(count) / count
    return turns


def _sweep_hexahedra(section: PlaneMesh, count: int) -> tuple[Floats, Ints, Ints]:
    """Return hexahedra swept around z: points (n, 3), cells (m, 8), point colours (n,)."""
    n, turn = len(section.points), _section_angles(count)[:, None]
    r, z = section.points.T
    points = np.stack([np.cos(turn) * r, np.sin(turn) * r, np.broadcast_to(z, (count, n))], axis=-1).reshape(-1, 3)
    lower = section.quads[None] + n * np.arange(count)[:, None, None]
    upper = section.quads[None] + n * (np.arange(1, count + 1) % count)[:, None, None]
    cells = np.concatenate([upper, lower], axis=2).reshape(-1, 8)
    colour = (section.colour[None] + np.arange(count)[:, None]).ravel() % 2
    return points, cells, colour


def _sweep_tetrahedra(section: PlaneMesh, count: int, kind: str) -> Mesh:
    """Return tetrahedra of the element `kind`, swept around the axis from a section that meets the axis.

    Hexahedra at the axis would be wedges, so an element other than a tetrahedron raises UnknownElement.
    """
    element = element_of(kind)
    if element.family != Tetrahedron.family:
        raise UnknownElement(kind)
    points, cells, colour = _sweep_hexahedra(section, count)
    n, same = len(section.points), np.arange(len(points))
    axis = np.flatnonzero(section.points[:, 0] <= NEAR * section.points[:, 0].max())
    same[(axis + n * np.arange(count)[:, None]).ravel()] = np.tile(axis, count)
    points[axis, :2] = 0.0
    return mesh_hexahedra(points, cells, colour, element, same)


def _sweep_around_core(outline: Corners, radius: float, count: int, size: float, kind: str) -> Mesh:
    """Return a mesh with a core, a disc extruded along z, and the section outside it swept around the core.

    Raises UnknownElement.
    """
    least = _axis_tolerance(outline)
    section = mesh_polygon(
        tuple((radius, z) if r <= least else (r, z) for r, z in _drop_axis_corners(outline, least)), size
    )
    points, cells, colour = _sweep_hexahedra(section, count)
    at = np.flatnonzero(np.abs(section.points[:, 0] - radius) <= NEAR * radius)
    at = at[np.argsort(section.points[at, 1])]
    flat = mesh_disc(radius, 2.0 * np.pi * radius / count)
    inner, prisms, hues = extrude_layers(flat, section.points[at, 1])
    rim, per = len(flat.points) - count + np.arange(count), len(flat.points)
    m, n = len(points), len(section.points)
    # index in the sections of each point of the core's rim
    same = np.arange(m + len(inner))
    layers = per * np.arange(len(at))
    same[m + (rim[:, None] + layers).ravel()] = (n * np.arange(count)[:, None] + at).ravel()
    differ = (hues[rim[0]] + colour[at[0]]) % 2
    return mesh_hexahedra(np.concatenate([points, inner]), np.concatenate([cells, m + prisms]),
                  np.concatenate([colour, (hues + differ) % 2]), element_of(kind), same)  # fmt: skip


def _drop_axis_corners(outline: Corners, least: float) -> Corners:
    """Return the outline without the corners on the axis, except the first and the last of them."""
    n = len(outline)
    on = [r <= least for r, _ in outline]
    return tuple(c for i, c in enumerate(outline) if not (on[i - 1] and on[i] and on[(i + 1) % n]))


# ------------------------------------------------------------------ cones


def mesh_cone(length: float, radius: float, end: float, size: float, kind: str, cuts: tuple[Cut, ...]) -> Mesh:
    """Return the mesh of a solid of revolution along z whose radius, m, varies linearly from `radius` to `end`.

    It is made from a disc extruded over the `length` (m); if `end` is zero, it is closed by a tip. Raises
    UnknownElement.
    """
    largest = max(radius, end)
    section = mesh_disc(largest, size)
    below = length if end else (1.0 - CAP) * length
    points, cells, colour = extrude(
        section, below, size, tuple(c for c in cuts if c.graded or c.axis != "along" or c.at < below)
    )
    if not end:
        points[:, 2] -= _tip_offset(section, points[:, 2], length)
    points[:, :2] *= ((radius + (end - radius) * points[:, 2] / length) / largest)[:, None]
    if not end:
        points, cells, colour = _close_tip(section, points, cells, colour, length)
    return mesh_hexahedra(points, cells, colour, element_of(kind))


def _tip_offset(section: PlaneMesh, z: Floats, tip: float) -> Floats:
    """Return how far mesh points are shifted along -z, away from the tip at z = `tip`, m.

    Points of the core are shifted by the full amount, points of the rings by less.
    """
    n, rings = _disc_cell_counts(section)
    core = np.concatenate([np.ones((n + 1) ** 2), np.repeat(1.0 - np.arange(1, rings + 1) / rings, 4 * n)])
    below = (1.0 - CAP) * tip
    fade = np.maximum(0.0, 1.0 - (below - z) / (FADE * tip))
    sunk: Floats = SUNK * CAP * tip * np.tile(core, len(z) // len(core)) * fade
    return sunk


def _close_tip(section: PlaneMesh, points: Floats, cells: Ints, colour: Ints, tip: float) -> tuple[Floats, Ints, Ints]:
    """Return points, cells and colours of a cone closed by shells of cells at the tip, which is at z = `tip`, m.

    The shells repeat the core's cells, and their centre moves to the tip.
    """
    n, rings = _disc_cell_counts(section)
    top = len(points) - len(section.points) + np.arange(len(section.points))
    below = points[top[-1], 2]
    radius = np.hypot(*points[top[-1], :2])
    line = np.linspace(-1.0, 1.0, n + 1)
    a, b = (c.ravel() for c in np.meshgrid(line, line, indexing="ij"))
    out, turn = _map_square_to_disc(a, b)
    over = np.stack(
        [radius * out * np.cos(turn), radius * out * np.sin(turn), tip - np.abs(out) * (tip - below)], axis=1
    )
    core, rim = top[: (n + 1) ** 2], grid_outline(n)
    free = np.setdiff1d(np.arange((n + 1) ** 2), rim)
    levels, added, hues = [core], [points], [colour]
    for t in range(1, rings + 1):
        level = np.empty_like(core)
        level[rim] = top[(n + 1) ** 2 + 4 * n * (t - 1) + np.arange(4 * n)]
        level[free] = sum(map(len, added)) + np.arange(len(free))
        levels.append(level)
        added.append((points[core] + (over - points[core]) * (t / rings))[free])
        hues.append((colour[core[free]] + t) % 2)
    quads_ = grid(n, n).quads
    shells = [np.concatenate([low[quads_], high[quads_]], axis=1) for low, high in pairwise(levels)]
    hue = np.concatenate(hues)
    # diagonals end at the square's four corners: the midside node of one across a corner would coincide with the corner
    return np.concatenate(added), np.concatenate([cells, *shells]), (hue + hue[levels[-1][0]]) % 2


def _disc_cell_counts(section: PlaneMesh) -> tuple[int, int]:
    """Return the number n of cells along a side of a disc's square, and the number of rings around the square.

    They follow from the number of cells, n^2 + 4 n rings.
    """
    n = (len(section.points) - len(section.quads) - 1) // 2
    return n, (len(section.quads) - n**2) // (4 * n)


def _map_square_to_disc(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Map points of the square [-1, 1]^2 to the unit disc; return radii and angles, evenly spaced at the rim.

    Source: Shirley and Chiu (1997), J. Graphics Tools 2:45.
    """
    steep = np.abs(b) > np.abs(a)
    out = np.where(steep, b, a)
    safe = np.where(out == 0.0, 1.0, out)
    turn = np.where(steep, 0.5 * np.pi - 0.25 * np.pi * a / safe, 0.25 * np.pi * b / safe)
    return out, turn
