"""Fields read from files: their values at points, and which points lie outside their domain."""

from __future__ import annotations

from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.problem.representative_constants import profiles
from softmark.interpreter.vocabulary.field_words import Field
from softmark.records import dataclass
from softmark.references.data_download import find_file
from softmark.references.measured_data import FileFrame, Unreadable
from softmark.resource_limits import TooSlow, describe_read_error, limited_resources
from softmark.solvers.materials.heterogeneous import with_constants

if TYPE_CHECKING:  # importing it loads numba
    from softmark.solvers.mesh.voxel_bounds import VoxelBounds

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

MESHES = (".vtu", ".vtk")
IMAGES = (".nrrd", ".nhdr", ".nii", ".nii.gz")
KEPT = 8  # files
BLOCKS = 64  # along each axis of the grid that bounds of a mesh's field are kept in
EDGE = 1e-6  # relative to a voxel, and of the extent of a mesh: what is as near to the outside lies within


@dataclass(frozen=True)
class Image:
    """Voxel values (nx, ny, nz) of an image; voxel (i, j, k) has its centre at A (i, j, k) + b, m."""

    numbers: Floats
    inverse: Floats  # A^-1 (3, 3), 1/m
    centre: Floats  # b (3,), m

    def _voxel_indices(self, X: Floats) -> Floats:
        """Return the fractional voxel indices (n, 3) of points X (n, 3), m."""
        found: Floats = (X - self.centre) @ self.inverse.T
        return found

    def values(self, X: Floats) -> Floats:
        """Return the values (n,) at points X (n, 3), m, by trilinear interpolation.

        Points outside the image have the value of the nearest voxel.
        """
        return self._interpolate_voxels(np.clip(self._voxel_indices(X), 0.0, np.array(self.numbers.shape) - 1))

    def _interpolate_voxels(self, at: Floats) -> Floats:
        """Return the values (n,) at fractional voxel indices (n, 3) within the image, by trilinear interpolation."""
        low = np.minimum(at.astype(np.int64), np.array(self.numbers.shape) - 2)
        (i, j, k), (r, s, t) = low.T, (at - low).T
        found = np.zeros(len(at))
        for a, b, c in np.ndindex(2, 2, 2):
            share = (r if a else 1.0 - r) * (s if b else 1.0 - s) * (t if c else 1.0 - t)
            found += share * self.numbers[i + a, j + b, k + c]
        return found

    @cached_property
    def _bounds(self) -> VoxelBounds:
        from softmark.solvers.mesh.voxel_bounds import VoxelBounds

        return VoxelBounds(self.numbers, self.numbers)

    def bounds(self, low: Floats, high: Floats) -> tuple[Floats, Floats]:
        """Return the least and largest values (n,) in boxes from low to high (n, 3), m, over all overlapping voxels.

        Small boxes use the values at corners, since values between neighbouring centres are linear along each axis.
        """
        middle, reach = self._voxel_indices(0.5 * (low + high)), 0.5 * (high - low) @ np.abs(self.inverse).T
        last = np.array(self.numbers.shape) - 1
        ends = np.clip(middle - reach, 0.0, last), np.clip(middle + reach, 0.0, last)
        first, final = np.floor(ends[0] + EDGE).astype(np.int64), np.ceil(ends[1] - EDGE).astype(np.int64)
        least, most = self._bounds.within(first, np.maximum(first, final))
        few = np.flatnonzero(np.all(final - first <= 2, axis=1))
        low, high = ends[0][few], ends[1][few]
        each = np.stack([low, np.clip(first[few] + 1.0, low, high), high])
        corners = (np.stack([each[c, :, i] for i, c in enumerate(which)], axis=1) for which in np.ndindex(3, 3, 3))
        found = [self._interpolate_voxels(at) for at in corners]
        least[few], most[few] = np.min(found, axis=0), np.max(found, axis=0)
        return least, most

    def outside(self, X: Floats) -> Bools:
        """Return a mask of the points X (n, 3), m, that lie beyond the faces of the outermost voxels (n,)."""
        at, last = self._voxel_indices(X), np.array(self.numbers.shape) - 1
        found: Bools = np.any((at < -0.5 - EDGE) | (at > last + 0.5 + EDGE), axis=1)
        return found


