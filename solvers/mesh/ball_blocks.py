"""Hexahedral meshes of the unit ball: shells of cells around a rounded cube or around a hollow.

The cube is mapped to the ball as by Nowell (2005, "Mapping a cube to a sphere"), with lines of equal angles along the
middle circles of its faces. Points of the shells lie on straight lines between the cube's surface and the sphere.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from softmark.records import dataclass
from softmark.solvers.elements import element_of
from softmark.solvers.mesh.cell_splitting import mesh_hexahedra
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh

CORNER, BULGE = 0.65, 0.4  # rounded cube: radius of its corners; 0 for flat sides, 1 for a sphere


@dataclass(frozen=True)
class Blocks:
    """Hexahedra (m, 8) over points (n, 3), and the colour of each point (n,), 0 or 1 as on a chessboard."""

    points: Floats
    cells: Ints
    colour: Ints


def build_ball(side: int, shells: int, beyond: Sequence[float] = ()) -> Blocks:
    """Return a cube with `side` cells along each edge and `shells` shells of cells between it and the unit sphere.

    `side` is an even number. With the counts that spheres use, the mean-ratio quality of tetrahedra stays above 0.5
    from coarse to fine meshes. Further shells end at spheres with the radii `beyond`, each above 1.
    """
    cube, sphere = _build_cube(side)
    inner = CORNER * ((1.0 - BULGE) * cube.points / np.sqrt(3.0) + BULGE * sphere)
    share = np.arange(1, shells + 1) / shells
    return _add_shells(Blocks(inner, cube.cells, cube.colour), sphere, share, hollow=False, beyond=beyond)


def build_shell(side: int, radii: Sequence[float]) -> Blocks:
    """Return shells of cells between concentric spheres of increasing `radii`, the last of which is 1."""
    cube, sphere = _build_cube(side)
    inner = radii[0]
    share = (np.array(radii[1:]) - inner) / (1.0 - inner)
    return _add_shells(Blocks(inner * sphere, cube.cells, cube.colour), sphere, share, hollow=True)


def _build_cube(side: int) -> tuple[Blocks, Floats]:
    """Return the cube from -1 to 1, and the positions of its points in the unit ball (n, 3)."""
    line = np.sqrt(2.0) * np.sin(0.25 * np.pi * np.linspace(-1.0, 1.0, side + 1))
    line[[0, -1]] = -1.0, 1.0
    line[side // 2] = 0.0
    points = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3)
    n = np.arange((side + 1) ** 3).reshape(side + 1, side + 1, side + 1)
    low, high = slice(None, -1), slice(1, None)
    corners = [(low, low), (high, low), (high, high), (low, high)]
    cells = np.stack([n[i, j, k] for k in (low, high) for i, j in corners], axis=-1).reshape(-1, 8)
    x2, y2, z2 = (points**2).T
    roots = [np.sqrt(1.0 - a / 2.0 - b / 2.0 + a * b / 3.0) for a, b in ((y2, z2), (z2, x2), (x2, y2))]
    return Blocks(points, cells, np.indices(n.shape).sum(axis=0).ravel() % 2), points * np.stack(roots, axis=1)


def _add_shells(core: Blocks, sphere: Floats, share: Floats, hollow: bool, beyond: Sequence[float] = ()) -> Blocks:
    """Return a core with shells of cells around it, or only the shells if `hollow`.

    Shells end at the fractions `share` of the distance from the core's surface to the points `sphere` (n, 3), and then
    at the radii `beyond`, each above 1.
    """
    quads = Mesh(core.points, core.cells, "hex8").facets
    rim, own = np.unique(quads, return_inverse=True)
    own = own.reshape(quads.shape)
    outer = sphere[rim] / np.linalg.norm(sphere[rim], axis=1)[:, None]
    points, cells, colour, below = [core.points], [core.cells], [core.colour], rim
    layers = [core.points[rim] + t * (outer - core.points[rim]) for t in share.tolist()]
    for k, layer in enumerate([*layers, *(r * outer for r in beyond)], 1):
        here = len(core.points) + (k - 1) * len(rim) + np.arange(len(rim))
        points.append(layer)
        cells.append(np.concatenate([below[own], here[own]], axis=1))
        colour.append((core.colour[rim] + k) % 2)
        below = here
    cells = cells[1:] if hollow else cells
    return Blocks(np.concatenate(points), np.concatenate(cells), np.concatenate(colour))


def mesh_blocks(blocks: Blocks, kind: str, stretch: tuple[float, ...], origin: tuple[float, ...], kept: int) -> Mesh:
    """Return a mesh of the element `kind` from blocks of the unit ball. Raises UnknownElement.

    Blocks are scaled by `stretch` along x, y and z and moved to `origin`, m. Along the first `kept` axes (0 to 3), only
    the half with coordinates above the origin remains.
    """
    element = element_of(kind)
    inside = (blocks.points[blocks.cells][:, :, :kept] >= -1e-9).all(axis=(1, 2))
    used, cells = np.unique(blocks.cells[inside], return_inverse=True)
    own = blocks.points[used]
    own[:, :kept] = np.maximum(own[:, :kept], 0.0)  # planes of symmetry are flat to the last digit
    points = own * np.array(stretch) + np.array(origin)
    return mesh_hexahedra(points, cells.reshape(-1, 8).astype(np.int64), blocks.colour[used], element)
