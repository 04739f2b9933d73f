"""Virtual scan of a known shape: voxels, blur and noise, then the same reconstruction as for a real scan.

The reconstruction is compared with the original shape, which gives the error of the imaging chain.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.records import dataclass
from softmark.references.ct_volume import extract_isosurface
from softmark.references.measured_data import MeasuredSurface, Unreadable, Vector
from softmark.references.reference_base import How, Reference
from softmark.references.surface_geometry import SurfaceSearch, count_open_edges, signed_volume, vertex_normals
from softmark.references.voxel_files import VoxelVolume

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Ints = NDArray[np.int64]
else:
    from softmark.references.lazy_imports import np

NAME = "virtual_scan"
RAYS = 4
"""Rays per voxel and transverse axis: the share of a voxel that is filled is then right to some 1/16 at its worst."""

VOXELS = 200_000_000
"""A grid beyond this would fill the memory; the published scanner's whole view has 29.6 million voxels."""

MARGIN = 3  # background voxels around the body, beyond four standard deviations of the blur
PAIRS = 4_000_000  # pairs of rays and triangles processed at once


@dataclass(frozen=True)
class Scanner:
    """Parameters of a virtual scanner; the body has the value 1, the background 0."""

    voxel: Vector  # m
    blur: float = 0.0  # m, standard deviation of its Gaussian point spread
    noise: float = 0.0  # standard deviation of white noise, in contrasts
    seed: int = 0


@dataclass(frozen=True)
class ChainError:
    """Error of the imaging chain: distances of the points of a reconstructed surface from the true surface, m."""

    mean: float
    sd: float  # standard deviation of the distances
    max: float
    bias: float  # mean of the signed distances: above zero, the surface lies outside the true one
    missed: float  # the largest distance of a point of the true surface from the reconstructed one

    @property
    def rms(self) -> float:
        """Root mean square of the distances, m."""
        return math.hypot(self.mean, self.sd)

    @property
    def words(self) -> str:
        """Description as text, for a note."""
        parts = (("mean", self.mean), ("sd", self.sd), ("max", self.max), ("bias", self.bias))
        return ", ".join(f"{name} {1e3 * value:.3g} mm" for name, value in parts)


@dataclass(frozen=True)
class VirtualScan(Reference):
    """The deformed shape of a model as a scanner would record it: voxels, blur, noise, marching cubes.

    Each voxel gets the fraction of it that the shape covers, blurred by a Gaussian, with white noise; the surface is
    then found as for `ct_volume`. Its distance from the scanned shape is the error of the imaging chain, which becomes
    the uncertainty of this reference. The default voxel is that of the CT of Marchal et al. 2008, whose field of view
    had 512 x 512 x 113 of them.

    Needs the extra `imaging`: `pip install "softmark[imaging]"`.
    Source: Marchal, Allard, Duriez and Cotin 2008, ISBMS, LNCS 5104:176 (voxel size); Taubin 1995 (smoothing).
    """

    of: Annotated[str, "model", "model whose deformed shape is scanned"]
    voxel: Annotated[Vector, "m in (0, inf)", "size of a voxel along x, y and z"] = (0.425e-3, 0.425e-3, 0.62e-3)
    blur: Annotated[float, "m in [0, inf)", "standard deviation of the Gaussian point spread"] = 0.4e-3
    noise: Annotated[
        float, "1 in [0, 1)", "standard deviation of the noise, relative to the contrast between body and air"
    ] = 0.02
    seed: Annotated[int, "1 in [0, 1000000000]", "seed of the random noise"] = 0
    iso: Annotated[float, "1 in (0, 1)", "level of the isosurface, between air (0) and body (1)"] = 0.5
    smoothing: Annotated[int, "1 in [0, 1000]", "number of steps of Taubin's smoothing filter"] = 10
    body: Annotated[str | None, "body", "body; needed if the scene has several"] = None

    how: ClassVar[How] = "scanned"
    source: ClassVar[str] = "the computed shape of a model of the scene"
    error_meaning: ClassVar[str] = "root mean square distance of the reconstruction from the scanned shape, m"

    def load(self, points: Array, triangles: Ints) -> MeasuredSurface:
        """Return the reconstruction of a closed surface with points (n, 3), m, and triangles (t, 3).

        Its uncertainty is the error of the imaging chain. Raises Unreadable.
        """
        volume = scan(points, triangles, Scanner(self.voxel, self.blur, self.noise, self.seed))
        found, faces, notes = extract_isosurface(volume, self.iso, self.smoothing, "largest", NAME)
        error = chain_error(found, faces, points, triangles)
        grid = " x ".join(map(str, volume.values.shape))
        notes = (f"imaging chain on {grid} voxels: {error.words}", *notes)
        return MeasuredSurface(found, faces, error.rms, f"a virtual scan of `{self.of}`", notes=notes)


