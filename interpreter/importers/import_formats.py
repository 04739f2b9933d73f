"""Reader of each file extension. To add a format: a module with `read(path) -> Deck`, and a line here.

Readers are imported on first use, so that listing the formats loads no array libraries.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from softmark.interpreter.importers.imported_deck import Deck

AGAIN = "export the file again"
READERS = {".feb": "febio_deck", ".inp": "abaqus_deck", ".msh": "gmsh_import", ".pml": "pml_import"}
WITH_CURVES = frozenset({"febio_deck"})  # readers that can import a time before the end
TITLES = "CalculiX and Abaqus (.inp), FEBio (.feb), Gmsh (.msh), PML with its LML (.pml)"


def read(path: Path, moment: float | None = None) -> Deck:
    """Read a deck or mesh at a time of its analysis (by default its end). Raises Unreadable, NotImportable."""
    import numpy as np

    from softmark.references.measured_data import UNPACK, Unreadable, require_uncompressed
    from softmark.resource_limits import describe_read_error, limited_resources

    reader = READERS.get(path.suffix.lower())
    if reader is None and path.is_dir():
        raise Unreadable(str(path), "it is a folder", f"give a file in it; supported are {TITLES}")
    if reader is None:
        remedy = UNPACK if path.suffix.lower() == ".gz" else f"supported are {TITLES}"
        raise Unreadable(path.name, f"unknown file extension `{path.suffix or path.name}`", remedy)
    own = import_module(f"softmark.interpreter.importers.{reader}")
    if moment is not None and reader not in WITH_CURVES:
        from softmark.interpreter.importers.imported_deck import NotImportable

        raise NotImportable(f"{path.name} has no load curves", "omit `--at`, which is only for FEBio files")
    try:
        if not path.is_file():
            what = "it is a folder" if path.is_dir() else "there is no such file"
            raise Unreadable(path.name, what, "check the path")
        require_uncompressed(path)
        with limited_resources(path), np.errstate(all="ignore"):
            found: Deck = own.read(path) if moment is None else own.read(path, moment)
    except (MemoryError, OSError, RecursionError) as error:
        raise Unreadable(path.name, describe_read_error(error), AGAIN) from None
    except (
        ValueError,
        LookupError,
        ArithmeticError,
    ) as error:  # unexpected defects of the file
        raise Unreadable(path.name, f"its content is inconsistent ({describe_read_error(error)})", AGAIN) from error
    return found
