"""Conversion of VTU files to a form that meshio reads: inline instead of appended arrays, and no text arrays.

meshio fails on text, on words that ParaView writes inside arrays, and on appended arrays that are not contiguous.
Source: VTK File Formats, "XML file formats" (vtk.org).
"""

from __future__ import annotations

import base64
import re
from xml.etree import ElementTree

from softmark.solvers.mesh.files.gmsh1 import MalformedMeshFile

WIDE = {"UInt32": 4, "UInt64": 8}  # bytes of a size
ARRAYS = ("DataArray", "Array")


def is_vtu(data: bytes) -> bool:
    """Return whether the data are a VTK XML file."""
    head = data[:4096].lstrip(b"\xef\xbb\xbf \t\r\n")
    return head.startswith((b"<?xml", b"<VTKFile")) and b"<VTKFile" in head


def inline_arrays(data: bytes) -> bytes:
    """Return the VTU file of an unstructured grid with all numeric arrays inline and without text arrays.

    Raises MalformedMeshFile.
    """
    begins = re.search(rb"<AppendedData[^<>]{0,200}>", data)
    head = data if begins is None else data[: begins.start()] + b"</VTKFile>"
    if b"<!DOCTYPE" in head or b"<!ENTITY" in head:
        raise MalformedMeshFile("it declares a document type or entities: remove them")
    try:
        top = ElementTree.fromstring(head)
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        raise MalformedMeshFile(f"it is not complete XML ({error})") from error
    if top.get("type") != "UnstructuredGrid":
        raise MalformedMeshFile(
            f"it contains `{(top.get('type') or '')[:40]}`, not an unstructured grid: save it as .vtu or .vtk"
        )
    appended = _AppendedSection(
        top, b"" if begins is None else begins.group(), b"" if begins is None else data[begins.end() :]
    )
    for parent in list(top.iter()):
        for own in [own for own in parent if own.tag in ARRAYS]:
            if own.tag == "Array" or own.get("type", "").lower() == "string":
                parent.remove(own)
                continue
            for inner in list(own):
                own.remove(inner)
            appended.inline(own)
    return ElementTree.tostring(top)


class _AppendedSection:
    """The section of a file that contains the appended arrays."""

    def __init__(self, top: ElementTree.Element, tag: bytes, data: bytes) -> None:
        raw = b'"raw"' in tag or b"'raw'" in tag
        self.data = data.partition(b"_")[2] if raw else data.partition(b"<")[0].partition(b"_")[2].rstrip()
        self.raw, self.packed = raw, top.get("compressor") is not None
        self.order = "big" if top.get("byte_order") == "BigEndian" else "little"
        self.wide = WIDE.get(top.get("header_type", "UInt32"), 4)
        starts = sorted({int(own.get("offset", "0")) for own in top.iter() if own.get("format") == "appended"})
        last = data.rfind(b"</AppendedData") if raw else -1
        whole = len(self.data) - (len(data) - last if last >= 0 else 0)
        self.ends = dict(zip(starts, [*starts[1:], whole][: len(starts)], strict=True))

    def inline(self, own: ElementTree.Element) -> None:
        """Move an appended array into the XML element `own` that describes it. Raises MalformedMeshFile."""
        if own.get("format") != "appended":
            return
        start = int(own.get("offset", "0"))
        block = self.data[start : self.ends[start]]
        if not 0 <= start < len(self.data) or not block:
            raise MalformedMeshFile(f"`{(own.get('name') or own.get('Name') or '')[:40]}` is incomplete")
        own.set("format", "binary")
        del own.attrib["offset"]
        own.text = (self._encode_base64(block) if self.raw else block.strip()).decode("ascii")

    def _encode_base64(self, block: bytes) -> bytes:
        """Return raw bytes as base64; the sizes of compressed blocks are encoded separately from the blocks."""
        first = int.from_bytes(block[: self.wide], self.order)  # type: ignore[arg-type]
        if not self.packed:
            return base64.b64encode(block[: self.wide + first])
        cut = self.wide * (3 + first)
        return base64.b64encode(block[:cut]) + base64.b64encode(block[cut:])
