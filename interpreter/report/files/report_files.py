"""Writers of report.json and report.html, each written completely or not at all, and of files for ParaView."""

from __future__ import annotations

from pathlib import Path

from softmark.interpreter.results.atomic_files import replace
from softmark.interpreter.results.run_report import Report


def write(report: Report, folder: str | Path, page: bool = True) -> list[Path]:
    """Write report.json and, with `page`, report.html into a folder, and return their paths. Raises OSError."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    written = [replace(target / "report.json", report.dumps())]  # first, because the page can be made again from it
    if not page:
        return written
    from softmark.interpreter.report.run.report_page import render

    return [*written, replace(target / "report.html", render(report))]


def write_vtu(report: Report, folder: str | Path) -> list[Path]:
    """Write meshes and surfaces for ParaView into vtu/ of a folder; return the paths. Raises OSError, ValueError."""
    from softmark.interpreter.results import vtk_writer

    return vtk_writer.write_vtu(report, folder)
