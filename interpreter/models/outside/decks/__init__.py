"""Files that a model is exported as, a module each: `refuses(problem)` and `export(problem, named, folder)`.

`refuses` says what of a problem has no words in the format, and why; `export` writes files and gives their names.
To add a format: that file (of a program that is run too, its adapter), and a line here.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

FORMATS: dict[str, tuple[str, str]] = {  # the module, and what it is
    "calculix": ("adapters.calculix", "an input deck, `ccx -i job` runs it"),
    "gmsh": ("decks.gmsh", "the mesh as Gmsh 4.1, with materials, supports and loads as physical groups"),
    "vtu": ("decks.vtu", "the mesh as VTU, with forces, what is held and by how much at its nodes"),
}


def form(name: str) -> Any:
    """The module of a format. Raises KeyError for one that is in no table."""
    return import_module(f"softmark.interpreter.models.outside.{FORMATS[name][0]}")
