"""Public data sets, downloaded when a scene names one: `data:silicone-beam/truthCylinder-Deformed.obj`.

A data set is searched in the folder $SOFTMARK_DATA, under its own name, and then in the cache,
$XDG_CACHE_HOME/softmark/data or ~/.cache/softmark/data. If it is in neither, it is downloaded into the cache. Each file
is compared with the checksum in `TABLE`, so that a reference is the same file for everybody. Data sets are not part of
the project and keep their own licences.

To add a data set, write a line in `TABLE`: an address that cannot change (a commit, not a branch), the SHA-256 and the
size of the file, its licence, and its authors.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from softmark.records import dataclass
from softmark.references.measured_data import Unreadable

PREFIX = "data:"
BLOCK = 1 << 16  # bytes
PATIENCE = 20.0  # s without a byte
LIMIT = 180.0  # s for one file

Progress = Callable[[int, int], None]  # bytes so far, bytes in all


class Unavailable(Unreadable):
    """Error when a data set is missing and cannot be downloaded.

    `reason` is the cause, `remedy` the instruction how to provide the file offline.
    """


@dataclass(frozen=True)
class DataSet:
    """A published file: addresses, checksum, size, licence and authors."""

    name: str
    what: str
    urls: tuple[str, ...]  # tried in turn
    sha256: str
    size: int  # bytes
    licence: str
    citation: str
    checked: str  # verification state of the addresses


SOFA = "https://raw.githubusercontent.com/sofa-framework/sofa"
RENORMALISED = "2266c4485e514646ba9b53a2ad077d1c74e98429"  # what the other meshes of the beam have had their text from
PUBLISHED = "560c1df21c82007de205f6d7bd0bd6096d488b7b"  # 2008-07-25, "Validation examples from ISBMS'08 paper"
SURFACE = "ad7b5c85b40b56476ae4f2c676f643edfbe6f9fb"
ACCURACY = "examples/Benchmark/Accuracy/mesh"
MARCHAL = "Marchal, Allard, Duriez and Cotin 2008, ISBMS, LNCS 5104:176"
LGPL = "LGPL-2.1-or-later, INRIA and others (sofa-framework/sofa)"
KERDOK = "Kerdok, Cotin, Ottensmeyer, Galea, Howe and Dawson 2003, Medical Image Analysis 7:283"
SURGSIM = "https://raw.githubusercontent.com/simquest/opensurgsim"
DAWOOD = "https://raw.githubusercontent.com/abubakardawood/tissue-phantom-material-database"
MARECHAL = "https://raw.githubusercontent.com/LucMarechal/Soft-Robotics-Materials-Database"
COMPARED = "path, size and excerpts compared with a stored copy of the commit of the first address"
NOT_OPENED = "path as noted when the file was taken from the repository; no copy of these commits was compared"

_SOFA_SETS = (
    DataSet(
        "silicone-beam/truthCylinder-Deformed.obj",
        "the silicone beam sagged under its own weight: a surface fitted to its CT scan (m; z along, -y down)",
        tuple(f"{SOFA}/{c}/{ACCURACY}/truthCylinder-Deformed.obj" for c in (RENORMALISED, PUBLISHED, "master")),
        "c7915dcc325c29f8550b7b41c43fd7b722f1ccd993c3fdf4cf5966f3a3404605",
        211466, LGPL, MARCHAL, NOT_OPENED,
    ),
    DataSet(
        "silicone-beam/truthcylinder1-bent.obj",
        "the same scan as raw marching cubes (about 4.95 mm a unit; y along, +z down; to be registered)",
        tuple(f"{SOFA}/{commit}/share/mesh/truthcylinder1-bent.obj" for commit in (RENORMALISED, "master")),
        "8da1147da509e2736d8ca0a3244d801fcd69ad774131a80c28e57ad9844c1a73",
        894348, LGPL, MARCHAL, NOT_OPENED,
    ),
    DataSet(
        "silicone-beam/cylinder_Hexa.msh",
        "the authors' mesh of the undeformed beam: 4920 hexahedra (m; z along)",
        tuple(f"{SOFA}/{commit}/{ACCURACY}/cylinder_Hexa.msh" for commit in (RENORMALISED, "master")),
        "e44dcdd8e2db3b16a9c7cbb25bea279e0ba248640ca05d5295bbc31a2d70de33",
        411479, LGPL, MARCHAL, COMPARED,
    ),
    DataSet(
        "silicone-beam/cylinder_Surface.obj",
        "the surface of the undeformed beam: 3052 triangles (m; z along)",
        tuple(f"{SOFA}/{commit}/{ACCURACY}/cylinder_Surface.obj" for commit in (SURFACE, "master")),
        "32a77ddd3e2dd88a86dab33a47a855a216cbe5849b816970054478a4dcf13bb4",
        185242, LGPL, MARCHAL, COMPARED,
    ),
)  # fmt: skip

_TRUTH_CUBE = DataSet(
    "truth-cube/truthcube_uniaxial_positions.csv",
    "343 beads in a silicone cube of 80 mm, at rest and at 5, 12.5 and 18.25 % nominal compression (mm; -z up)",
    (f"{SURGSIM}/148a778e552a255be55345541a7e0d0eb6968be3/SurgSim/Physics/RenderTests/Data/uniaxial_positions.csv",),
    "046207017370b11e910fffc5a83a85901a1392ca45510dbcbf54f4a6be89efab",
    28018,
    "Apache-2.0 (simquest/opensurgsim); origin Harvard BioRobotics Laboratory",
    KERDOK,
    COMPARED,
)

_ECOFLEX = {
    "A1": ("61a8d0233f3c97327858e9d202f7efd1df87fc5cebdb117b9743c40cc9bfedb5", 86820),
    "A2": ("dab79d318f8fb18c3ffb9abdfc9530878ff476164a4e79e0ed6b4241938474f6", 86829),
    "A3": ("57950aa7b8186acb3f0c2250fa4c8cc972fa42e6f745d8e391ea70bb1ea6832a", 86824),
    "A4": ("44e7e71abf8ae19fda438a8a462fcea0eed258cf56d2e53e8125e2123970ddaf", 86837),
    "A5": ("2fcf490633a8a58026d1be5364f14acc421ed7ae31c3d417a340f7f56f178547", 86827),
    "B1": ("3faa10ecb369765853c89c092c873953e2ab7e51a9692feefdd6b406e7fe116a", 86808),
    "B2": ("b133e14af9bb3349223bfa21d66be8d761097715566fc4907c928549577ff1fc", 86815),
    "B3": ("0983843ece39531927f74ca917a922879148789decbaf28c4642cdbda97b7504", 86824),
    "B4": ("01cba2f9d9888b360404ea0b753c2ac42fe7ab227a1ad1c0bf031725f8ae5bea", 86836),
    "B5": ("6cb3c0372ed76ccb3d4997944cef8f8472184cdf16227384bc56d6966903689c", 86845),
}


def _ecoflex_data_set(repeat: str, sha256: str, size: int) -> DataSet:
    return DataSet(
        f"ecoflex-0030/compression/EF30_{repeat}.csv",
        f"compression of a cylinder of Ecoflex 00-30, 50 mm wide and 30 mm high, at 10 mm/min: repeat {repeat}",
        (f"{DAWOOD}/fe6298e43d1297384fd170cfeac2cf6adc65989a/data/EF30_0T/EF30_0T_{repeat}.csv",),
        sha256,
        size,
        "CC BY 4.0",
        "Dawood, tissue-phantom-material-database",
        COMPARED if repeat == "A1" else "path found at that commit; the file itself was not compared",
    )


_PULL = DataSet(
    "ecoflex-0030/ecoflex0030_tension_ODbL.csv",
    "pull to failure of a strip of Ecoflex 00-30, 33 mm x 6 mm x 3 mm (ASTM D412), at 450 mm/min",
    (f"{MARECHAL}/1049b050a0f54bb7ab3e05487fe45416de287d50/Tensile-Tests-Data/Ecoflex%2000-30.csv",),
    "34c00bcc55c401e2c6da596222deed71a8a51ba0be590a5aebe32eac07a19b27",
    31275,
    "ODbL 1.0",
    "Marechal, Balland, Lindenroth, Petrou, Kontovounisios and Bello 2021, Soft Robotics 8:284",
    COMPARED,
)


TABLE: dict[str, DataSet] = {
    one.name: one
    for one in (*_SOFA_SETS, _TRUTH_CUBE, _PULL, *(_ecoflex_data_set(name, *facts) for name, facts in _ECOFLEX.items()))
}


def find_file(path: str, beside: Path | None = None, progress: Progress | None = None) -> Path:
    """Return the local file for a path in a scene: a data set, or a file relative to the folder `beside`.

    Raises Unavailable if a data set is missing.
    """
    if path.startswith(PREFIX):
        return locate_data_set(path.removeprefix(PREFIX), progress)
    file = Path(path) if beside is None else beside / path
    if file.exists():
        return file
    raise Unavailable(path, f"there is no file {file}", "give a path relative to the scene's own folder")


def locate_data_set(name: str, progress: Progress | None = None) -> Path:
    """Return the file of the data set `name`, downloaded if needed. Raises Unavailable."""
    return find_local(name) or _fetch(_data_set_entry(name), progress)


def find_local(name: str) -> Path | None:
    """Return the local file of the data set `name`, None if it is not downloaded. Raises Unavailable."""
    entry = _data_set_entry(name)
    return _file_from_environment(entry) or _cached_file(entry)


def _data_set_entry(name: str) -> DataSet:
    if name not in TABLE:
        raise Unavailable(PREFIX + name, "there is no data set with this name", _similar_name_remedy(name))
    return TABLE[name]


def source_of(citation: str, path: str, file: str) -> str:
    """Return the authors of measured data: from the scene (`citation`), from the data set, or else the file's name."""
    return citation or authors_of(path) or f"the file {file}"


