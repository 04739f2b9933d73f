"""Reader of VTK's legacy files (.vtk), text and binary."""

from __future__ import annotations

import re
from pathlib import Path

from softmark.interpreter.models.imported_results.readers.result_frames import AGAIN, checked_state, combine_states
from softmark.interpreter.models.imported_results.result_file import ResultFile
from softmark.references.measured_data import Unreadable
from softmark.safe_files import read_regular
from softmark.solvers.mesh.files.mesh_reader import UnreadableMesh, parse

DATASET = re.compile(rb"^[ \t]*DATASET[ \t]+(\S+)", re.MULTILINE | re.IGNORECASE)


def read(file: Path) -> ResultFile:
    """Return the points, cells and vectors of a legacy VTK file: one state without a time. Raises Unreadable."""
    data = read_regular(file)
    kinds = DATASET.findall(data)
    if other := next((kind for kind in kinds if kind.upper() != b"UNSTRUCTURED_GRID"), None):
        reason = f"it contains {other.decode('latin-1')[:40]}, not an unstructured grid"
        raise Unreadable(file.name, reason, "save it as an unstructured grid")
    try:
        found = parse(file)
    except UnreadableMesh as error:
        raise Unreadable(file.name, str(error), error.remedy or AGAIN) from None
    left = tuple(f"`{word}` (cell data)" for word in found.cell_data)
    blocks = [(block.type, block.data) for block in found.cells]
    return combine_states(file.name, [checked_state(file.name, found.points, blocks, found.point_data, left=left)])
