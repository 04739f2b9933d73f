"""Boolean operations on closed surfaces (union, difference, intersection) by manifold3d (Apache-2.0)."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh
from softmark.solvers.mesh.files.triangle_proximity import edges_of_triangles
from softmark.solvers.mesh.files.watertight_repair import ClosedSurface, close_surface, merge_points, signed_volume
from softmark.solvers.mesh.mesh import Floats, Ints

if TYPE_CHECKING:
    from softmark.solvers.mesh.shape import CurvedSide

EMPTY, MISSING, UNFIT, ENDLESS = "E336", "E337", "E338", "E578"
SAME = 12  # digits relative to the extent: faces that differ by rounding lie in one plane
NOTHING = 1e-9  # relative to the extent cubed: smaller volumes count as zero
MEANING = {"union": "__add__", "difference": "__sub__", "intersection": "__xor__"}


def import_manifold3d() -> Any:
    """Return the module manifold3d. Raises UnreadableMesh if it is not installed."""
    try:
        return importlib.import_module("manifold3d")
    except ImportError:
        raise UnreadableMesh(
            "combining shapes needs the package manifold3d, which is not installed",
            MISSING, 'run `pip install "softmark[solids,meshing]"`',
        ) from None  # fmt: skip


def combine_surfaces(operation: str, one: tuple[Floats, Ints], other: tuple[Floats, Ints]) -> ClosedSurface:
    """Return the closed surface of the union, difference or intersection (`operation`) of two closed surfaces.

    Each surface is given by points (n, 3), m, and triangles (t, 3). Raises UnreadableMesh.
    """
    manifold = import_manifold3d()
    every = np.concatenate([one[0], other[0]])
    middle, extent = every.mean(axis=0), float(np.linalg.norm(np.ptp(every, axis=0)))
    first, second = (_convert_to_manifold(manifold, np.round((X - middle) / extent, SAME), t) for X, t in (one, other))
    found = getattr(manifold.Manifold, MEANING[operation])(first, second)
    if found.is_empty() or found.volume() <= NOTHING:
        raise UnreadableMesh(
            _empty_result_message(operation), EMPTY, "check their positions and sizes: `origin`, `axis`, units"
        )
    mesh = found.to_mesh64()
    points = np.array(mesh.vert_properties[:, :3], dtype=np.float64) * extent + middle
    # Touching sides leave slivers with close points, which are no flaw of a file and are not reported.
    surface = close_surface(*merge_points(points, np.array(mesh.tri_verts, dtype=np.int64), []))
    if operation == "difference" and surface.volume >= signed_volume(*one) * (1.0 - NOTHING):
        raise UnreadableMesh("the subtracted shape does not overlap the body, so nothing is removed", EMPTY,
                             "check its position and size: `origin`, `axis`, units")  # fmt: skip
    return surface


def refine_surface(points: Floats, triangles: Ints, sides: Sequence[CurvedSide]) -> tuple[Floats, Ints]:
    """Split each triangle (t, 3) into four at the middles of its edges.

    The new points of edges on curved sides are projected onto these sides.
    """
    edges, number = np.unique(np.sort(edges_of_triangles(triangles), axis=1), axis=0, return_inverse=True)
    number = number.reshape(-1, 3)
    middles = points[edges].mean(axis=1)
    for side in sides:
        own = np.unique(number[side.of(points[triangles])])
        middles[own] = np.stack(side.project_points(tuple(middles[own].T)), axis=1)
    a, b, c = triangles.T
    ab, bc, ca = len(points) + number.T
    four = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    fine = np.stack([np.stack(t, axis=1) for t in four], axis=1).reshape(-1, 3)
    return np.concatenate([points, middles]), fine.astype(np.int64)


def too_many_triangles_error(count: float, facets: float) -> UnreadableMesh:
    """Return the error for a surface that needs about `count` triangles of the size `facets`, m."""
    return UnreadableMesh(
        f"its curved surfaces would need about {count:.1e} triangles of {1e3 * facets:.3g} mm", ENDLESS,
        "use a larger `size` of the model (facets have half of it), or larger `facets`",
    )  # fmt: skip


def _empty_result_message(operation: str) -> str:
    """Return the error text for an operation that leaves no body."""
    return {
        "difference": "nothing is left: the subtracted shape contains the whole body",
        "intersection": "nothing is left: its parts do not overlap",
    }.get(operation, "it has no volume")


def _convert_to_manifold(manifold: Any, points: Floats, triangles: Ints) -> Any:
    """Return a closed surface as a solid of manifold3d. Raises UnreadableMesh if the library refuses it."""
    mesh = manifold.Mesh64(np.ascontiguousarray(points), np.ascontiguousarray(triangles, dtype=np.uint64))
    found = manifold.Manifold(mesh)
    if found.status() != manifold.Error.NoError:
        raise UnreadableMesh(
            f"the surface of one of its parts is not a closed manifold ({found.status().name})",
            UNFIT, "repair it in the program that made it, or fill it without combining, with `tetrahedralized`",
        )  # fmt: skip
    return found