def chain_error(found: Array, faces: Ints, points: Array, triangles: Ints) -> ChainError:
    """Return the distances of the points of a reconstructed surface from the true surface.

    `found` and `faces` are the reconstructed surface, `points` and `triangles` the true one.
    """
    truth = SurfaceSearch(points, triangles).closest(found)
    outward = np.einsum("ni,ni->n", found - truth.points, vertex_normals(found, faces))
    d = truth.distances
    missed = float(SurfaceSearch(found, faces).closest(points).distances.max())
    return ChainError(float(d.mean()), float(d.std()), float(d.max()), float((np.sign(outward) * d).mean()), missed)


def scan(points: Array, triangles: Ints, scanner: Scanner, shape: tuple[int, int, int] | None = None) -> VoxelVolume:
    """Return the voxels of a virtual scan of a closed surface: values of about 0 outside and 1 inside.

    The grid is cropped to the body and its blur, or has `shape` voxels about the centre of the body. Raises Unreadable.
    """
    if len(triangles) == 0 or count_open_edges(triangles):
        raise Unreadable(NAME, "the scanned surface is not closed", "scan the whole surface of a body")
    origin, size = _voxel_grid(points[np.unique(triangles)], scanner, shape)
    values = coverage(points, triangles, origin, np.asarray(scanner.voxel), size)
    if scanner.blur > 0:
        from scipy.ndimage import gaussian_filter

        values = gaussian_filter(values, [scanner.blur / v for v in scanner.voxel], mode="constant")
    if scanner.noise > 0:
        values = values + np.random.default_rng(scanner.seed).normal(0.0, scanner.noise, values.shape)
    return VoxelVolume(values, np.diag(scanner.voxel), origin)


def _voxel_grid(
    body: Array, scanner: Scanner, shape: tuple[int, int, int] | None
) -> tuple[Array, tuple[int, int, int]]:
    """Return the centre of the first voxel (3,), m, and the number of voxels along each axis."""
    voxel = np.asarray(scanner.voxel)
    low, high = body.min(axis=0), body.max(axis=0)
    if shape is not None:
        size = np.array(shape)
        origin = (low + high) / 2 - voxel * (size - 1) / 2
    else:
        margin = 4 * scanner.blur + MARGIN * voxel
        size = np.ceil((high - low + 2 * margin) / voxel).astype(int)
        origin = low - margin
    if size.prod() > VOXELS:
        reason = f"the grid would have {size.prod():.3g} voxels"
        raise Unreadable(NAME, reason, "use larger voxels")
    return origin, (int(size[0]), int(size[1]), int(size[2]))


def coverage(points: Array, triangles: Ints, origin: Array, voxel: Array, size: tuple[int, int, int]) -> Array:
    """Return the fraction of each voxel that is inside a closed surface, (nx, ny, nz).

    Rays run along the longest edge of a voxel, RAYS x RAYS of them per voxel. Each crossing of the surface at a height
    h fills the part of the ray below it, with the sign of leaving or entering. The filled length is exact along the
    ray, and the order of crossings does not matter. Where the surface intersects itself, windings add up.
    """
    first = (int(np.argmax(voxel)) + 1) % 3  # a cyclic change of axes keeps the surface outside out
    order = [first, (first + 1) % 3, (first + 2) % 3]
    n = tuple(size[i] for i in order)
    corner = (origin - voxel / 2)[order]
    P = (points[:, order] - corner) / voxel[order]  # in voxels; the voxel (i, j, k) is [i, i + 1] x ...
    filled = np.zeros((n[0] * n[1], n[2] + 1))
    for block in _triangle_blocks(P, triangles):
        column, height, sign = _ray_crossings(P, block, n[0], n[1])
        _add_crossings(filled, column, np.clip(height, 0, n[2]), sign)
    whole = np.cumsum(filled[:, ::-1], axis=1)[:, ::-1][:, 1:] / RAYS**2  # below: every voxel under a crossing
    values = whole.reshape(n) * np.sign(signed_volume(points, triangles))
    return np.ascontiguousarray(np.moveaxis(values, (0, 1, 2), order))


