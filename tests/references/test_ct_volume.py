"""Surfaces of voxel data: marching cubes on shapes that are known, and every format that carries them."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from softmark.references.ct_volume import CtVolume, extract_isosurface
from softmark.references.measured_data import Unreadable
from softmark.references.surface_geometry import count_open_edges, signed_volume
from softmark.references.voxel_files import VoxelVolume, read_volume

pytest.importorskip("skimage", reason="needs the extra `imaging`")

SPACING = (0.425e-3, 0.425e-3, 0.62e-3)
CENTRE = np.array([12e-3, 11e-3, 13e-3])
RADIUS = 8e-3


def ball(dtype: Any = np.float32) -> np.ndarray:
    """A ball of 8 mm whose edge is a ramp of 2 mm about the half: in units of 0 to 100."""
    i = np.indices((56, 52, 42)).reshape(3, -1).T
    away = np.linalg.norm(i * SPACING - CENTRE, axis=1) - RADIUS
    return np.asarray(100 * np.clip(0.5 - away / 2e-3, 0, 1), dtype=dtype).reshape(56, 52, 42)


def check_ball(points: np.ndarray, centre: np.ndarray = CENTRE, tolerance: float = 0.02e-3) -> None:
    # Along a ramp marching cubes interpolates exactly but for its curvature and, in float32, rounding: the
    # sagitta of a voxel's edge, h^2 / (8 R) = 0.006 mm, and as much from the smoothing.
    assert np.abs(np.linalg.norm(points - centre, axis=1) - RADIUS).max() < tolerance


def test_a_ball_of_known_radius(tmp_path: Path) -> None:
    np.save(tmp_path / "ball.npy", ball())
    found = CtVolume("ball.npy", iso=50, uncertainty=0.2e-3, spacing=SPACING).load(tmp_path)
    check_ball(found.points)
    assert count_open_edges(found.triangles) == 0
    volume = 4 / 3 * np.pi * RADIUS**3
    assert signed_volume(found.points, found.triangles) == pytest.approx(volume, rel=5e-3)
    assert found.notes == ()
    assert found.uncertainty == 0.2e-3
    np.savez(tmp_path / "ball.npz", voxels=ball())
    again = CtVolume("ball.npz", iso=50, uncertainty=0.0, spacing=SPACING, smoothing=0).load(tmp_path)
    check_ball(again.points)


def test_axes_and_origin_place_the_body(tmp_path: Path) -> None:
    np.save(tmp_path / "ball.npy", ball())
    placed = CtVolume("ball.npy", 50, 0.0, SPACING, x=(0, 0, 1), z=(0, 1, 0), origin=(1.0, 0, 0)).load(tmp_path)
    check_ball(placed.points, CENTRE[[2, 0, 1]] + [1.0, 0, 0])
    assert signed_volume(placed.points, placed.triangles) > 0


def test_a_left_handed_grid_has_its_surface_outside_out() -> None:
    mirrored = VoxelVolume(ball(), np.diag([-SPACING[0], SPACING[1], SPACING[2]]), np.zeros(3))
    points, triangles, notes = extract_isosurface(mirrored, 50, 0, "all", "ball")
    check_ball(points, CENTRE * [-1, 1, 1])
    assert signed_volume(points, triangles) > 0
    assert notes == ()


def test_specks_are_left_out_and_a_cut_body_is_closed(tmp_path: Path) -> None:
    values = ball()
    values[50:52, 2:4, 2:4] = 100
    found = extract_isosurface(VoxelVolume(values, np.diag(SPACING), np.zeros(3)), 50, 5, "largest", "ball")
    check_ball(found[0])
    assert "smaller parts" in found[2][0]
    points, triangles, notes = extract_isosurface(
        VoxelVolume(ball()[24:], np.diag(SPACING), np.zeros(3)), 50, 0, "all", "half"
    )
    assert count_open_edges(triangles) == 0
    assert notes == ("the body reaches the edge of the voxel grid and is closed there by a flat face",)
    assert points[:, 0].min() > -SPACING[0]


@pytest.mark.parametrize("iso", [-1.0, 100.0, 1e9])
def test_a_level_that_no_value_passes(tmp_path: Path, iso: float) -> None:
    np.save(tmp_path / "ball.npy", ball())
    with pytest.raises(Unreadable, match=r"voxel values lie between 0 and 100; give an `iso` between them, such as 50"):
        CtVolume("ball.npy", iso, 0.0, SPACING).load(tmp_path)


def test_nrrd(tmp_path: Path) -> None:
    nrrd = pytest.importorskip("nrrd")
    origin = 1e3 * np.array([0.1, 0.2, 0.3])
    header = {"space": "left-posterior-superior", "space directions": 1e3 * np.diag(SPACING),
              "space origin": origin, "space units": ["mm", "mm", "mm"]}  # fmt: skip
    nrrd.write(str(tmp_path / "ball.nrrd"), ball(np.int16), header)
    found = CtVolume("ball.nrrd", 50, 0.0).load(tmp_path)
    check_ball(found.points, CENTRE + 1e-3 * origin, tolerance=0.03e-3)  # whole numbers: 1 % of 2 mm
    del header["space units"]
    nrrd.write(str(tmp_path / "mute.nrrd"), ball(), header)
    with pytest.raises(Unreadable, match="does not give the unit of its lengths; give `unit`"):
        CtVolume("mute.nrrd", 50, 0.0).load(tmp_path)
    check_ball(CtVolume("mute.nrrd", 50, 0.0, unit=1e-3).load(tmp_path).points, CENTRE + 1e-3 * origin)


def test_nifti(tmp_path: Path) -> None:
    nibabel = pytest.importorskip("nibabel")
    affine = np.diag([*(1e3 * np.array(SPACING)), 1.0])
    affine[:3, 3] = [5.0, 6.0, 7.0]
    for name in ("ball.nii", "ball.nii.gz"):
        image = nibabel.Nifti1Image(ball(), affine)
        image.header.set_xyzt_units("mm")
        nibabel.save(image, str(tmp_path / name))
        found = CtVolume(name, 50, 0.0).load(tmp_path)
        check_ball(found.points, CENTRE + np.array([5e-3, 6e-3, 7e-3]))


def write_series(folder: Path, values: np.ndarray, uid: str, skip: int = -1) -> None:
    """A DICOM series along z, its files not in the order of its slices, stored with a slope and an intercept."""
    pydicom = pytest.importorskip("pydicom")
    folder.mkdir(exist_ok=True)
    for k in range(values.shape[2]):
        if k == skip:
            continue
        one = pydicom.Dataset()
        one.file_meta = pydicom.dataset.FileMetaDataset()
        one.file_meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
        one.file_meta.MediaStorageSOPClassUID = one.SOPClassUID = pydicom.uid.CTImageStorage
        one.file_meta.MediaStorageSOPInstanceUID = one.SOPInstanceUID = f"{uid}.{k + 1}"
        one.SeriesInstanceUID = uid
        one.ImagePositionPatient = [10.0, 20.0, 30.0 + 0.62 * k]
        one.ImageOrientationPatient = [1, 0, 0, 0, 1, 0]
        one.PixelSpacing = [0.425, 0.425]
        one.RescaleSlope, one.RescaleIntercept = 0.5, -1000
        pixels = np.round(2 * (values[:, :, k].T + 1000)).astype(np.uint16)  # rows are y
        one.Rows, one.Columns = pixels.shape
        one.SamplesPerPixel, one.PhotometricInterpretation = 1, "MONOCHROME2"
        one.BitsAllocated = one.BitsStored = 16
        one.HighBit, one.PixelRepresentation = 15, 0
        one.PixelData = np.ascontiguousarray(pixels).tobytes()
        one.save_as(folder / f"{uid}-{(7 * k) % 97:03d}.dcm", enforce_file_format=True)


def test_dicom_series(tmp_path: Path) -> None:
    write_series(tmp_path / "ct", ball(), "1.2.3")
    (tmp_path / "ct" / "README").write_text("not a slice")
    place = CENTRE + np.array([10e-3, 20e-3, 30e-3])
    found = CtVolume("ct", 50, 0.0).load(tmp_path)
    check_ball(found.points, place, tolerance=0.03e-3)  # stored in halves: 0.5 % of 2 mm
    assert signed_volume(found.points, found.triangles) > 0
    write_series(tmp_path / "ct", 0 * ball(), "1.2.4")
    with pytest.raises(Unreadable, match=r"the folder holds 2 DICOM series; .* or one file of the series"):
        CtVolume("ct", 50, 0.0).load(tmp_path)
    named = CtVolume("ct/1.2.3-000.dcm", 50, 0.0).load(tmp_path)
    assert np.array_equal(named.points, found.points)


def test_a_series_with_a_missing_slice(tmp_path: Path) -> None:
    write_series(tmp_path / "ct", ball(), "1.2.5", skip=20)
    with pytest.raises(Unreadable, match=r"not equally spaced.*missing or duplicate slices"):
        CtVolume("ct", 50, 0.0).load(tmp_path)


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("a.npy", b"no array", "it cannot be read"),
        ("a.tif", b"", "voxel data are read from .npy"),
        ("a.nrrd", b"NRRD0004\n", "it cannot be read"),
        ("a.nii", b"", "it cannot be read"),
        ("a.dcm", b"", "it cannot be read"),
    ],
)
def test_files_that_are_no_voxels(tmp_path: Path, name: str, content: bytes, reason: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(Unreadable, match=reason):
        read_volume(tmp_path / name, spacing=SPACING)


def test_voxels_that_are_none(tmp_path: Path) -> None:
    for values, reason in (
        (np.zeros((4, 4)), r"shape \(4, 4\)"),
        (np.full((4, 4, 4), np.nan), "64 of its 64 voxels are not finite numbers, the first is .0, 0, 0."),
        (
            np.where(np.arange(64).reshape(4, 4, 4) == 27, np.inf, 1.0),
            r"1 of its 64 voxels are not finite numbers, the first is \(1, 2, 3\), counted from 0",
        ),
    ):
        np.save(tmp_path / "a.npy", values)
        with pytest.raises(Unreadable, match=reason):
            read_volume(tmp_path / "a.npy", spacing=SPACING)
    with pytest.raises(Unreadable, match="does not give the size of its voxels; give `spacing`"):
        read_volume(tmp_path / "a.npy")
    np.savez(tmp_path / "two.npz", a=np.zeros(1), b=np.zeros(1))
    with pytest.raises(Unreadable, match=r"it holds 2 arrays \(a, b\)"):
        read_volume(tmp_path / "two.npz", spacing=SPACING)
    (tmp_path / "empty").mkdir()
    with pytest.raises(Unreadable, match="0 DICOM series"):
        read_volume(tmp_path / "empty")


@pytest.mark.parametrize(
    ("module", "name"), [("nrrd", "a.nrrd"), ("nibabel", "a.nii"), ("pydicom", "a.dcm"), ("skimage.measure", "a.npy")]
)
def test_a_missing_package_is_a_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: str, name: str
) -> None:
    np.save(tmp_path / "a.npy", ball())
    (tmp_path / name).touch()
    real = importlib.import_module

    def without(wanted: str, *rest: Any) -> Any:
        if wanted == module:
            raise ImportError(wanted)
        return real(wanted, *rest)

    monkeypatch.setattr(importlib, "import_module", without)
    with pytest.raises(Unreadable, match=r"needs the package .*; run `pip install \"softmark\[imaging\]\"`"):
        CtVolume(name, 50, 0.0, SPACING).load(tmp_path)