@dataclass(frozen=True)
class MeshField:
    """Field given at the nodes or in the cells of a mesh, stored so that no two cells share a node."""

    mesh: Any
    numbers: Floats  # of each node (m a,)

    def values(self, X: Floats) -> Floats:
        """Return values (n,) at X (n, 3), m, by the shape functions of the containing or nearest cell."""
        from softmark.solvers.mesh.element_interpolation import locate_points

        place = locate_points(self.mesh, X)
        within = np.clip(place.N, 0.0, None) if self.mesh.element.order == 1 else place.N
        N = np.where((place.outside > 0.0)[:, None], within / within.sum(axis=1, keepdims=True), place.N)
        found: Floats = (N * self.numbers[place.nodes]).sum(axis=1)
        return found

    @cached_property
    def _bounds(self) -> tuple[VoxelBounds, Floats, Floats]:
        """Bounds of the values in blocks of a grid around the mesh, the grid's corner, m, and block edges, m."""
        from scipy.ndimage import distance_transform_edt

        from softmark.solvers.mesh.voxel_bounds import VoxelBounds

        X, numbers = self.mesh.points[self.mesh.cells], self.numbers[self.mesh.cells]
        low, high, least, most = X.min(axis=1), X.max(axis=1), numbers.min(axis=1), numbers.max(axis=1)
        if self.mesh.element.order > 1:  # between nodes it may go beyond them
            reach, more = 0.1 * (high - low), 0.25 * (most - least)
            low, high, least, most = low - reach, high + reach, least - more, most + more
        corner, far = low.min(axis=0), high.max(axis=0)
        many = int(np.clip(round(2.0 * len(X) ** (1 / 3)), 1, BLOCKS))
        edge = np.maximum(far - corner, 1e-12 * self.mesh.extent) / many
        first, last = (np.clip(((at - corner) / edge).astype(np.int64), 0, many - 1) for at in (low, high))
        down, up = np.full((many,) * 3, np.inf), np.full((many,) * 3, -np.inf)
        for step in np.ndindex(*(int(n) + 1 for n in (last - first).max(axis=0))):
            there = np.all(first + step <= last, axis=1)
            i, j, k = (first[there] + step).T
            np.minimum.at(down, (i, j, k), least[there])
            np.maximum.at(up, (i, j, k), most[there])
        near = distance_transform_edt(np.isinf(down), return_distances=False, return_indices=True)
        return VoxelBounds(down[tuple(near)], up[tuple(near)]), corner, edge

    def bounds(self, low: Floats, high: Floats) -> tuple[Floats, Floats]:
        """Return the least and largest values (n,) in boxes from low to high (n, 3), m, over all cells near a box.

        Bounds are infinite for boxes smaller than half a block, which the blocks do not resolve.
        """
        known, corner, edge = self._bounds
        last = np.array(known.low.shape) - 1
        first, final = (np.clip(((at - corner) / edge).astype(np.int64), 0, last) for at in (low, high))
        least, most = known.within(first, final)
        small = np.all(high - low < 0.5 * edge, axis=1)
        return np.where(small, -np.inf, least), np.where(small, np.inf, most)

    def outside(self, X: Floats) -> Bools:
        """Return a mask of the points X (n, 3), m, that lie in no cell (n,)."""
        from softmark.solvers.mesh.element_interpolation import locate_points

        found: Bools = locate_points(self.mesh, X).outside > EDGE * self.mesh.extent
        return found


def read_field(field: Field, X: Floats) -> Floats:
    """Return the values (n,) of a field at points X (n, 3), m, in SI units. Raises Unreadable."""
    found: Floats = field.unit.value * load_field(field).values(np.asarray(X, dtype=np.float64))
    return found


