"""Points tracked from one state of a body to another: beads, ink dots, corners.

A table is a CSV file. Lines before its header are titles and are not read. The header names the columns, in any order:

    x0, y0, z0     position at rest
    x1, y1, z1     position in state 1; x2, y2, z2 in state 2, and so on
    i, j, k        optional: indices of points on a grid
    name           optional: name of a point

Rows with a missing position are left out, and their number is reported.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

from softmark.records import dataclass
from softmark.references.data_download import find_file, source_of
from softmark.references.measured_data import FileFrame, MeasuredPoints, Unreadable, Vector
from softmark.references.reference_base import How, Reference
from softmark.resource_limits import describe_read_error, limited_resources
from softmark.safe_files import open_regular

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np

REST = ("x0", "y0", "z0")


@dataclass(frozen=True)
class TrackedPoints(Reference):
    """Points of a body tracked under load: a table of positions at rest and in other states.

    The table is a CSV file whose header names the columns x0, y0, z0 at rest, x1, y1, z1 in state 1 and so on, and
    optionally i, j, k or name; lines before the header are titles. `state` is the state that is compared, or `states`
    one for each state of the analysis; displacements are measured from the state `rest`. `x` and `z` are the file's
    directions of the scene's axes, y follows; `unit` is the length of one unit of the file; `origin` is the position of
    the file's origin.

    `uncertainty` is the largest error of any displacement: smaller differences are not significant. A path that begins
    with `data:` names a public data set, which is downloaded once.
    Source: the authors of the measurement, given by `citation` or the data set.
    """

    path: Annotated[str, "file", "path of the table, relative to the scene, or a data set such as `data:...`"]
    unit: Annotated[float, "m in (0, inf)", "length of one unit of the table's positions"]
    uncertainty: Annotated[float, "m in [0, inf)", "largest error of a measured displacement"]
    state: Annotated[int, "1 in [0, 1000]", "number of the state to compare, as in the column names"] = 1
    states: Annotated[
        Any | None, "values of 1 in [0, 1000]", "numbers of the states to compare, one for each state of the analysis"
    ] = None
    rest: Annotated[int, "1 in [0, 1000]", "number of the state from which displacements are measured"] = 0
    x: Annotated[Vector, "direction", "direction in the file of the scene's x axis"] = (1.0, 0.0, 0.0)
    z: Annotated[Vector, "direction", "direction in the file of the scene's z axis"] = (0.0, 0.0, 1.0)
    origin: Annotated[Vector, "m", "position of the file's origin in the scene"] = (0.0, 0.0, 0.0)
    citation: Annotated[str, "authors of the measurement"] = ""
    body: Annotated[str | None, "body", "body; needed if the scene has several"] = None

    how: ClassVar[How] = "measured"
    table: ClassVar[str] = "not a valid table of points"
    source: ClassVar[str] = "the file named in the scene"
    error_meaning: ClassVar[str] = "uncertainty of a measured displacement, m, as stated in the scene"

    def unfit(self) -> tuple[str, str] | None:
        """Return the reason why the table lacks points in a requested state, and the remedy; None if it has them.

        The check reads no numbers.
        """
        try:
            states = read_table(Path(self.path)).states
        except Unreadable as error:
            return error.reason, error.remedy
        compared = (self.state,) if self.states is None else self.states.values
        lacking = next((s for s in (self.rest, *compared) if s not in states), None)
        if lacking is None:
            return None
        return f"the table has no state {lacking:g}", f"its states are {', '.join(map(str, states))}"

    def in_state(self, number: int, value: float) -> Self:
        """Return the points for one state of the analysis; `number` counts states from 0."""
        if self.states is None or number >= len(self.states.values):  # too few are refused when a scene is checked
            return self
        return replace(self, state=int(self.states.values[number]), states=None)

    def load(self, beside: Path | None = None) -> MeasuredPoints:
        """Return the points at rest and their displacements, in the scene's coordinates. Raises Unreadable."""
        table = read_table(find_file(self.path, beside))
        rest, now = (table.positions(state) for state in (self.rest, self.state))
        there = np.asarray(np.isfinite(np.hstack([rest, now])).all(axis=1))
        if not there.any():
            raise Unreadable(table.name, f"no point has a position in states {self.rest} and {self.state}",
                             "repair the table")  # fmt: skip
        frame = FileFrame(self.unit, self.x, self.z, self.origin)
        gone = int((~there).sum())
        return MeasuredPoints(
            frame.points(rest[there], table.name),
            frame.vectors((now - rest)[there], table.name),
            self.uncertainty,
            source_of(self.citation, self.path, table.name),
            tuple(name for name, kept in zip(table.names, there, strict=True) if kept),
            table.grid(there),
            (f"{gone} of {len(there)} points without a position are omitted",) if gone else (),
        )