def authors_of(path: str) -> str:
    """Return the authors of the data set at a path, "" for other paths."""
    entry = TABLE.get(path.removeprefix(PREFIX)) if path.startswith(PREFIX) else None
    return entry.citation if entry else ""


def _similar_name_remedy(name: str) -> str:
    import difflib

    close = difflib.get_close_matches(name, TABLE, n=1, cutoff=0.4)
    if close:
        return f"did you mean `{PREFIX}{close[0]}`?"
    return "data sets: " + ", ".join(f"`{PREFIX}{n}`" for n in TABLE if not n.startswith("ecoflex"))


def _file_from_environment(entry: DataSet) -> Path | None:
    """Return the data set's file in $SOFTMARK_DATA, None if there is none."""
    folder = os.environ.get("SOFTMARK_DATA")
    if not folder:
        return None
    file = Path(folder) / entry.name
    try:
        if not file.is_file():
            return None
        same = _sha256(file) == entry.sha256
    except OSError as error:
        raise _unavailable_error(entry, f"{file} cannot be read: {error}") from None
    if not same:
        raise _unavailable_error(entry, f"{file} differs from the published file (its SHA-256 differs)")
    return file


def _cached_file(entry: DataSet) -> Path | None:
    file = _cache_path(entry)
    with suppress(OSError):  # a cache that cannot be read is no cache
        if file is not None and file.is_file() and _sha256(file) == entry.sha256:
            return file
    return None


