"""Reader of PVTU, which names the VTU files of the parts of a mesh. Only a single part is supported."""

from __future__ import annotations

from pathlib import Path

from softmark.interpreter.models.imported_results.readers import vtu
from softmark.interpreter.models.imported_results.readers.result_frames import ResultState, combine_states
from softmark.interpreter.models.imported_results.readers.xml_trees import parse_xml, resolve_within_folder
from softmark.interpreter.models.imported_results.result_file import ResultFile
from softmark.references.measured_data import Unreadable
from softmark.resource_limits import limited_resources
from softmark.safe_files import read_regular


def read(file: Path) -> ResultFile:
    """Return the points, cells and vectors of a PVTU file, which has one state. Raises Unreadable."""
    return combine_states(file.name, [read_moment(file)])


def read_moment(file: Path) -> ResultState:
    """Return the content of a PVTU file as one state of a series. Raises Unreadable."""
    return vtu.read_moment(part(file))


def part(file: Path) -> Path:
    """Return the VTU file of the single part, in the folder of the PVTU file or below. Raises Unreadable."""
    with limited_resources(file):
        top = parse_xml(file.name, read_regular(file), "VTKFile")
    pieces = top.findall("PUnstructuredGrid/Piece")
    if len(pieces) != 1:
        remedy = "merge them in ParaView, which joins points shared by parts, and save the data as .vtu"
        raise Unreadable(file.name, f"its mesh consists of {len(pieces)} parts", remedy)
    return resolve_within_folder(file.name, file.parent, pieces[0].get("Source", ""))
