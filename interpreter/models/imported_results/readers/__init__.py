"""Readers of result files, which know neither units nor the body.

Each format is one module with `read(file) -> ResultFile`, and one line in READERS; it is imported on first use.
Files may be malicious: every error is raised as Unreadable, within a memory limit that depends on the file's
size.
"""

from __future__ import annotations

import io
import warnings
from contextlib import redirect_stderr, redirect_stdout
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from softmark.references.measured_data import UNPACK, Unreadable, require_uncompressed

if TYPE_CHECKING:
    from softmark.interpreter.models.imported_results.result_file import ResultFile

READERS = {
    ".vtu": "vtu", ".pvd": "pvd", ".vtk": "vtk", ".xdmf": "xdmf", ".xmf": "xdmf", ".frd": "frd", ".csv": "csv_results",
    ".pvtu": "pvtu", ".xplt": "xplt",
}  # fmt: skip
INSTEAD = {  # formats that are not supported, with the file to name instead
    ".h5": "name the .xdmf file that belongs to it",
    ".hdf5": "name the .xdmf file that belongs to it",
    ".dat": "write results with `*NODE FILE` in CalculiX, and name the .frd file",
    ".bp": "write XDMF, or VTK for ParaView",
    ".gz": UNPACK,
    ".vtm": "merge the blocks in ParaView and save them as .vtu",
    ".vtp": "write the solid, or the points of the surface as .csv",
}
LARGEST = 2 << 30  # largest size of a file, or of all files of a series, bytes
AGAIN = "write the file again: it may be incomplete, or have the wrong extension"


def read(file: Path) -> ResultFile:
    """Read a result file. Raises Unreadable with the reason and a remedy."""
    suffix = file.suffix.lower()
    if suffix not in READERS:
        *known, last = READERS
        reason = f"results can be read from {', '.join(known)} and {last} files"
        raise Unreadable(file.name, reason, INSTEAD.get(suffix, "convert the file to one of them, such as .vtu"))
    _check_file(file)
    reader = import_module(f"{__name__}.{_reader_by_content(file, READERS[suffix])}")
    from softmark.resource_limits import describe_read_error, process_lock

    try:
        with (
            process_lock,
            redirect_stdout(io.StringIO()),
            redirect_stderr(io.StringIO()),
            warnings.catch_warnings(),
        ):
            warnings.simplefilter("ignore")
            # numpy's warning about text that is not a number, in place of an error
            warnings.filterwarnings("error", message="string or file could not be read")
            told: ResultFile = reader.read(file)
    except Unreadable:
        raise
    except Exception as error:  # readers may raise any exception
        raise Unreadable(file.name, f"it cannot be read ({describe_read_error(error)})", AGAIN) from None
    return told


def _reader_by_content(file: Path, reader: str) -> str:
    """Return the name of the reader of a VTK file, chosen by the content of the file.

    Both VTK formats occur with both file endings.
    """
    if reader not in ("vtk", "vtu"):
        return reader
    from softmark.solvers.mesh.files.vtk import legacy_vtk, vtu_conversion

    with file.open("rb") as data:
        head = data.read(4096)
    return "vtu" if vtu_conversion.is_vtu(head) else "vtk" if legacy_vtk.is_legacy_vtk(head) else reader


def _check_file(file: Path) -> None:
    """Raise Unreadable if the file does not exist, is empty or is too large."""
    try:
        require_uncompressed(file)
        size = file.stat().st_size
    except FileNotFoundError:
        known = "the path is relative to the folder of the scene"
        raise Unreadable(file.name, f"there is no file {file}", known) from None
    except OSError as error:
        raise Unreadable(file.name, f"it cannot be read ({error.strerror})", "name a readable file") from None
    if not size:
        raise Unreadable(file.name, "it is empty", AGAIN)
    if size > LARGEST:
        reason = f"it has {size / 2**30:.1f} GiB, more than the limit of {LARGEST >> 30} GiB"
        raise Unreadable(file.name, reason, "keep fewer times or fewer fields")
