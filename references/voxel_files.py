"""Voxel data: values on a grid with its position, read from NumPy, NRRD, NIfTI and DICOM files.

A voxel is represented by its centre. Packages that read a format are imported when a file needs them; a message names a
missing package.
"""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable, Iterable, Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass
from softmark.references.measured_data import Unreadable, Vector
from softmark.resource_limits import describe_read_error, limited_resources
from softmark.safe_files import UnsafeFile, open_regular, path_within

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Values = NDArray[np.floating[Any]]
else:
    from softmark.references.lazy_imports import np

EXTRA = 'run `pip install "softmark[imaging]"`'
UNITS = {"m": 1.0, "meter": 1.0, "cm": 1e-2, "mm": 1e-3, "millimeter": 1e-3, "um": 1e-6, "micron": 1e-6, "μm": 1e-6}
MOST_SLICES = 5000  # files of a series
ABSURD = 1e50  # m: coordinates that are larger overflow when they are multiplied
EQUAL = 1e-2  # share of the spacing by which slices may lie apart from equally spaced ones


@dataclass(frozen=True)
class VoxelVolume:
    """Values on a grid of voxels; the voxel (i, j, k) has its centre at A (i, j, k) + b, m."""

    values: Values  # (nx, ny, nz)
    axes: Array  # A (3, 3), m: its columns are the steps along i, j and k
    origin: Array  # b (3,), m

    def points(self, indices: Array) -> Array:
        """Return the positions (n, 3), m, of points given by fractional voxel indices (n, 3)."""
        return np.asarray(indices @ self.axes.T + self.origin)


def import_package(module: str, name: str) -> Any:
    """Return a package of the extra `imaging`. Raises Unreadable with the command that installs it."""
    try:
        return importlib.import_module(module)
    except ImportError:
        reason = f"reading it needs the package {module.split('.')[0]}, which is not installed"
        raise Unreadable(name, reason, EXTRA) from None


def read_volume(file: Path, spacing: Vector | None = None, unit: float | None = None) -> VoxelVolume:
    """Return the voxels of a file, or of the DICOM series in a folder.

    `spacing`, m, replaces the voxel size of the file and is required if the file has none (NumPy). `unit`, m, likewise
    replaces the unit of the file's lengths. Raises Unreadable.
    """
    read = _select_reader(file)
    try:
        with (
            nullcontext() if read in (_read_dicom, _read_nrrd) else limited_resources(file),  # these have several files
            warnings.catch_warnings(action="ignore"),  # pydicom's, about values that are not used
        ):
            volume = read(file, spacing, unit)
        volume = _check_volume(file.name, _with_spacing(volume, spacing))
    except Unreadable:
        raise
    except Exception as error:  # readers raise any exception
        reason = f"it cannot be read ({describe_read_error(error)})"
        raise Unreadable(file.name, reason, "write the file again") from None
    return volume


def _select_reader(file: Path) -> Callable[[Path, Vector | None, float | None], VoxelVolume]:
    name = file.name.lower()
    if file.is_dir() or name.endswith((".dcm", ".ima")):
        return _read_dicom
    for ending, reader in _READERS.items():
        if name.endswith(ending):
            return reader
    reason = "voxel data are read from .npy, .npz, .nrrd, .nhdr, .nii, .nii.gz and DICOM"
    raise Unreadable(file.name, reason, "convert the file to one of these formats")


def _read_numpy(file: Path, spacing: Vector | None, unit: float | None) -> VoxelVolume:
    if spacing is None:
        raise Unreadable(file.name, "a NumPy file does not give the size of its voxels",
                         "give `spacing`, such as `spacing = (0.425 mm, 0.425 mm, 0.62 mm)`")  # fmt: skip
    with open_regular(file) as opened:
        found = np.load(opened, allow_pickle=False)
        if isinstance(found, np.ndarray):
            return VoxelVolume(found, np.diag(spacing), np.zeros(3))
        if len(found.files) != 1:
            reason = f"it holds {len(found.files)} arrays ({', '.join(found.files[:12])})"
            raise Unreadable(file.name, reason, "save only the voxel array")
        return VoxelVolume(found[found.files[0]], np.diag(spacing), np.zeros(3))


