"""Reader of PVD, ParaView's time series of VTU or single-part PVTU files in the folder of the series or below."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from softmark.interpreter.models.imported_results.readers import LARGEST
from softmark.interpreter.models.imported_results.readers.pvtu import part
from softmark.interpreter.models.imported_results.readers.result_frames import AGAIN, ResultState, combine_states
from softmark.interpreter.models.imported_results.readers.vtu import read_moment
from softmark.interpreter.models.imported_results.readers.xml_trees import parse_xml, resolve_within_folder
from softmark.interpreter.models.imported_results.result_file import ResultFile
from softmark.references.csv_tables import NUMBER
from softmark.references.measured_data import Unreadable
from softmark.resource_limits import limited_resources
from softmark.safe_files import read_regular


def read(file: Path) -> ResultFile:
    """Return the points, cells and vectors of a series in all its states. Raises Unreadable."""
    with limited_resources(file):
        top = parse_xml(file.name, read_regular(file), "VTKFile")
    entries = [(e.get("file", ""), e.get("timestep", ""), e.get("part", "0")) for e in top.iter("DataSet")]
    if any(part not in ("", "0") for _, _, part in entries):
        raise Unreadable(
            file.name,
            "its times consist of several parts",
            "merge the parts in ParaView, and save one file for each time",
        )
    files = _distinct_files(file, [path for path, _, _ in entries])
    if other := next((f for f in files if f.suffix.lower() not in (".vtu", ".pvtu")), None):
        raise Unreadable(
            file.name, f"it refers to `{other.name}`, but a series must consist of .vtu files", "save its files as .vtu"
        )
    files = [part(f) if f.suffix.lower() == ".pvtu" else f for f in files]
    size = sum(f.stat().st_size for f in files)
    if size > LARGEST:
        reason = f"its files have {size / 2**30:.1f} GiB in total, more than the limit of {LARGEST >> 30} GiB"
        raise Unreadable(file.name, reason, "keep fewer times or fewer fields")
    with limited_resources(file, size):
        return combine_states(file.name, _states_of_files(file.name, files, [time for _, time, _ in entries]))


def _distinct_files(file: Path, paths: list[str]) -> list[Path]:
    """Return the files of a series. Raises Unreadable if a file is named twice.

    This limits the time that resolving names takes.
    """
    found: dict[Path, None] = {}
    for path in paths:
        one = resolve_within_folder(file.name, file.parent, path)
        if one in found:
            raise Unreadable(file.name, "it uses one file for several times", "write a separate file for each time")
        found[one] = None
    return list(found)


def _states_of_files(name: str, files: list[Path], times: list[str]) -> Iterator[ResultState]:
    """Yield the states of the files of a series, at these times. Raises Unreadable."""
    for file, time in zip(files, times, strict=True):
        if time and not NUMBER.fullmatch(time.strip()):
            raise Unreadable(name, f"`{time[:40]}` is not a time", AGAIN)
        yield replace(read_moment(file), time=float(time) if time else None)