def _triangle_blocks(P: Array, triangles: Ints) -> list[Ints]:
    """Return the triangles in blocks of about PAIRS rays."""
    extent = np.ptp(P[triangles][:, :, :2], axis=1) * RAYS + 2
    group = np.cumsum(extent[:, 0] * extent[:, 1]) // PAIRS
    return np.split(triangles, np.flatnonzero(np.diff(group)) + 1)


def _ray_crossings(P: Array, triangles: Ints, nx: int, ny: int) -> tuple[Ints, Array, Array]:
    """Return the crossings of rays and triangles: the column of voxels (c,), the height (c,), and the sign (c,).

    The sign is +1 for leaving, -1 for entering. A ray is at ((p + 1/2) / RAYS, (q + 1/2) / RAYS). A ray that meets an
    edge is counted as if slightly displaced, so that it crosses exactly one of the two triangles.
    """
    Q = P * np.array([RAYS, RAYS, 1.0]) - np.array([0.5, 0.5, 0.0])  # rays at whole numbers
    flat = Q[triangles][:, :, :2]
    limits = np.array([nx * RAYS, ny * RAYS])
    low = np.clip(np.ceil(flat.min(axis=1)), 0, limits).astype(np.int64)
    count = np.maximum(np.clip(np.floor(flat.max(axis=1)) + 1, 0, limits).astype(np.int64) - low, 0)  # (t, 2)
    number = count.prod(axis=1)
    t = np.repeat(np.arange(len(triangles)), number)
    local = np.arange(len(t)) - np.repeat(np.cumsum(number) - number, number)
    ray = low[t] + np.stack([local // np.maximum(count[t, 1], 1), local % np.maximum(count[t, 1], 1)], axis=1)
    corners = Q[triangles[t]]  # (r, 3, 3)
    sides = [_side_of_line(corners[:, i, :2], corners[:, (i + 1) % 3, :2], ray) for i in range(3)]
    hit = (sides[0] == sides[1]) & (sides[1] == sides[2])
    height = _crossing_height(corners[hit], ray[hit])
    column = (ray[hit, 0] // RAYS) * ny + ray[hit, 1] // RAYS
    return column, height, sides[0][hit]


def _side_of_line(a: Array, b: Array, p: Array) -> Array:
    """Return +1 if p lies to the left of the line from a to b, -1 to the right.

    A point on the line counts as slightly displaced.
    """
    swapped = (a[:, 0] > b[:, 0]) | ((a[:, 0] == b[:, 0]) & (a[:, 1] > b[:, 1]))
    low, high = np.where(swapped[:, None], b, a), np.where(swapped[:, None], a, b)
    e, f = high - low, p - low
    left = e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0] >= 0  # the same for both triangles of an edge
    return np.where(left != swapped, 1.0, -1.0)


def _crossing_height(corners: Array, p: Array) -> Array:
    """Return the height at which a ray crosses the plane of a triangle, limited by the heights of its corners.

    The limits matter for a steep triangle.
    """
    a, e, f = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    d = p - a[:, :2]
    area = e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        v = (d[:, 0] * f[:, 1] - d[:, 1] * f[:, 0]) / area
        w = (e[:, 0] * d[:, 1] - e[:, 1] * d[:, 0]) / area
    height = np.where(area != 0, a[:, 2] + v * e[:, 2] + w * f[:, 2], a[:, 2])
    return np.clip(height, corners[:, :, 2].min(axis=1), corners[:, :, 2].max(axis=1))


def _add_crossings(filled: Array, column: Ints, height: Array, sign: Array) -> None:
    """Add crossings to the columns `filled` (c, nz + 1), where entry k + 1 counts for the voxels up to k.

    A crossing in the voxel m fills the fraction height - m of it, and all of the m voxels below. In sums from above,
    the fraction is added at m and the remainder of one at m - 1. See `coverage`.
    """
    m = np.minimum(np.floor(height).astype(np.int64), filled.shape[1] - 2)
    share = height - m
    flat, stride = filled.reshape(-1), filled.shape[1]
    for level, part in ((m + 1, share), (m, 1 - share)):
        flat += np.bincount(column * stride + level, weights=sign * part, minlength=len(flat))
