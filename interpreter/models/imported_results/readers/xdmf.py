"""Reader of XDMF: single grids or series of grids, with numbers in the XML itself or in HDF5 files next to it.

meshio is not used, because it opens any path that a file names.

Source: XDMF Model and Format (xdmf.org), versions 2 and 3.
"""

from __future__ import annotations

import math
import re
from contextlib import ExitStack
from dataclasses import field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.models.imported_results.readers.result_frames import (
    AGAIN,
    FLAT,
    Block,
    ResultState,
    checked_state,
    combine_states,
    state_on_mesh,
)
from softmark.interpreter.models.imported_results.readers.xml_trees import (
    ElementT,
    numbers,
    parse_xml,
    resolve_within_folder,
)
from softmark.interpreter.models.imported_results.result_file import ResultFile
from softmark.records import dataclass
from softmark.references.measured_data import Unreadable
from softmark.resource_limits import limited_resources
from softmark.safe_files import read_regular
from softmark.solvers.elements import element_of
from softmark.solvers.mesh.files.mesh_reader import KINDS

Array = NDArray[np.generic]

PLAIN = "write its numbers as XML, or in an HDF5 file next to it"
CODES = {"Float": "f", "Int": "i", "UInt": "u"}
INCLUDES = ("{http://www.w3.org/2001/XInclude}include", "{http://www.w3.org/2003/XInclude}include")


@dataclass(frozen=True)
class XdmfFile:
    """XDMF file, and the HDF5 files in its folder that hold its numbers.

    `files` has the HDF5 files by the names that the XDMF file uses for them.
    """

    name: str
    files: dict[str, Path]
    stack: ExitStack
    known: dict[Any, Any] = field(default_factory=dict)  # opened files and numbers, by key

    def unreadable_error(self, reason: str, remedy: str = AGAIN) -> Unreadable:
        """Return the exception Unreadable with a reason and a remedy."""
        return Unreadable(self.name, reason, remedy)

    def numbers(self, of: ElementT) -> Array:
        """Return the numbers of the single data item of an element, in the declared shape. Raises Unreadable."""
        items = of.findall("DataItem")
        if len(items) != 1 or list(items[0]):
            raise self.unreadable_error(
                f"`{of.tag}` contains {len(items)} items or parts of items, not one item of numbers", PLAIN
            )
        item, form = items[0], items[0].get("Format", "XML")
        told = item.get("Dimensions", "")
        if not re.fullmatch(r"\s*\d{1,12}(\s+\d{1,12}){0,3}\s*", told):
            raise self.unreadable_error(f"the dimensions of an item are `{told[:40]}`")
        if form == "XML":
            found = self._numbers_from_text(item)
        elif form == "HDF":
            found = self._numbers_from_hdf5((item.text or "").strip())
        else:
            raise self.unreadable_error(f"its numbers have the format `{form[:40]}`, which is not supported", PLAIN)
        shape = tuple(map(int, told.split()))
        if found.size != math.prod(shape):
            raise self.unreadable_error(
                f"an item of `{of.tag}` has {found.size} numbers, but {math.prod(shape)} are announced"
            )
        return found.reshape(shape)

    def _numbers_from_text(self, item: ElementT) -> Array:
        kind, size = item.get("NumberType") or item.get("DataType") or "Float", item.get("Precision", "4")
        if kind not in CODES or size not in ("1", "2", "4", "8"):
            raise self.unreadable_error(f"its numbers have the type `{kind[:40]}` with {size[:40]} bytes")
        try:
            return numbers(item.text or "", CODES[kind] + "8")
        except (ValueError, OverflowError) as error:
            raise self.unreadable_error(f"an item is not a text of numbers ({str(error)[:80]})") from None

    def _numbers_from_hdf5(self, told: str) -> Array:
        """Return numbers from an HDF5 file, which must be in the folder of the XDMF file. Raises Unreadable."""
        import h5py

        word, _, inner = told.partition(":")
        if word not in self.known:
            self.known[word] = self.stack.enter_context(h5py.File(self.files[word.strip()], "r"))
        found = self.known[word]
        for key in filter(None, inner.strip().split("/")):
            if not isinstance(found, h5py.Group) or key not in found:
                raise self.unreadable_error(f"`{told[:80]}` is not in that file")
            if not isinstance(found.get(key, getlink=True), h5py.HardLink):
                raise self.unreadable_error(f"`{told[:80]}` is a link to another place", "write the numbers themselves")
            found = found[key]
        if not isinstance(found, h5py.Dataset) or found.is_virtual or found.external or found.dtype.kind not in "fiu":
            raise self.unreadable_error(f"`{told[:80]}` contains no numbers of its own", "write the numbers themselves")
        return np.asarray(found[()])


def read(file: Path) -> ResultFile:
    """Return the points, cells and vectors of an XDMF file in all its states. Raises Unreadable."""
    with limited_resources(file):
        top = parse_xml(file.name, read_regular(file), "Xdmf")
    texts = [i.text.partition(":")[0].strip() for i in top.iter("DataItem") if i.get("Format") == "HDF" and i.text]
    files = {word: resolve_within_folder(file.name, file.parent, word) for word in sorted(set(texts))}
    size = file.stat().st_size + sum(path.stat().st_size for path in files.values())
    with limited_resources(file, size), ExitStack() as stack:
        try:
            return combine_states(file.name, _states_of_grids(XdmfFile(file.name, files, stack), top))
        except ModuleNotFoundError:
            remedy = 'run `pip install "softmark[xdmf]"`, or write the numbers as XML'
            raise Unreadable(file.name, "its numbers are stored in HDF5, and h5py is not installed", remedy) from None