def bounds(field: Field, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Return the least and largest values (n,) of a field in boxes from low to high (n, 3), m. Raises Unreadable.

    Values are in SI units.
    """
    least, most = load_field(field).bounds(low, high)
    ends = field.unit.value * least, field.unit.value * most
    return np.minimum(*ends), np.maximum(*ends)


def material_at(material: Any, X: Floats) -> Any:
    """Return a material with arrays (n,) of its varying constants at points X (n, 3), m. Raises Unreadable."""
    found = {name: profile.values(X, read_field) for name, profile in profiles(material).items() if name != "density"}
    return with_constants(material, found)


def load_field(field: Field) -> Image | MeshField:
    """Load the file of a field, with positions in the scene's coordinates. Raises Unreadable."""
    file = find_file(field.path)
    return _load_field(field, file, file.stat().st_mtime_ns)


@lru_cache(maxsize=KEPT)
def _load_field(field: Field, file: Path, stamp: int) -> Image | MeshField:
    if not file.name.lower().endswith((*MESHES, *IMAGES)):
        known = f"{', '.join((*IMAGES, *MESHES)[:-1])} and {MESHES[-1]}"
        raise Unreadable(file.name, f"fields are read from {known}", "convert the file to one of these formats")
    try:
        return _mesh(field, file) if file.name.lower().endswith(MESHES) else _image(field, file)
    except Unreadable:
        raise
    except Exception as error:  # readers raise what they like
        reason = f"it cannot be read ({describe_read_error(error)})"
        raise Unreadable(file.name, reason, "write the file again") from None


def _image(field: Field, file: Path) -> Image:
    from softmark.references.voxel_files import read_volume

    if field.array:
        raise Unreadable(file.name, "an image has one array, which has no name", "remove `array`")
    try:
        volume = read_volume(file, None, field.length)
    except Unreadable as error:  # which speaks of the fields of a reference
        remedy = error.remedy.replace("`unit`", "`length`").replace("unit = 1 mm", "length = 1 mm")
        remedy = "write the size of its voxels into its header" if "`spacing`" in remedy else remedy
        raise Unreadable(file.name, error.reason, remedy) from None
    frame = FileFrame(1.0, field.x, field.z, field.origin)
    A = frame.rotation(file.name)
    return Image(
        np.asarray(volume.values, dtype=np.float64), np.asarray(np.linalg.inv(A @ volume.axes), dtype=np.float64),
        np.asarray(frame.points(volume.origin[None], file.name)[0], dtype=np.float64),
    )  # fmt: skip


def _mesh(field: Field, file: Path) -> MeshField:
    from softmark.solvers.elements import ELEMENTS
    from softmark.solvers.mesh.files.mesh_reader import UnreadableMesh, parse, points_in_metres
    from softmark.solvers.mesh.files.mesh_validation import drop_unused_points, orient_cells
    from softmark.solvers.mesh.mesh import Mesh

    if field.length is None:
        raise Unreadable(file.name, "a mesh file does not state its unit of length", "give `length = 1 mm`")
    try:
        with limited_resources(file):  # one limit for all attempts at it
            read = parse(file)
    except (UnreadableMesh, TooSlow) as error:
        raise Unreadable(file.name, str(error), getattr(error, "remedy", None) or "write the file again") from None
    known = {element.meshio: name for name, element in reversed(ELEMENTS.items()) if element.family != "plane"}
    blocks = [i for i, block in enumerate(read.cells) if block.type in known]
    kinds = {read.cells[i].type for i in blocks}
    if len(kinds) != 1:
        reason = f"its solid cells are of {len(kinds)} kinds" if kinds else "it has no solid cells"
        raise Unreadable(file.name, reason, "use tetrahedra or hexahedra of one kind")
    kind, cells = known[kinds.pop()], np.concatenate([read.cells[i].data for i in blocks])
    try:
        points, cells, number = drop_unused_points(points_in_metres(read, field.length), cells)
        cells = orient_cells(points, cells, kind)
    except UnreadableMesh as error:
        raise Unreadable(file.name, str(error), error.remedy or "write the file again") from None
    X = FileFrame(1.0, field.x, field.z, field.origin).points(points, file.name)[cells.ravel()]
    values = _read_nodal_values(field, file, read, number[cells], blocks)
    return MeshField(Mesh(X, np.arange(cells.size).reshape(cells.shape), kind), values)


def _read_nodal_values(field: Field, file: Path, read: Any, cells: Any, blocks: list[int]) -> Floats:
    """Return the field value of each node of each cell, shape (m * a,), for m cells with a nodes: cell after cell.

    A field with one value for each cell gives this value to all nodes of the cell. Raises Unreadable.
    """
    on_cells = {n: np.concatenate([np.asarray(data[i]) for i in blocks]) for n, data in read.cell_data.items()}
    there = [*read.point_data, *on_cells]
    name = field.array or (there[0] if len(there) == 1 else "")
    if name not in there:
        has = ", ".join(f"`{n}`" for n in there) or "none"
        reason = f"it has no array `{name}`" if name else f"it has {len(there)} arrays"
        raise Unreadable(file.name, f"{reason}; its arrays: {has}", "name one: `array = ...`")
    found = np.asarray(read.point_data[name] if name in read.point_data else on_cells[name], dtype=np.float64)
    if found.ndim > 1 and found.shape[1:] != (1,):
        raise Unreadable(
            file.name, f"`{name}` has {found[0].size} numbers at each place", "name an array with one number per place"
        )
    found, on_points = found.reshape(len(found)), name in read.point_data
    places = cells.ravel() if on_points else np.repeat(np.arange(len(cells)), cells.shape[1])
    values: Floats = found[places]
    if len(wrong := np.unique(places[~np.isfinite(values)])):
        where = f"{'point' if on_points else 'solid cell'} {wrong[0]}, counted from 0"
        reason = f"{len(wrong)} of the {len(found)} numbers of `{name}` are not finite, the first is of {where}"
        raise Unreadable(file.name, reason, "replace them by a value first")
    return values