def _read_nrrd(file: Path, spacing: Vector | None, unit: float | None) -> VoxelVolume:
    nrrd = import_package("nrrd", file.name)
    with open_regular(file) as opened:
        with limited_resources(file):
            header = nrrd.read_header(opened)
            data = _find_data_file(file, header)
        size = sum(one.stat().st_size for one in (file, data) if one is not None)
        own = {key: value for key, value in header.items() if key not in ("datafile", "data file")}
        with limited_resources(file, size):
            values = nrrd.read_data({**own, "data file": str(data)} if data else own, opened, str(file))
    if "space directions" in header:
        axes = np.asarray(header["space directions"], dtype=float).T
        said = header.get("space units", header.get("units"))
    elif "spacings" in header:
        axes, said = np.diag(np.asarray(header["spacings"], dtype=float)), header.get("units")
    elif spacing is not None:
        return VoxelVolume(values, np.diag(spacing), np.zeros(3))
    else:
        raise Unreadable(file.name, "it does not give the size of its voxels", "give `spacing`")
    origin = np.asarray(header.get("space origin", np.zeros(3)), dtype=float)
    length = unit or _unit_length(file.name, said)
    return VoxelVolume(values, length * axes, length * origin)


def _find_data_file(file: Path, header: Mapping[str, Any]) -> Path | None:
    """Return the separate file that holds the voxels of an NRRD file, None if they follow the header.

    Raises Unreadable.
    Source: Definition of NRRD File Format (teem.sourceforge.net/nrrd/format.html), section 6.
    """
    told = header.get("datafile", header.get("data file"))
    if told is None:
        return None
    if told.partition(" ")[0] == "LIST" or "%" in told:
        raise Unreadable(file.name, "its voxels are in several files", "write them into one")
    try:
        return path_within(file.parent, told)
    except UnsafeFile as error:
        reason = f"its voxels are in {told[:80]}, which cannot be read: {error.strerror}"
        raise Unreadable(file.name, reason, "put both files into one folder") from None


def _read_nifti(file: Path, spacing: Vector | None, unit: float | None) -> VoxelVolume:
    nibabel = import_package("nibabel", file.name)
    log = nibabel.imageglobals.logger
    told, log.disabled = log.disabled, True  # corrections of headers are printed otherwise
    try:
        image: Any = nibabel.load(str(file))
        length = unit or _unit_length(file.name, [image.header.get_xyzt_units()[0]])
        affine = length * np.asarray(image.affine, dtype=float)
        return VoxelVolume(np.asarray(image.get_fdata(dtype=np.float32)), affine[:3, :3], affine[:3, 3])
    finally:
        log.disabled = told


def _unit_length(name: str, said: Iterable[str] | None) -> float:
    """Return the length, m, of the unit that a file names. Raises Unreadable if it names none."""
    words = {str(word).strip().lower() for word in said or ()}
    if len(words) == 1 and (word := words.pop()) in UNITS:
        return UNITS[word]
    reason = "it does not give the unit of its lengths"
    raise Unreadable(name, reason, "give `unit`, such as `unit = 1 mm`")


def _read_dicom(file: Path, spacing: Vector | None, unit: float | None) -> VoxelVolume:
    """Return the voxels of the DICOM series in a folder, or of the series to which a file belongs.

    Source: DICOM PS3.3, C.7.6.2.1.1 (mm).
    """
    with limited_resources(file, sum(one.stat().st_size for one in _list_slice_files(file))):
        return _volume_from_slices(file, _read_series_slices(file))


def _volume_from_slices(file: Path, slices: list[Any]) -> VoxelVolume:
    if not slices:
        raise Unreadable(
            file.name,
            "it does not belong to a series of slices",
            "give the path of a slice, or of the folder of a series",
        )
    across, down = (np.asarray(slices[0].ImageOrientationPatient, dtype=float)[k : k + 3] for k in (0, 3))
    places = np.array([s.ImagePositionPatient for s in slices], dtype=float)
    order = np.argsort(places @ np.cross(across, down))
    rows, columns = (float(v) for v in slices[0].PixelSpacing)
    values = np.stack([_slice_values(slices[i]) for i in order], axis=-1)  # (row, column, slice)
    step = _slice_step(file.name, places[order])
    axes = np.stack([rows * down, columns * across, step], axis=1)
    return VoxelVolume(values, 1e-3 * axes, 1e-3 * places[order[0]])


def _read_series_slices(file: Path) -> list[Any]:
    """Return the slices of the DICOM series of a file, or of the only series in a folder. Raises Unreadable."""
    pydicom = import_package("pydicom", file.name)
    found: dict[str, list[Any]] = {}
    for one in _list_slice_files(file):
        try:
            with open_regular(one) as opened:
                slice_ = pydicom.dcmread(opened)
        except (pydicom.errors.InvalidDicomError, OSError):
            continue  # what else lies in the folder
        if hasattr(slice_, "ImagePositionPatient") and "PixelData" in slice_:
            found.setdefault(str(slice_.SeriesInstanceUID), []).append(slice_)
    if not file.is_dir():
        with open_regular(file) as opened:
            return found.get(str(getattr(pydicom.dcmread(opened), "SeriesInstanceUID", "")), [])
    if len(found) != 1:
        reason = f"the folder holds {len(found)} DICOM series"
        raise Unreadable(file.name, reason, "give a folder with one series, or one file of the series")
    return next(iter(found.values()))


