"""Reader of CalculiX results, .frd as text: nodes, cells, and nodal vectors of all increments, at their total times.

Columns are of fixed width.

Source: G. Kaminski and K. Wittig, CalculiX GraphiX user's manual, "Result format".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from pathlib import Path

import numpy as np

from softmark.interpreter.models.imported_results.readers.result_frames import (
    AGAIN,
    Block,
    ResultState,
    checked_state,
    combine_states,
    state_on_mesh,
)
from softmark.interpreter.models.imported_results.readers.xml_trees import numbers
from softmark.interpreter.models.imported_results.result_file import Floats, Ints, ResultFile
from softmark.records import dataclass
from softmark.references.measured_data import Unreadable
from softmark.resource_limits import limited_resources
from softmark.safe_files import read_regular

# number of a type of cell -> meshio's word and its nodes
TYPES = {1: ("hexahedron", 8), 2: ("wedge", 6), 3: ("tetra", 4), 4: ("hexahedron20", 20), 5: ("wedge15", 15),
         6: ("tetra10", 10), 7: ("triangle", 3), 8: ("triangle6", 6), 9: ("quad", 4), 10: ("quad8", 8),
         11: ("line", 2), 12: ("line3", 3)}  # fmt: skip
# its middles of upright edges come before those of the top, ours after them
ORDER = {"hexahedron20": [*range(12), *range(16, 20), *range(12, 16)]}
WIDTHS = {0: 5, 1: 10}  # characters of a node number, by format code; other codes are binary
NUMBER = 12  # characters of a number
FREQUENCIES = 2  # ictype of a vibration mode
ENDED = "it has no last line 9999: CalculiX did not finish, and the last results are not in equilibrium"
TEXT = "write results with `*NODE FILE`, which is text, instead of `*NODE OUTPUT`"


@dataclass(frozen=True)
class Lines:
    """Lines of a CalculiX file, read one after another from a current position."""

    name: str
    rows: list[bytes]
    at: list[int] = field(default_factory=lambda: [0])

    def heads(self) -> Iterator[tuple[str, bytes, int]]:
        """Yield the first line of each block with its key (2C, 3C or 100C) and its line number. Raises Unreadable."""
        while self.at[0] < len(self.rows):
            row, here = self.rows[self.at[0]], self.at[0] + 1
            self.at[0] += 1
            key = row[:6].strip().decode("latin-1")
            if key == "9999":
                return
            if key in ("2C", "3C", "100C"):
                yield key, row, here
            elif row.strip() and not key.startswith("1"):  # descriptions of the file and of a step
                raise Unreadable(self.name, f"line {here} begins an unknown block", AGAIN)
        raise Unreadable(self.name, ENDED, "find the cause in the log of CalculiX, and let it finish")

    def block(self) -> tuple[int, list[bytes]]:
        """Return the lines from the current position to the end of the block, and the number of the first one, from 1.

        A line ` -3` ends a block and is not returned. Raises Unreadable.
        """
        start = i = self.at[0]
        while i < len(self.rows) and self.rows[i][:3] not in (b" -3",):
            if self.rows[i][:3] not in (b" -1", b" -2", b" -4", b" -5"):
                raise Unreadable(self.name, f"line {i + 1} is in a block that is not closed", AGAIN)
            i += 1
        if i == len(self.rows):
            raise Unreadable(self.name, f"it ends in the block of line {start + 1}", AGAIN)
        self.at[0] = i + 1
        return start + 1, self.rows[start:i]


def read(file: Path) -> ResultFile:
    """Return the nodes, cells and nodal vectors of a CalculiX file in all increments. Raises Unreadable."""
    with limited_resources(file):
        lines = Lines(file.name, read_regular(file).replace(b"\r\n", b"\n").split(b"\n"))
        heads = lines.heads()
        key, row, here = next(heads, ("", b"", 0))
        if key != "2C":
            raise Unreadable(file.name, "it does not begin with nodes", AGAIN)
        ids, X = _nodes(lines, row, here)
        blocks = list[Block]()
        steps: dict[float, dict[str, Floats]] = {}
        left = dict[str, None]()
        for key, row, here in heads:
            if key == "2C":
                raise Unreadable(file.name, f"line {here}: it has a second block of nodes", AGAIN)
            if key == "3C":
                blocks += _cells(lines, row, here, ids)
                continue
            time, word, values = _read_result_block(lines, row, here, ids)
            if values is None:
                left[f"`{word}`"] = None
            elif word in steps.setdefault(time, {}):
                reason = f"line {here}: `{word}` appears twice at time {time:g}"
                raise Unreadable(file.name, reason, "write each increment once")
            else:
                steps[time][word] = values
        if not steps:
            remedy = "write them: `*NODE FILE` and a line `U` in each step"
            raise Unreadable(file.name, "it has no vectors at nodes", remedy)
        return combine_states(file.name, _states_of_increments(file.name, X, tuple(blocks), steps, tuple(left)), ids)


def _states_of_increments(name: str, X: Floats, blocks: tuple[Block, ...], steps: dict[float, dict[str, Floats]],
             left: tuple[str, ...]) -> list[ResultState]:  # fmt: skip
    """Return the states of a CalculiX file, one for each of the increments `steps`, whose keys are times.

    X are the points and `blocks` the cells of all states; `left` describes unused content. Raises Unreadable.
    """
    mesh = checked_state(name, X, blocks, {})
    return [state_on_mesh(name, mesh, found, time, left) for time, found in steps.items()]


def _node_number_width(name: str, row: bytes, here: int) -> int:
    """Return the number of characters of node numbers, from the format code at the end of a line. Raises Unreadable."""
    form = row.split()[-1] if row.split() else b""
    if form in (b"2", b"3"):
        raise Unreadable(name, f"line {here} is binary", TEXT)
    if form not in (b"0", b"1"):
        raise Unreadable(name, f"line {here} has the format `{form.decode('latin-1')[:20]}`, not 0 or 1", AGAIN)
    return WIDTHS[int(form)]


def _number_value_table(name: str, rows: list[bytes], line: int, width: int, many: int) -> tuple[Ints, Floats]:
    """Return node numbers (k,) and values (k, many) of lines that begin with ` -1`. Raises Unreadable."""
    ends = np.cumsum([3, width, *[NUMBER] * many])
    rows = [row.rstrip() for row in rows]
    for i, row in enumerate(rows):
        if len(row) != ends[-1] or row[:3] != b" -1":
            raise Unreadable(name, f"line {line + i} is not a node with {many} numbers", AGAIN)
    letters = np.frombuffer(b"".join(rows), dtype="S1").reshape(-1, ends[-1])
    try:  # columns have no blanks between them
        found = numbers(np.insert(letters, ends[:-1], b" ", axis=1)[:, 3:].tobytes().decode("latin-1"), "f8")
        found = found.reshape(len(rows), 1 + many)
        return found[:, 0].astype(np.int64), np.ascontiguousarray(found[:, 1:])
    except ValueError as error:
        raise Unreadable(
            name, f"the lines after line {line} are not a table of numbers ({str(error)[:80]})", AGAIN
        ) from None


def _nodes(lines: Lines, row: bytes, here: int) -> tuple[Ints, Floats]:
    """Return node numbers (n,) and positions (n, 3). Raises Unreadable."""
    width = _node_number_width(lines.name, row, here)
    line, rows = lines.block()
    ids, X = _number_value_table(lines.name, rows, line, width, 3)
    promised = row[6:36].strip()
    if not promised.isdigit() or int(promised) != len(ids):
        shown = promised.decode("latin-1")[:20]
        raise Unreadable(lines.name, f"line {here} announces {shown} nodes, but there are {len(ids)}", AGAIN)
    if len(np.unique(ids)) < len(ids):
        raise Unreadable(lines.name, "two of its nodes have the same number", AGAIN)
    return ids, X


def _cells(lines: Lines, row: bytes, here: int, ids: Ints) -> list[Block]:
    """Return cells from lines ` -1` with the cell type and lines ` -2` with the nodes. Raises Unreadable."""
    width = _node_number_width(lines.name, row, here)
    line, rows = lines.block()
    found: dict[str, list[list[int]]] = {}
    word, many = "", 0
    cell: list[int] = []
    for i, each in enumerate(rows, line):
        begins = each[:3] == b" -1"
        if begins and len(cell) < many:
            break
        try:
            if begins:
                word, many = TYPES[int(each[3 + width : 8 + width])]
                cell = []
                found.setdefault(word, []).append(cell)
            else:
                cell += [int(each[k : k + width]) for k in range(3, len(each.rstrip()), width)]
        except (ValueError, KeyError):
            raise Unreadable(lines.name, f"line {i} is a cell of unknown type", AGAIN) from None
        if len(cell) > many:
            raise Unreadable(lines.name, f"line {i}: a cell has more than {many} nodes", AGAIN)
    if len(cell) < many:
        raise Unreadable(lines.name, f"a cell of the block of line {here} has fewer than {many} nodes", AGAIN)
    return [(word, _node_indices(lines.name, np.array(cells), ids)[:, ORDER.get(word, slice(None))])
            for word, cells in found.items()]  # fmt: skip


def _node_indices(name: str, numbers: Ints, ids: Ints) -> Ints:
    """Return the indices of nodes with these numbers in `ids`. Raises Unreadable if a number is missing."""
    order = np.argsort(ids)
    at = np.searchsorted(ids[order], numbers).clip(max=len(ids) - 1)
    places: Ints = order[at]
    wrong = np.flatnonzero((ids[places] != numbers).ravel())
    if len(wrong):
        raise Unreadable(name, f"it refers to node {numbers.ravel()[wrong[0]]}, which does not exist", AGAIN)
    return places


def _read_result_block(lines: Lines, row: bytes, here: int, ids: Ints) -> tuple[float, str, Floats | None]:
    """Return time, name and values (n, 3) of a result block. Raises Unreadable.

    Values are None if they are not a nodal vector.
    """
    width, (line, rows) = _node_number_width(lines.name, row, here), lines.block()
    try:
        time, kind = float(row[12:24]), int(row[56:58])
    except ValueError:
        raise Unreadable(lines.name, f"line {here} has no time", AGAIN) from None
    if not np.isfinite(time):
        raise Unreadable(lines.name, f"line {here}: its time is {time}", AGAIN)
    if kind == FREQUENCIES:
        raise Unreadable(
            lines.name, f"line {here} contains vibration modes, whose amplitude is arbitrary", "use a static step"
        )
    heads = sum(each[:3] in (b" -4", b" -5") for each in rows)
    if not rows or rows[0][:3] != b" -4" or any(each[:3] != b" -5" for each in rows[1:heads]):
        raise Unreadable(lines.name, f"line {line} does not name a result", AGAIN)
    word = rows[0][5:13].decode("latin-1").strip()
    told = [each for each in rows[1:heads] if each[33:38].strip() in (b"", b"0")]  # others are found of these
    if [each[18:23].strip() for each in told] != [b"2"] * 3:
        return time, word, None
    nodes, values = _number_value_table(lines.name, rows[heads:], line + heads, width, 3)
    if len(nodes) != len(ids) or not np.array_equal(np.sort(nodes), np.sort(ids)):
        reason = f"line {here}: `{word}` is given at {len(nodes)} nodes, but the mesh has {len(ids)}"
        raise Unreadable(lines.name, reason, "write it for all nodes: `*NODE FILE` without NSET")
    ordered = np.empty_like(values)
    ordered[_node_indices(lines.name, nodes, ids)] = values
    return time, word, ordered
