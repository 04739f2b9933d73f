"""Element type names of Abaqus and CalculiX, and the cell type of each.

Source: Abaqus Analysis User's Guide, "Element index"; Dhondt, "CalculiX CrunchiX User's Manual", section 6.2.
"""

from __future__ import annotations

import re

# cells in the words of meshio, by family and number of nodes
SOLIDS = {4: "tetra", 5: "pyramid", 6: "wedge", 8: "hexahedron", 10: "tetra10", 15: "wedge15", 20: "hexahedron20"}
SURFACES = {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8", 9: "quad9"}
LINES = {2: "line", 3: "line3"}
COUNTS = {"tetra": 4, "pyramid": 5, "wedge": 6, "hexahedron": 8, "tetra10": 10, "wedge15": 15, "hexahedron20": 20,
          "triangle": 3, "quad": 4, "triangle6": 6, "quad8": 8, "quad9": 9, "line": 2, "line3": 3}  # fmt: skip
_SOLID = re.compile(r"[A-Z]{0,2}C3D(\d+)")
_SURFACE = re.compile(r"(?:S|DS|M3D|SFM3D|R3D|CPS|CPE|CAX|DC2D|DCAX|CPEG|AC2D)(\d+)")
_LINE = re.compile(r"(?:[TR][23]D|B[23])(\d)")
_BEAM = {"B21": "line", "B22": "line3", "B23": "line", "B31": "line", "B32": "line3", "B33": "line"}
_NAMED = {"STRI3": "triangle", "STRI65": "triangle6", "S9R5": "quad9"}


def meshio_cell_name(kind: str) -> str | None:
    """Return meshio's cell name for an element type, such as `hexahedron` for `C3D8R`; None if unsupported."""
    word = kind.upper()
    if word in _NAMED:
        return _NAMED[word]
    if found := _SOLID.match(word):
        return SOLIDS.get(int(found[1]))
    if word[:3] in _BEAM:
        return _BEAM[word[:3]]
    if found := _LINE.match(word):
        return LINES.get(int(found[1]))
    if found := _SURFACE.match(word):
        return SURFACES.get(int(found[1]))
    return None