@dataclass(frozen=True)
class MarkerTable:
    """Table of tracked points, with its fields by column."""

    name: str
    columns: dict[str, tuple[str, ...]]

    @property
    def states(self) -> list[int]:
        """Numbers of the states for which the table has all three coordinates."""
        numbers = (c[1:] for c in self.columns if c[:1] == "x" and c[1:].isdecimal())
        return sorted(int(n) for n in numbers if all(a + n in self.columns for a in "yz"))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the points: from the column `name`, from the indices i, j, k, or from the row number."""
        if "name" in self.columns:
            return self.columns["name"]
        if all(c in self.columns for c in "ijk"):
            return tuple(",".join(row) for row in zip(*(self.columns[c] for c in "ijk"), strict=True))
        return tuple(str(i + 1) for i in range(len(self.columns[REST[0]])))

    def positions(self, state: int) -> Array:
        """Return the positions (n, 3) in a state, in the table's units; NaN if missing. Raises Unreadable."""
        if state not in self.states:
            listed = ", ".join(map(str, self.states))
            raise Unreadable(self.name, f"the table has no state {state}", f"its states are {listed}")
        return np.stack([self._column_values(f"{axis}{state}") for axis in "xyz"], axis=1)

    def grid(self, kept: NDArray[np.bool_]) -> NDArray[np.int64] | None:
        """Return the indices i, j, k (n, 3) of the points selected by `kept`, None if the table has none."""
        if not all(c in self.columns for c in "ijk"):
            return None
        return np.stack([self._column_values(c) for c in "ijk"], axis=1)[kept].astype(np.int64)

    def _column_values(self, column: str) -> Array:
        values = np.full(len(self.columns[column]), np.nan)
        for row, text in enumerate(self.columns[column]):
            try:
                values[row] = float(text) if text else np.nan
            except ValueError:
                raise Unreadable(self.name, f"`{text}` in column {column} is not a number",
                                 "leave the field of a missing position empty") from None  # fmt: skip
        return values


def read_table(file: Path) -> MarkerTable:
    """Return the table of tracked points in a file. Raises Unreadable."""
    import csv

    try:
        with limited_resources(file), TextIOWrapper(open_regular(file), encoding="utf-8-sig", newline="") as lines:
            rows = [[text.strip() for text in row] for row in csv.reader(lines)]
    except (OSError, UnicodeDecodeError, csv.Error, MemoryError) as error:
        raise Unreadable(
            file.name, f"it cannot be read ({describe_read_error(error)})", "give a CSV file in UTF-8"
        ) from None
    at = next((i for i, row in enumerate(rows) if set(REST) <= {c.lower() for c in row}), None)
    if at is None:
        raise Unreadable(file.name, "its header has no columns x0, y0, z0 for the positions at rest",
                         "name the columns x0, y0, z0, x1, y1, z1 and so on")  # fmt: skip
    return MarkerTable(file.name, _parse_columns(file.name, [c.lower() for c in rows[at]], rows[at + 1 :]))


def _parse_columns(name: str, header: list[str], rows: Iterable[list[str]]) -> dict[str, tuple[str, ...]]:
    if twice := next((c for c in header if c and header.count(c) > 1), None):
        numbers = ", ".join(str(i + 1) for i, c in enumerate(header) if c == twice)
        raise Unreadable(name, f"several columns are called `{twice}`: number {numbers}", "give each its own name")
    filled = [row for row in rows if any(row)]
    wrong = next((row for row in filled if len(row) != len(header)), None)
    if wrong is not None or not filled:
        what = f"a row has {len(wrong)} fields, the header has {len(header)}" if wrong else "it has no rows"
        raise Unreadable(name, what, "give each point one row")
    return {c: column for c, column in zip(header, zip(*filled, strict=True), strict=True) if c}
