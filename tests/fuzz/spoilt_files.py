"""Sound files of every reader, spoilt at random: each ends in a value that can be used, or in a reason.

    python tests/fuzz/spoilt_files.py [COUNT] [SEED] [READER]     exit 1 if a promise is broken; needs only softmark

Readers are those of `hostile_files.py`, whose files are made without chance. Findings go to $SOFTMARK_FUZZ/READER.
"""

from __future__ import annotations

import gzip
import io
import json
import os
import random
import resource
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent))

import guard
import hostile_files
import journals
import meshes
import numpy as np
import results
import scene

PARTS, OWN = scene.ERRORS / "parts", scene.ERRORS.parent / "imported"
Sound = list[tuple[str, bytes]]  # endings of names, and contents


class Broken(Exception):
    """A promise is not kept."""


# ------------------------------------------------------------------ sound files


def sound_files(name: str) -> Sound:
    """Sound files of a reader."""
    suffixes = hostile_files.readers()[name][0]
    found = [(suffix, data) for suffix, files in hostile_files.whole().items() for data in files]
    found += [(meshes.ENDINGS[data[0]], data[1:]) for data in meshes.seeds()]
    found += [(Path(next(iter(files))).suffix, next(iter(files.values()))) for files in results.whole()]
    found += [(p.suffix, p.read_bytes()) for folder in (PARTS, OWN) for p in sorted(folder.iterdir()) if p.is_file()]
    found += [
        (
            ".vtk",
            results.written(
                "x.vtk", results.meshio.Mesh(meshes.POINTS, meshes.TETRAHEDRA, point_data={"E": np.arange(5.0)}), {}
            ),
        )
    ]
    found += _volumes() + _tables() + _documents()
    return [(suffix, data) for suffix, data in found if suffix in suffixes]


def _volumes() -> Sound:
    """Images with values that differ, of every format."""
    import nibabel

    values = np.arange(60, dtype=np.float32).reshape(3, 4, 5)
    made = nibabel.Nifti1Image(values, np.diag([1.0, 2.0, 3.0, 1.0])).to_bytes()
    zipped = io.BytesIO()
    np.savez(zipped, a=values)
    found = [(".nii", made), (".nii.gz", gzip.compress(made)), (".npz", zipped.getvalue())]
    for more in (b"encoding: raw\n", b"encoding: raw\nspace: left-posterior-superior\nspace origin: (0,0,0)\n"):
        found.append((".nrrd", hostile_files.nrrd(b"5 4 3", values.tobytes(), more)))
    text = b" ".join(b"%d" % v for v in values.ravel())
    found.append(
        (".nrrd", hostile_files.nrrd(b"5 4 3", text, b"encoding: ascii\nspace directions: (1,0,0) (0,1,0) (0,0,2)\n"))
    )
    return [*found, *((".dcm", data) for data in _slices())]


def _slices() -> list[bytes]:
    """Three slices of a DICOM series."""
    from pydicom import dcmwrite
    from pydicom.dataset import FileDataset, FileMetaDataset
    from pydicom.uid import ExplicitVRLittleEndian

    meta = FileMetaDataset()
    meta.TransferSyntaxUID = ExplicitVRLittleEndian
    meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID = "1.2.840.10008.5.1.4.1.1.2", "1.2.3"
    one = FileDataset("x.dcm", {}, file_meta=meta, preamble=b"\0" * 128)
    one.SOPClassUID, one.SOPInstanceUID, one.SeriesInstanceUID = "1.2.840.10008.5.1.4.1.1.2", "1.2.3", "1.2.4"
    one.Modality, one.Rows, one.Columns = "CT", 4, 5
    one.PixelSpacing, one.SliceThickness, one.ImageOrientationPatient = [1, 1], 1, [1, 0, 0, 0, 1, 0]
    one.SamplesPerPixel, one.PhotometricInterpretation, one.PixelRepresentation = 1, "MONOCHROME2", 0
    one.BitsAllocated, one.BitsStored, one.HighBit, one.RescaleSlope, one.RescaleIntercept = 16, 16, 15, 1, -1000
    one.PixelData = np.arange(20, dtype=np.uint16).tobytes()
    found = []
    for i in range(3):
        one.InstanceNumber, one.ImagePositionPatient = i + 1, [0, 0, i]
        dcmwrite(out := io.BytesIO(), one)
        found.append(out.getvalue())
    return found


def _tables() -> Sound:
    """Measurements as programs write them."""
    head = ("x,y\n", "x;y\n", "x\ty\n", "# by hand\nx , y\n(mm),(N)\n", "name,x,y\n")
    rows = ("0,0\n1,2.5\n2,4\n", "0;0\n1;2,5\n2;4\n", "0\t0\n1\t2.5\n", "0,0\n1,1e-3\n", '"a, b",0,1\n"c",1,2\n')
    found = [(".csv", (h + r).encode()) for h, r in zip(head, rows, strict=True)]
    markers = (
        "x0,y0,z0,x1,y1,z1\n0,0,0,1,1,1\n1,2,3,2,3,4\n",
        "name;x0;y0;z0;x1;y1;z1\na;0;0;0;1,5;1;1\n",
        "i,j,x0,y0,z0,x1,y1,z1\n0,0,0,0,0,1,1,1\n0,1,1,2,3,,,\n",
        "x0,y0,z0,x2,y2,z2,x3,y3,z3\n0,0,0,1,1,1,2,2,2\n",
    )
    return found + [(".csv", text.encode()) for text in markers]