def _states_of_grids(source: XdmfFile, top: ElementT) -> list[ResultState]:
    """Return the states of the grids; grids with equal times are combined. Raises Unreadable."""
    grids = top.findall("Domain/Grid")
    series = [grid for grid in grids if grid.get("GridType") == "Collection"]
    if wrong := next((g for g in series if g.get("CollectionType", "Spatial") != "Temporal"), None):
        reason = f"its collection `{wrong.get('Name', '')}` contains parts, not times"
        raise source.unreadable_error(reason, "merge the parts, and write one grid for each time")
    whole = [grid for grid in top.iter("Grid") if _has_own_mesh(grid)]
    steps: dict[object, tuple[ElementT, float | None, list[ElementT]]] = {}
    for several in [s.findall("Grid") for s in series] or [grids]:
        mesh = next((grid for grid in several if _has_own_mesh(grid)), next(iter(whole), None))
        for i, grid in enumerate(several):
            time = _time_of_grid(source, grid)
            base = grid if _has_own_mesh(grid) else mesh
            if base is None or any(part.get("href") for tag in INCLUDES for part in grid.findall(tag)):
                raise source.unreadable_error(
                    "it has no grid with its points and cells", "write them into the file itself"
                )
            kept = steps.setdefault(i if time is None else ("at", time), (base, time, []))
            kept[2].extend(grid.findall("Attribute"))
    if not series and len(steps) > 1:
        raise source.unreadable_error(f"it has {len(steps)} separate grids", "write one grid, or a collection of times")
    return [_state_of_grid(source, *step) for step in steps.values()]


def _has_own_mesh(grid: ElementT) -> bool:
    return grid.find("Topology") is not None and grid.find("Geometry") is not None


def _time_of_grid(source: XdmfFile, grid: ElementT) -> float | None:
    told = grid.find("Time")
    if told is None:
        return None
    try:
        return float(told.get("Value", ""))
    except ValueError:
        raise source.unreadable_error("one of its times is not given as a Value", "write times as Value") from None


def _state_of_grid(source: XdmfFile, base: ElementT, time: float | None, attributes: list[ElementT]) -> ResultState:
    """Return the state of a grid: points, cells, and values at the points. Raises Unreadable."""
    if base not in source.known:  # which series share
        source.known[base] = _plane_flag_and_mesh(source, base)
    plane, mesh = source.known[base]
    arrays: dict[str, Array] = {}
    left = []
    for each in attributes:
        word = each.get("Name", "")
        if each.get("Center", "Node") != "Node":
            left.append(f"`{word}` of {each.get('Center', '').lower()}s")
        elif word in arrays:
            raise source.unreadable_error(f"it has `{word}` twice" + ("" if time is None else f" at time {time:g}"))
        else:
            values = source.numbers(each)
            arrays[word] = _extend_to_3d(values) if plane else values
    return state_on_mesh(source.name, mesh, arrays, time, tuple(left))


def _plane_flag_and_mesh(source: XdmfFile, base: ElementT) -> tuple[bool, ResultState]:
    """Return whether a grid is plane, and a state with its points and cells. Raises Unreadable."""
    geometry, topology = (base.findall(word)[0] for word in ("Geometry", "Topology"))
    kind = geometry.get("GeometryType") or geometry.get("Type") or "XYZ"
    if kind not in ("XYZ", "XY"):
        raise source.unreadable_error(f"its geometry is `{kind[:40]}`, not XYZ or XY", "write points")
    X = source.numbers(geometry).astype(np.float64)
    X = X.reshape(-1, len(kind)) if X.ndim == 1 else X
    return kind == "XY", checked_state(
        source.name, _extend_to_3d(X) if kind == "XY" else X, _cells(source, topology), {}
    )


def _extend_to_3d(values: Array) -> Array:
    """Return 2D vectors (n, 2) as (n, 3), with a third component of zero."""
    return np.pad(values, ((0, 0), (0, 1))) if values.ndim == 2 and values.shape[1] == 2 else values


def _cells(source: XdmfFile, topology: ElementT) -> list[Block]:
    """Return the cells of a topology. Raises Unreadable."""
    from meshio.xdmf.common import translate_mixed_cells, xdmf_to_meshio_type

    if topology.get("BaseOffset", "0") != "0" or topology.get("Order"):
        raise source.unreadable_error("its cells number points from another number than 0, or in another order", AGAIN)
    kind = topology.get("TopologyType") or topology.get("Type") or ""
    data = source.numbers(topology)
    if data.dtype.kind not in "iu":
        data = _to_integers(source, data)
    if kind == "Mixed":
        return [(block.type, block.data.astype(np.int64)) for block in translate_mixed_cells(data.ravel())]
    word = {w.lower(): known for w, known in xdmf_to_meshio_type.items()}.get(kind.lower(), kind[:40])
    if data.ndim == 1 and (word in KINDS or word in FLAT):
        data = data.reshape(-1, FLAT.get(word) or element_of(KINDS[word]).nodes)
    return [(word, data.astype(np.int64).reshape(len(data), -1))]


def _to_integers(source: XdmfFile, data: Array) -> Array:
    """Return integers from numbers that may be stored as floats, the default type of XDMF. Raises Unreadable."""
    found = np.asarray(data, dtype=np.float64)
    if not (np.isfinite(found).all() and (found == np.round(found)).all() and (np.abs(found) < 2**53).all()):
        raise source.unreadable_error("the point numbers of its cells are not integers")
    return found.astype(np.int64)