def _cache_path(entry: DataSet) -> Path | None:
    """Return the path of a data set's file in the cache; None without a cache folder and a home folder."""
    try:
        root = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:  # no home directory
        return None
    return root / "softmark" / "data" / entry.sha256 / Path(entry.name).name


def _fetch(entry: DataSet, progress: Progress | None) -> Path:
    """Return the data set's file after downloading it into the cache, completely or not at all."""
    import tempfile

    file = _cache_path(entry)
    if file is None:
        raise _unavailable_error(entry, "there is no cache folder: no home directory and no $XDG_CACHE_HOME")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        handle, part = tempfile.mkstemp(dir=file.parent, prefix=".part-")
    except OSError as error:
        raise _unavailable_error(entry, f"the cache cannot be written: {error}") from None
    try:
        with os.fdopen(handle, "wb") as out:
            _download(entry, out, progress)
        Path(part).replace(file)
    except OSError as error:
        raise _unavailable_error(entry, f"the cache cannot be written: {error}") from None
    finally:
        Path(part).unlink(missing_ok=True)
    return file


def _download(entry: DataSet, out: Any, progress: Progress | None) -> None:
    """Write the data set from the first of its addresses that works to `out`.

    Raises Unavailable with the error of each address.
    """
    failures = []
    for url in entry.urls:
        out.seek(0)
        out.truncate()
        reason = _copy_from_url(url, entry, out, progress)
        if reason is None:
            return
        failures.append(reason)
    told = "; ".join(dict.fromkeys(failures))
    raise _unavailable_error(entry, f"it could not be downloaded from any of {len(entry.urls)} addresses ({told})")


def _copy_from_url(url: str, entry: DataSet, out: Any, progress: Progress | None) -> str | None:
    """Copy the data at one address to `out`; return an error message, or None."""
    import hashlib
    import http.client
    import urllib.request

    started, done, digest = time.monotonic(), 0, hashlib.sha256()
    try:
        with urllib.request.urlopen(url, timeout=PATIENCE) as answer:
            while (block := answer.read1(BLOCK)) and done <= entry.size:
                if time.monotonic() - started > LIMIT:
                    return f"download not finished after {LIMIT:g} s"
                out.write(block)
                digest.update(block)
                done += len(block)
                if progress is not None:
                    progress(done, entry.size)
    except (OSError, http.client.HTTPException, ValueError) as error:
        return str(error) or type(error).__name__
    if digest.hexdigest() != entry.sha256:
        return f"the server sent a different file ({done} bytes, expected {entry.size}; the SHA-256 differs)"
    return None


def _sha256(file: Path) -> str:
    import hashlib

    return hashlib.sha256(file.read_bytes()).hexdigest()


def _unavailable_error(entry: DataSet, reason: str) -> Unavailable:
    where = f"download it from {entry.urls[0]} ({entry.size} bytes, SHA-256 {entry.sha256})"
    remedy = f"offline, {where}, save it as FOLDER/{entry.name} and set SOFTMARK_DATA=FOLDER"
    return Unavailable(PREFIX + entry.name, f"{reason}. The data set is {entry.what}; {entry.licence}", remedy)