def _documents() -> Sound:
    """Scenes, plugins, results and saved runs."""
    found = [(".scene", data) for data in scene.seeds()[::7]]
    page = (guard.REPOSITORY / ".github" / "CONTRIBUTING.md").read_text(encoding="utf-8")
    found.append((".py", page.partition("```python plugin\n")[2].partition("```")[0].encode()))
    found += [(".json", json.dumps(each).encode()) for each in (journals.REPORT, journals.COMPARISON, BOARD)]
    found.append((".jsonl", b"".join(json.dumps(line).encode() + b"\n" for line in journals.JOURNAL)))
    body = io.BytesIO()
    np.savez(body, **{"json": np.frombuffer(b'{"a": [1, 2]}', dtype=np.uint8), "0": np.arange(6.0).reshape(2, 3)})
    return [*found, (".kept", body.getvalue())]


BOARD = {
    "schema": "softmark-board/1",
    "title": "t",
    "environment": {},
    "cases": {"c": {"question": "how far", "scene": "s", "unit": "mm", "tolerance": 0.1}},
    "models": {"a": {"entered": 1, "met": 1}},
    "cells": [{"case": "c", "model": "a", "name": "a", "status": "converged", "error": 0.1, "time_s": 1.0}],
}


# ------------------------------------------------------------------ what is done with a file that is read


def _use_deck(deck: Any) -> None:
    """A deck becomes a scene in canonical form, which can be checked."""
    from softmark.grammar.diagnostic import Source
    from softmark.grammar.printer import format_source
    from softmark.interpreter.importers import deck_units, scene_writer
    from softmark.interpreter.importers.deck_units import MissingUnit
    from softmark.interpreter.importers.scene_writer import MissingValue, SuppliedValues
    from softmark.interpreter.validation.scene_loader import load_scene

    gel = "neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)"
    units = deck_units.read_unit_options("mm-t-s", None, None, None)
    try:
        text = scene_writer.write_scene(deck, units, SuppliedValues(gel, "1000 kg/m^3"), "m.inp").scene
    except (MissingUnit, MissingValue) as error:
        _promise(str(error), "a reason says something")
        return
    _promise(format_source(Source("x", text)) == text, "an imported scene is in canonical form")
    scene.shown(load_scene(Source("x", text), Path.cwd(), Path.cwd() / "x.scene")[1])


def _use_field(field: Any) -> None:
    """A field has values at all points, within its bounds."""
    X = np.array([[0.0, 0.0, 0.0], [1e-3, 2e-3, 3e-3], [1.0, -1.0, 1e3], [5e-4, 5e-4, 5e-4]])
    values = field.values(X)
    _promise(values.shape == (4,) and np.isfinite(values).all(), "values are finite")
    low, high = field.bounds(X - 1e-4, X + 1e-4)
    room = 1e-9 * max(1.0, float(np.abs(values).max()))
    _promise(((low - room <= values) & (values <= high + room)).all(), "values are within their bounds")
    field.outside(X)


def _use_volume(volume: Any) -> None:
    _promise(volume.values.ndim == 3 and volume.values.size, "a volume has voxels")
    _promise(np.isfinite(volume.axes).all() and np.isfinite(volume.origin).all(), "a volume has a place")
    _promise(np.linalg.det(volume.axes) != 0.0, "a volume has a size")


def _use_markers(table: Any) -> None:
    for number in table.states:
        positions = table.positions(number)
        _promise(positions.ndim == 2 and positions.shape[1] == 3, "markers are points")
        table.grid(np.isfinite(positions).all(axis=1))
    _promise(all(isinstance(name, str) for name in table.names), "markers have names")


def _use_surface(read: Any) -> None:
    from softmark.solvers.mesh.files.watertight_repair import close_surface

    closed = close_surface(*read)
    _promise(np.isfinite(closed.points).all() and len(closed.triangles), "a closed surface has points and triangles")


def _use_scan(read: Any) -> None:
    from softmark.references.measured_surface import clean_surface

    points, triangles, _ = clean_surface("scan", *read)
    _promise(np.isfinite(points).all() and len(triangles), "a scan has points and triangles")
    _promise(triangles.min() >= 0 and triangles.max() < len(points), "triangles have their points")


def _use_comparison(read: Any) -> None:
    from softmark.interpreter.study.analysis import result_changes

    try:
        found = result_changes.find_changes(read, read, ("a", "b"))
    except result_changes.NotComparable as reason:
        _promise(str(reason), "a reason says something")
        return
    json.dumps(found.to_json(), ensure_ascii=False)


