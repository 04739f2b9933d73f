"""Checks that refuse hazardous mesh files before another library reads them.

There are three hazards. meshio opens whatever path an XDMF file names. HDF5 follows the links in a file by itself. The
time that meshio takes for a VTU file grows with the square of the number of its tags for appended data.
Source: XDMF Model and Format (xdmf.org); HDF5 File Format Specification, section IV.A (hdfgroup.org).
"""

from __future__ import annotations

import importlib
from contextlib import suppress
from typing import Any

from softmark.safe_files import open_regular, read_regular

TYPE_CHECKING = False  # as in `typing`, which takes longer to import than this
if TYPE_CHECKING:
    from pathlib import Path

XDMF, VTU = (".xdmf", ".xmf"), ".vtu"
HDF5 = b"\x89HDF\r\n\x1a\n"
ELSEWHERE = "its numbers lie in another file, which the scene does not name"
MOST = 100_000  # maximum number of objects of an HDF5 file that are checked


def find_hazard(path: Path) -> str:
    """Return the reason to refuse a mesh file, "" if it is accepted.

    A file is refused if it refers to other files or exceeds a limit. Raises OSError.
    """
    if path.suffix.lower() in XDMF:
        return ELSEWHERE if _is_external(read_regular(path)) else ""
    if path.suffix.lower() == VTU and read_regular(path).count(b"<AppendedData") > 1:
        return "it has appended data more than once"
    with open_regular(path) as file:
        if file.read(len(HDF5)) != HDF5:
            return ""
    return _find_external_links(path)


def _is_external(data: bytes) -> bool:
    """Return whether an XDMF data item is stored outside the XML. Invalid XML is left for the reader to refuse."""
    from xml.parsers import expat

    found: list[str] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        form = attributes.get("Format", "XML")
        if form.strip().upper() != "XML" or ("include" in tag.lower() and "href" in attributes):
            found.append(form)

    parser = expat.ParserCreate()
    parser.StartElementHandler = start
    with suppress(expat.ExpatError):
        parser.Parse(data, True)
    return bool(found)


def _find_external_links(path: Path) -> str:
    """Return the reason to refuse an HDF5 file, "" if it is accepted.

    A file is refused if it has links to other files, stores data in them, or has too many groups.
    """
    try:
        h5py: Any = importlib.import_module("h5py")
    except ImportError:
        return ""  # without h5py no reader can open the file
    with h5py.File(path, "r") as file:
        waiting, seen = [file], {file.id.__hash__()}
        while waiting:
            group = waiting.pop()
            for name in group:
                if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                    return ELSEWHERE
                own = group[name]
                if isinstance(own, h5py.Group) and own.id.__hash__() not in seen:
                    seen.add(own.id.__hash__())
                    waiting.append(own)
                elif isinstance(own, h5py.Dataset) and (own.external or own.is_virtual):
                    return ELSEWHERE
            if len(seen) > MOST:
                return f"it has more than {MOST} groups"
    return ""
