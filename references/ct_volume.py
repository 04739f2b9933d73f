"""Surface of a body in voxel data, by the marching cubes algorithm and volume-preserving smoothing."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from softmark.records import dataclass
from softmark.references.data_download import find_file, source_of
from softmark.references.measured_data import FileFrame, MeasuredSurface, Unreadable, Vector
from softmark.references.measured_surface import clean_surface
from softmark.references.reference_base import How, Reference
from softmark.references.surface_smoothing import taubin
from softmark.references.voxel_files import VoxelVolume, import_package, read_volume

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Ints = NDArray[np.int64]
else:
    from softmark.references.lazy_imports import np


@dataclass(frozen=True)
class CtVolume(Reference):
    """Measured surface of a body from a scan of voxels, such as a CT scan: an isosurface by marching cubes.

    `path` names the scan: NumPy (.npy, .npz) together with `spacing`, NRRD, NIfTI, or DICOM by the folder of a
    series or one of its files. The body is the region with values above `iso`. For flat faces, the value halfway
    between background and body gives an unbiased position. `smoothing` is the number of steps of Taubin's smoothing
    filter, which preserves the volume.

    Size, position and directions of the voxels are taken from the file. NRRD and NIfTI use the coordinates of their
    header, DICOM those of the patient. `x` and `z` are the directions in the file of the axes of the scene; y
    follows from them.

    `uncertainty` is the largest distance of a point of the surface from its true position; smaller differences from
    a model are reported as not significant. To measure the error of the imaging itself, use a `virtual_scan` with
    the same voxels.

    Needs the extra `imaging`: `pip install "softmark[imaging]"`.
    Source: Lewiner, Lopes, Vieira and Tavares 2003, J. Graphics Tools 8:1 (marching cubes); Taubin 1995.
    """

    path: Annotated[str, "file or folder", "path of the file or folder, or a data set such as `data:...`"]
    iso: Annotated[float, "1", "level of the isosurface, in the units of the voxel values"]
    uncertainty: Annotated[float, "m in [0, inf)", "largest distance of a measured point from its true position"]
    spacing: Annotated[Vector | None, "m in (0, inf)", "size of a voxel; needed if the file does not give it"] = None
    unit: Annotated[float | None, "m in (0, inf)", "length unit of the file; needed if the file does not give it"] = (
        None
    )
    smoothing: Annotated[int, "1 in [0, 1000]", "number of steps of Taubin's smoothing filter"] = 10
    keep: Annotated[Literal["all", "largest"], "disconnected parts of the surface to keep"] = "largest"
    x: Annotated[Vector, "direction", "direction in the file of the scene's x axis"] = (1.0, 0.0, 0.0)
    z: Annotated[Vector, "direction", "direction in the file of the scene's z axis"] = (0.0, 0.0, 1.0)
    origin: Annotated[Vector, "m", "position of the file's origin in the scene"] = (0.0, 0.0, 0.0)
    citation: Annotated[str, "authors of the measurement"] = ""
    body: Annotated[str | None, "body", "body; needed if the scene has several"] = None

    how: ClassVar[How] = "measured"
    source: ClassVar[str] = "the file named in the scene"
    error_meaning: ClassVar[str] = "uncertainty of the position of a measured point, m, as stated in the scene"

    def load(self, beside: Path | None = None) -> MeasuredSurface:
        """Return the surface in the scene's frame. Raises Unreadable."""
        file = find_file(self.path, beside)
        volume = read_volume(file, self.spacing, self.unit)
        points, triangles, notes = extract_isosurface(volume, self.iso, self.smoothing, self.keep, file.name)
        placed = FileFrame(1.0, self.x, self.z, self.origin).points(points, file.name)
        by = source_of(self.citation, self.path, file.name)
        return MeasuredSurface(placed, triangles, self.uncertainty, by, notes=notes)


def extract_isosurface(
    volume: VoxelVolume, iso: float, smoothing: int, keep: str, name: str
) -> tuple[Array, Ints, tuple[str, ...]]:
    """Return the closed surface of the region above `iso`: points, m, triangles outward, and notes about it.

    Raises Unreadable.
    Source: Lewiner, Lopes, Vieira and Tavares 2003, J. Graphics Tools 8:1.
    """
    measure = import_package("skimage.measure", name)
    low, high = float(volume.values.min()), float(volume.values.max())
    if not low <= iso < high:
        reason = f"there is no surface at the level {iso:g}: voxel values lie between {low:g} and {high:g}"
        raise Unreadable(name, reason, f"give an `iso` between them, such as {(low + high) / 2:g}")
    values, corner, cut = _crop_to_body(volume, iso, low)
    indices, faces, *_ = measure.marching_cubes(values, iso, gradient_direction="ascent", allow_degenerate=False)
    triangles = np.ascontiguousarray(faces[:, ::-1] if np.linalg.det(volume.axes) < 0 else faces, dtype=np.int64)
    points, triangles, notes = clean_surface(name, volume.points(indices + corner), triangles, keep)
    ended = ("the body reaches the edge of the voxel grid and is closed there by a flat face",) if cut else ()
    return taubin(points, triangles, smoothing), triangles, (*ended, *notes)


def _crop_to_body(volume: VoxelVolume, iso: float, low: float) -> tuple[Array, Array, bool]:
    """Return the values around the body with a layer of background, and whether the grid cuts the body.

    The second result is the index of their corner in the volume.
    """
    above = volume.values > iso
    spans = [np.flatnonzero(above.any(axis=tuple({0, 1, 2} - {axis}))) for axis in range(3)]
    first, last = (np.array([int(s[end]) for s in spans]) for end in (0, -1))
    cut = bool((first == 0).any() or (last == np.array(above.shape) - 1).any())
    inner = tuple(slice(max(a - 1, 0), b + 2) for a, b in zip(first, last, strict=True))
    start = np.array([s.start for s in inner]) - 1
    return np.pad(volume.values[inner], 1, constant_values=low), start.astype(float), cut