USES: dict[str, Callable[[Any], None]] = {
    "decks": _use_deck,
    "fields": _use_field,
    "volumes": _use_volume,
    "markers": _use_markers,
    "surfaces": _use_surface,
    "scans": _use_scan,
    "results": results.sound,
    "comparisons": _use_comparison,
}


COMPANIONS = {  # files beside one that is spoilt
    ".pml": {"rod.lml": (OWN / "rod.lml").read_bytes()},
    ".dcm": {f"{i}.dcm": data for i, data in enumerate(_slices()[1:])},
    ".pvd": {name: data for files in results.whole() for name, data in files.items() if len(files) > 1},
}


def _promise(kept: Any, words: str) -> None:
    if not kept:
        raise Broken(words)


# ------------------------------------------------------------------ inputs


def spoilt(data: bytes, chance: random.Random, other: bytes) -> bytes:
    """Numbers, words, bytes and parts changed, also within what is compressed; lines out of order; parts of another."""
    way = chance.random()
    if data[:2] == b"\x1f\x8b" and way < 0.8:
        return gzip.compress(spoilt(gzip.decompress(data), chance, other))
    if way < 0.1 and data:
        lines = data.split(b"\n")
        i = chance.randrange(len(lines))
        own = [lines[i]]
        lines[i : i + 1] = chance.choice(([], own * 2, own * 400, [chance.choice(lines)], [b"", *own]))
        return b"\n".join(lines)
    if way < 0.2:
        at, start = chance.randint(0, len(data)), chance.randint(0, len(other))
        taken = other[start : start + chance.choice((4, 40, 400, 10**6))]
        return data[:at] + taken + data[at + chance.choice((0, 40)) :]
    if way < 0.3 and data[:1] in (b"{", b"["):
        with suppress(ValueError, RecursionError):
            return json.dumps(journals._replaced(json.loads(data), chance)).encode()
    return results.broken(data, chance)


def inputs(name: str, count: int, seed: int) -> Iterator[bytes]:
    """Yield inputs of `target`: endings of names and contents, mostly of files that were readable before."""
    chance, sound, own = random.Random(f"{name} {seed}"), sound_files(name), target(name, Path.cwd())
    suffixes = sorted({suffix for suffix, _ in sound})
    every = {suffix: [data for its, data in sound if its == suffix] for suffix in suffixes}
    read = {suffix: [data for data in files if _is_read(own, suffix, data)] for suffix, files in every.items()}
    for i in range(count):
        suffix = suffixes[i % len(suffixes)]
        data = chance.choice(read[suffix] if read[suffix] and chance.random() < 0.8 else every[suffix])
        others = chance.choice(every[suffix if chance.random() < 0.9 else chance.choice(suffixes)])
        yield suffix.encode() + b"\n" + spoilt(data, chance, others)


def _is_read(own: Callable[[bytes], str], suffix: str, data: bytes) -> bool:
    with suppress(Exception):
        return own(suffix.encode() + b"\n" + data).endswith("read")
    return False


def _signed(data: bytes) -> bytes:
    """The contents of a saved run as this user would have written them, so that they are read."""
    from softmark.interpreter.study.run_cache import cache_folder

    return bytes(cache_folder._authentication_header("key", data)) + b"\n" + data


def target(name: str, folder: Path) -> Callable[[bytes], str]:
    """The promises of a reader as a function of an ending, a line end and contents."""
    _, reader, known = hostile_files.readers()[name]

    def one(data: bytes) -> str:
        suffix, _, content = data.partition(b"\n")
        place = folder / "place"
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir()
        path = place / f"spoilt{suffix.decode()}"
        path.write_bytes(_signed(content) if name == "kept results" else content)
        for companion, other in COMPANIONS.get(path.suffix, {}).items():
            (place / companion).write_bytes(other)
        told = io.StringIO()
        try:
            with redirect_stdout(told), redirect_stderr(told):
                read = reader(place if path.suffix == ".dcm" else path)
                if name in USES:
                    USES[name](read)
        except known as reason:
            _promise(str(reason), "a reason says something")
            return f"{path.suffix} refused"
        _promise(not told.getvalue(), "nothing is printed")
        return f"{path.suffix} read"

    return one


def main() -> int:
    """All inputs of the chosen readers, and the figures."""
    given = sys.argv[1:]
    count, seed = (int(a) for a in (given + ["1000", "1"][len(given) :])[:2])
    os.chdir(tempfile.mkdtemp(prefix="softmark-fuzz-"))
    wrong = 0
    names = given[2:] or list(hostile_files.readers())
    sets = {name: list(inputs(name, count, seed)) for name in names}
    resource.setrlimit(resource.RLIMIT_AS, (hostile_files.ADDRESSES, hostile_files.ADDRESSES))
    for name in names:
        watch, own = guard.Watch(name, guard.out(name.replace(" ", "-"))), target(name, Path.cwd())
        for data in sets[name]:
            watch.judge(own, data)
        print(json.dumps(watch.report(), indent=1), flush=True)
        wrong += len(watch.kept)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
