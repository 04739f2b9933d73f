"""The report on disk: report.json and report.html, each whole or not there; and files for ParaView."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from softmark.interpreter.cli import leaving
from softmark.interpreter.results.report import Report


def write(report: Report, folder: str | Path, page: bool = True) -> list[Path]:
    """Write report.json and, with `page`, report.html into a folder, made if need be; their paths. Raises OSError."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    written = [replace(target / "report.json", report.dumps())]  # first: it is what cannot be made again
    if not page:
        return written
    from softmark.interpreter.report.run.html import render

    return [*written, replace(target / "report.html", render(report))]


def write_vtu(report: Report, folder: str | Path) -> list[Path]:
    """Write meshes and surfaces for ParaView into vtu/ of a folder; their paths. Raises OSError and ValueError."""
    from softmark.interpreter.results import vtk

    return vtk.write_vtu(report, folder)


def replace(path: Path, content: str) -> Path:
    """Write under another name in the same folder, then rename: nobody ever sees half a file. Raises OSError.

    What is no regular file, such as /dev/stdout or a pipe, is written to as it is.
    """
    if path.exists() and not path.is_file():
        path.write_text(content, encoding="utf-8", errors="replace")
        return path
    handle, temporary = tempfile.mkstemp(prefix=f".{path.name}-", dir=path.parent)
    leaving.writing(temporary)
    try:
        with os.fdopen(handle, "w", encoding="utf-8", errors="replace", newline="\n") as file:
            file.write(content)
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
    finally:
        leaving.written(temporary)
    return path


def _umask() -> int:
    """The permissions that new files do not get; mkstemp gives none but the owner's."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
