"""Reader of CSV tables: one row for each point and, if a column is called `time` or `t`, for each time.

Three columns whose names differ only at the end are a vector: `ux,uy,uz`, `u_x,u_y,u_z`, `U1,U2,U3`, or
`u:0,u:1,u:2` as written by ParaView. Positions are `X,Y,Z`, or `x0,y0,z0`, or ParaView's `Points`, or else
`x,y,z`. If a table has positions in addition to `x,y,z`, then `x,y,z` are deformed positions, as `x1,y1,z1`
are.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from softmark.interpreter.models.imported_results.readers.result_frames import checked_state, combine_states
from softmark.interpreter.models.imported_results.result_file import Floats, Ints, ResultFile
from softmark.references import csv_tables
from softmark.references.measured_data import Unreadable
from softmark.resource_limits import limited_resources

Triple = tuple[str, str, str]

ENDINGS: tuple[Triple, ...] = (
    ("x", "y", "z"), ("X", "Y", "Z"), (":0", ":1", ":2"), ("_0", "_1", "_2"), ("1", "2", "3"),
)  # fmt: skip
AT_REST: tuple[Triple, ...] = (("X", "Y", "Z"), ("x0", "y0", "z0"), ("X0", "Y0", "Z0"))
PLACES: tuple[Triple, ...] = (
    *AT_REST, ("Points:0", "Points:1", "Points:2"), ("Points_0", "Points_1", "Points_2"), ("x", "y", "z"),
)  # fmt: skip
MOVED: tuple[Triple, ...] = (("x1", "y1", "z1"), ("x", "y", "z"))
LETTERS: Triple = ("u", "v", "w")
MOST = 1000  # largest number of columns
TIMES = ("time", "t", "Time")
UNIT = re.compile(r"(.*\S)\s*[\[(].*[\])]")


def read(file: Path) -> ResultFile:
    """Return the points of a CSV table and their vectors at all times. Raises Unreadable."""
    with limited_resources(file):
        words = csv_tables.read_header(file)
        if len(words) > MOST:
            raise Unreadable(
                file.name,
                f"it has {len(words)} columns, more than the limit of {MOST}",
                "remove columns that are not needed",
            )
        if worded := next(filter(None, map(UNIT.fullmatch, words)), None):
            remedy = f"name it `{worded[1]}`, and write the unit in the scene"
            raise Unreadable(file.name, f"the name of its column `{worded[0]}` contains a unit", remedy)
        places = _first_matching_triple(PLACES, words)
        if places is None:
            reason = f"its columns do not contain positions: {', '.join(f'`{w}`' for w in words[:12])}"
            raise Unreadable(
                file.name, reason, "name the columns `X`, `Y` and `Z`, and displacements `ux`, `uy` and `uz`"
            )
        moved = _first_matching_triple(tuple(t for t in MOVED if t != places), words)
        vectors = _vectors(file.name, words, {*places, *(moved or ())})
        clock = [word for word in TIMES if word in words][:1]
        asked = [*places, *(moved or ()), *(w for triple in vectors.values() for w in triple), *clock]
        found = csv_tables.read_columns(file, asked)
        left = (*(f"column `{w}`" for w in words if w not in asked), *found.notes)
        return _group_by_time(file.name, found, places, moved, vectors, clock, left)


def _first_matching_triple(triples: Sequence[Triple], words: Sequence[str]) -> Triple | None:
    """Return the first triple of columns whose name is one of the `words`, else None."""
    return next((triple for triple in triples if set(triple) <= set(words)), None)


def _vectors(name: str, words: Sequence[str], taken: set[str]) -> dict[str, Triple]:
    """Return columns grouped to vectors by the common part of their names. Raises Unreadable for duplicates."""
    found: list[tuple[str, Triple]] = []
    free = set(words) - taken
    for word in words:
        for a, b, c in ENDINGS:
            stem = word.removesuffix(a)
            triple = (word, stem + b, stem + c)
            if word.endswith(a) and stem.rstrip("_ .") and set(triple) <= free:
                found.append((stem.rstrip("_ ."), triple))
    found += [("u", LETTERS)] if set(LETTERS) <= free else []
    known = dict(found)
    for stem, triple in found:
        if known[stem] != triple:
            both = " and ".join(f"`{', '.join(own)}`" for own in (triple, known[stem]))
            raise Unreadable(name, f"two of its vectors are named `{stem}`: {both}", "give each a different name")
    return known


def _group_by_time(
    name: str,
    found: csv_tables.Columns,
    places: Triple,
    moved: Triple | None,
    vectors: dict[str, Triple],
    clock: Sequence[str],
    left: tuple[str, ...],
) -> ResultFile:
    """Return the rows grouped by time. Raises Unreadable."""
    X, arrays = _stack_vectors(found, places), {word: _stack_vectors(found, triple) for word, triple in vectors.items()}
    times = np.array(found.numbers[clock[0]]) if clock else np.zeros(len(X))
    groups = _rows_by_time(times)
    every = combine_states(
        name,
        (
            checked_state(
                name, X[rows], (), {w: a[rows] for w, a in arrays.items()}, times[rows[0]] if clock else None, left
            )
            for rows in groups
        ),
    )
    if every.moved is not None and (moved or places in AT_REST):
        columns = ", ".join(f"`{w}`" for w in places)
        reason = f"the undeformed positions in {columns} differ between times"
        raise Unreadable(name, reason, "write the points in the same order at each time")
    if moved is None:
        return every
    x = _stack_vectors(found, moved)
    return replace(every, moved=np.stack([x[rows] for rows in groups]))


def _rows_by_time(times: Floats) -> list[Ints]:
    """Return the rows of each time, in the order of times; rows of one time are in the order of the file."""
    order = np.argsort(times, kind="stable")
    return [rows.astype(np.int64) for rows in np.split(order, np.flatnonzero(np.diff(times[order])) + 1)]


def _stack_vectors(found: csv_tables.Columns, triple: Triple) -> Floats:
    """Return triples of columns as vectors (n, 3)."""
    return np.column_stack([np.array(found.numbers[word]) for word in triple])