def _list_slice_files(file: Path) -> list[Path]:
    """Return the regular files in the folder of a series, sorted by name. Raises Unreadable if one leads elsewhere."""
    folder = file if file.is_dir() else file.parent
    found: list[Path] = []
    for one in sorted(folder.iterdir()):
        try:
            path_within(folder, one.name)
        except OSError:
            continue  # folders, pipes, and links to elsewhere
        found.append(one)
    if len(found) > MOST_SLICES:
        reason = f"its folder has {len(found)} files; the limit is {MOST_SLICES}"
        raise Unreadable(file.name, reason, "put the series into its own folder")
    return found


def _slice_step(name: str, places: Array) -> Array:
    """Return the vector from slice to slice (3,), mm. Raises Unreadable if slices are not equally spaced."""
    if len(places) < 2:
        raise Unreadable(name, "the series has only one slice", "give the whole series")
    steps = np.diff(places, axis=0)
    step = steps.mean(axis=0)
    apart = float(np.linalg.norm(steps - step, axis=1).max() / np.linalg.norm(step))
    if apart > EQUAL:
        reason = f"its slices are not equally spaced (deviation {100 * apart:.2g} % of their distance)"
        raise Unreadable(name, reason, "check for missing or duplicate slices")
    return np.asarray(step)


def _slice_values(slice_: Any) -> Values:
    """Return the values of a slice (rows, columns), in the modality's unit: stored value times slope plus intercept."""
    slope, intercept = (float(getattr(slice_, f"Rescale{k}", v)) for k, v in (("Slope", 1), ("Intercept", 0)))
    return np.asarray(slice_.pixel_array, dtype=np.float32) * slope + intercept


_READERS: dict[str, Callable[[Path, Vector | None, float | None], VoxelVolume]] = {
    ".npy": _read_numpy,
    ".npz": _read_numpy,
    ".nrrd": _read_nrrd,
    ".nhdr": _read_nrrd,
    ".nii": _read_nifti,
    ".nii.gz": _read_nifti,
}


def _with_spacing(volume: VoxelVolume, spacing: Vector | None) -> VoxelVolume:
    """Return the volume with another voxel size along its axes, if one is given."""
    if spacing is None:
        return volume
    lengths = np.linalg.norm(volume.axes, axis=0)
    return VoxelVolume(volume.values, volume.axes / lengths * np.asarray(spacing), volume.origin)


def _check_voxel_axes(name: str, volume: VoxelVolume) -> None:
    """Raise Unreadable if voxels have no size, or no place."""
    if volume.axes.shape == (3, 3) and not (np.abs([*volume.axes, volume.origin]) < ABSURD).all():
        size, place = (", ".join(f"{x:.4g}" for x in row) for row in (np.abs(volume.axes).max(axis=0), volume.origin))
        reason = f"voxels of ({size}) m from ({place}) m on are absurdly large, or no finite numbers"
        raise Unreadable(name, reason, "correct the header of the file")
    lengths = np.linalg.norm(volume.axes, axis=0)
    if volume.axes.shape != (3, 3) or not lengths.all() or not abs(np.linalg.det(volume.axes / lengths)) > 0.0:
        raise Unreadable(name, "the voxel directions are linearly dependent", "give `spacing`")


def _check_volume(name: str, volume: VoxelVolume) -> VoxelVolume:
    values = np.asarray(volume.values)
    if values.ndim != 3 or min(values.shape) < 2:
        raise Unreadable(name, f"its voxels have shape {values.shape}", "give a three-dimensional grid")
    _check_voxel_axes(name, volume)
    values = values.astype(np.float64 if values.dtype == np.float64 else np.float32)
    if not (finite := np.isfinite(values)).all():
        i, j, k = np.unravel_index(int(finite.argmin()), finite.shape)
        reason = (
            f"{int((~finite).sum())} of its {finite.size} voxels are not finite numbers, the first is ({i}, {j}, {k})"
        )
        raise Unreadable(name, f"{reason}, counted from 0", "replace them by a finite value first")
    return VoxelVolume(values, volume.axes, volume.origin)
