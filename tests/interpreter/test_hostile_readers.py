"""Every reader under `ulimit -v` of 4 GB: hostile files end in a message, within 20 s of the processor each.

What the files are, `fuzz/hostile_files.py` says; a reader has a process of its own, whose limits end it where it breaks
them. Files of meshes are of 34 formats, most of them read by meshio: they are tried where slow tests are.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from softmark.references import measured_surface, voxel_files
from softmark.references.measured_data import Unreadable
from softmark.resource_limits import TooSlow, limited_resources
from softmark.safe_files import UnsafeFile, open_regular, path_within, read_regular
from softmark.solvers.mesh.files import mesh_reader

SCRIPT = Path(__file__).parents[1] / "fuzz" / "hostile_files.py"
QUICK = ("journals", "scenes")
SLOW = (
    "boards",
    "comparisons",
    "decks",
    "fields",
    "kept results",
    "markers",
    "meshes",
    "plugins",
    "results",
    "scans",
    "surfaces",
    "tables",
    "volumes",
)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("reader", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW)])
def test_hostile_files_end_in_a_message(reader: str, tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, str(SCRIPT), reader, str(tmp_path)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr.splitlines()[-1:]  # the last file that was tried
    assert json.loads(done.stdout) == []


def test_every_reader_is_tried() -> None:
    from importlib import import_module

    assert sorted((*QUICK, *SLOW)) == sorted(import_module("hostile_files").readers())


def test_wrong_normals_of_a_surface_are_not_talked_about(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """trimesh logs a traceback of them, through a logger of its own for each module."""
    sound = (Path(__file__).parents[1] / "errors" / "parts" / "cube.stl").read_text(encoding="utf-8")
    (tmp_path / "cube.stl").write_text(sound.replace("facet normal 0 0 ", "facet normal 8$8$", 1), encoding="utf-8")
    assert (tmp_path / "cube.stl").read_text(encoding="utf-8") != sound
    _, triangles = mesh_reader.read_triangles(str(tmp_path / "cube.stl"), 1e-3)
    assert len(triangles) == 12
    assert not caplog.records


def test_only_regular_files_are_opened(tmp_path: Path) -> None:
    """A pipe would wait for a writer; what /dev/zero holds has no end."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "zero").symlink_to("/dev/zero")
    (tmp_path / "large").write_bytes(bytes(1001))
    for name in ("pipe", "zero", "."):
        with pytest.raises(UnsafeFile, match="it is "):
            open_regular(tmp_path / name)
    with pytest.raises(UnsafeFile, match=r"larger than 0\.001 MB"):
        read_regular(tmp_path / "large", 1000)
    assert read_regular(tmp_path / "large", 1001) == bytes(1001)


def test_a_file_names_no_file_outside_its_folder(tmp_path: Path) -> None:
    home = tmp_path / "home"
    (home / "inner").mkdir(parents=True)
    (home / "inner" / "sound").write_text("1")
    (tmp_path / "secret").write_text("2")
    (home / "link").symlink_to(tmp_path / "secret")
    (home / "within").symlink_to("inner/sound")
    os.mkfifo(home / "pipe")
    assert path_within(home, "inner/sound") == path_within(home, "within") == (home / "inner" / "sound").resolve()
    for told in ("../secret", str(tmp_path / "secret"), "/etc/passwd", "link", "inner/../../secret"):
        with pytest.raises(UnsafeFile, match="outside the folder"):
            path_within(home, told)
    for told in ("pipe", "inner", "missing", "a\0b", ""):
        with pytest.raises(UnsafeFile):
            path_within(home, told)


def _read_for_ever(file: Path) -> None:
    with limited_resources(file):
        while True:
            pass


@pytest.mark.slow
@pytest.mark.long
def test_a_reader_that_does_not_end_is_stopped_and_no_other_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Time is that of the thread's processor: a reader that only waits is not slow; what follows is never stopped."""
    from softmark import resource_limits

    monkeypatch.setattr(resource_limits, "PATIENCE", 0.2)
    file = tmp_path / "a"
    file.write_bytes(b"")
    with pytest.raises(TooSlow):
        _read_for_ever(file)
    with limited_resources(file):
        time.sleep(0.5)
    began = time.thread_time()
    while time.thread_time() < began + 0.5:
        pass
    assert sum(t.name.endswith("(watch)") for t in threading.enumerate()) <= 1


def test_materials_of_a_scan_are_not_looked_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    file = tmp_path / "a.obj"
    file.write_bytes(b"mtllib pipe\nusemtl x\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert measured_surface.read_surface(file)[1].tolist() == [[0, 1, 2]]


@pytest.mark.parametrize("index", ["9223372036854775807", "99999999999999999999999", "-99999999999999999999999"])
def test_an_index_beyond_all_is_a_message(tmp_path: Path, index: str) -> None:
    file = tmp_path / "a.obj"
    file.write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {index}\n")
    with pytest.raises(Unreadable):
        measured_surface.read_surface(file)


def test_voxels_beside_a_header_are_read_and_no_others(tmp_path: Path) -> None:
    """The header names its file behind 150 kB of comments."""
    pytest.importorskip("nrrd")
    import numpy as np

    home = tmp_path / "home"
    home.mkdir()
    np.arange(27, dtype="<f4").tofile(home / "beside.raw")
    np.arange(27, dtype="<f4").tofile(tmp_path / "outside.raw")
    head = "NRRD0005\ntype: float\ndimension: 3\nsizes: 3 3 3\nspacings: 1 1 1\nunits: mm mm mm\nendian: little\n"
    told = head + "# comment\n" * 15_000 + "encoding: raw\ndata file: {}\n\n"
    (home / "a.nhdr").write_text(told.format("beside.raw"))
    assert voxel_files.read_volume(home / "a.nhdr").values.sum() == 27 * 26 / 2
    (home / "link.raw").symlink_to(tmp_path / "outside.raw")
    for other in ("../outside.raw", str(tmp_path / "outside.raw"), "link.raw"):
        (home / "a.nhdr").write_text(told.format(other))
        with pytest.raises(Unreadable, match="outside the folder"):
            voxel_files.read_volume(home / "a.nhdr")
