"""Checks of states read from a result file, one for each time, and their combination to a series."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import field, replace

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.models.imported_results.result_file import Floats, Ints, ResultFile
from softmark.records import dataclass
from softmark.references.csv_tables import LARGEST
from softmark.references.measured_data import Unreadable
from softmark.solvers.elements import element_of
from softmark.solvers.mesh.files.mesh_reader import KINDS

AGAIN = "write the file again: it may be incomplete"
PLURALS = {"triangle": "triangles", "line": "lines", "wedge": "wedges", "pyramid": "pyramids"}  # others are named
FLAT = {"triangle": 3, "triangle6": 6, "quad": 4, "quad8": 8, "quad9": 9}  # plane cells, and their points

Block = tuple[str, Ints]  # meshio's word of an element, or other words for it, and its cells (m, a)


@dataclass(frozen=True)
class ResultState:
    """State of a result file at one time: points (n, 3), blocks of cells, and arrays with a row per point."""

    points: Floats
    blocks: tuple[Block, ...]
    arrays: Mapping[str, Floats]
    time: float | None = None
    left: tuple[str, ...] = field(default=())

    @property
    def vectors(self) -> dict[str, Floats]:
        """Arrays of the file that hold one 3-vector per point, (n, 3), by name."""
        return {name: values for name, values in self.arrays.items() if values.shape[1:] == (3,)}

    @property
    def unused_array_texts(self) -> tuple[str, ...]:
        """Descriptions of arrays that are not 3-vectors."""
        rest = {name: v[0].size for name, v in self.arrays.items() if v.shape[1:] != (3,)}
        return tuple(
            f"scalars `{name}`" if k == 1 else f"`{name}`, with {k} numbers per point" for name, k in rest.items()
        )


def checked_state(
    name: str,
    points: NDArray[np.generic],
    blocks: Iterable[Block],
    arrays: Mapping[str, NDArray[np.generic]],
    time: float | None = None,
    left: tuple[str, ...] = (),
) -> ResultState:
    """Return the state of the file `name` after checking it. Raises Unreadable.

    `left` describes content of the file that is not used.
    """
    P = np.asarray(points, dtype=np.float64)
    if P.ndim != 2 or P.shape[1] != 3 or not len(P):
        shape = " x ".join(map(str, P.shape))
        raise Unreadable(name, f"its points have {shape} numbers, not three for each of one or more points", AGAIN)
    _check_finite(name, "a coordinate", P)
    whole = tuple(_checked_block(name, block, len(P)) for block in blocks)
    return state_on_mesh(name, ResultState(P, whole, {}), arrays, time, left)


def state_on_mesh(name: str, mesh: ResultState, arrays: Mapping[str, NDArray[np.generic]], time: float | None = None,
          left: tuple[str, ...] = ()) -> ResultState:  # fmt: skip
    """Return a state with other `arrays` on the mesh of a checked state. Raises Unreadable."""
    n, known = len(mesh.points), {}
    for word, values in arrays.items():
        if len(values) != n:
            raise Unreadable(name, f"`{word}` has {len(values)} rows for {n} points", AGAIN)
        known[word] = np.asarray(values).reshape(n, -1)
        if known[word].shape[1] == 3:
            known[word] = known[word].astype(np.float64)
            _check_finite(name, f"`{word}`", known[word])
    if time is not None and not np.isfinite(time):
        raise Unreadable(name, f"its time is {time}", "write a valid time")
    return ResultState(mesh.points, mesh.blocks, known, None if time is None else float(time), left)


def _check_finite(name: str, what: str, values: Floats) -> None:
    """Raise Unreadable if a value (n, 3) is not finite, naming the first such point."""
    with np.errstate(invalid="ignore"):
        wrong = np.flatnonzero(~np.all(np.abs(values) <= LARGEST, axis=1))
    if len(wrong):
        row = values[wrong[0]]
        value = next(v for v in row if not abs(v) <= LARGEST)
        reason = f"{what} is {value:g} at point {wrong[0]}, counted from 0"
        more = f", and at {len(wrong) - 1} more points" if len(wrong) > 1 else ""
        raise Unreadable(name, reason + more, f"write numbers up to {LARGEST:g} at every point")


def _checked_block(name: str, block: Block, count: int) -> Block:
    """Return a block after checking the number of points per cell, and their indices. Raises Unreadable."""
    word, cells = block
    if word not in KINDS and word not in FLAT:
        return block
    kind = KINDS.get(word, word)
    many = FLAT[word] if word in FLAT else element_of(kind).nodes
    if cells.ndim != 2 or cells.shape[1] != many:
        raise Unreadable(name, f"its {kind} cells have {cells.shape[-1]} points each, not {many}", AGAIN)
    wrong = np.flatnonzero(((cells < 0) | (cells >= count)).any(axis=1))
    if len(wrong):
        row = cells[wrong[0]].tolist()
        index = next(i for i in row if not 0 <= i < count)
        reason = (
            f"cell {wrong[0]} of its {kind} cells refers to point {index}, but there are {count} points, counted from 0"
        )
        raise Unreadable(name, reason, AGAIN)
    return word, np.ascontiguousarray(cells, dtype=np.int64)


def combine_states(name: str, moments: Iterable[ResultState], ids: Ints | None = None) -> ResultFile:
    """Return states of one mesh as a series, in the order of their times. Raises Unreadable.

    `ids` are the numbers of the points, if the file has them.
    """
    every: list[ResultState] = []
    for each in moments:
        if every:
            _check_same_mesh(name, every[0], each, len(every))
            each = replace(each, blocks=())  # one is kept
        every.append(replace(each, arrays=each.vectors, left=(*each.left, *each.unused_array_texts)))
    if not every:
        raise Unreadable(name, "it has no results", "write displacements at one or more times")
    kind, cells, rest = _most_frequent_element(every[0].blocks)
    every = _sort_by_time(name, every)
    there = Counter(word for each in every for word in each.arrays)
    fields = {w: np.stack([each.arrays[w] for each in every]) for w, k in there.items() if k == len(every)}
    lacking = tuple(f"vectors `{w}`, only at {k} of {len(every)} times" for w, k in there.items() if k < len(every))
    left = (*rest, *lacking, *(word for each in every for word in each.left))
    moving = any(each.points is not every[0].points and (each.points != every[0].points).any() for each in every)
    return ResultFile(
        every[0].points, fields, cells, kind,
        None if every[0].time is None else np.array([each.time for each in every]),
        np.stack([each.points for each in every]) if moving else None,
        tuple(dict.fromkeys(left)), ids, None if kind else _plane_cells(every[0].blocks),
    )  # fmt: skip


def _check_same_mesh(name: str, first: ResultState, each: ResultState, i: int) -> None:
    """Raise Unreadable unless both states have the same mesh."""
    remedy = "write all times of the series on one mesh, or name one of its files"
    if len(each.points) != len(first.points):
        reason = f"its first time has {len(first.points)} points, but time {i} after it has {len(each.points)}"
        raise Unreadable(name, reason, remedy)
    if each.blocks is first.blocks:
        return
    same = len(each.blocks) == len(first.blocks) and all(
        a[0] == b[0] and np.array_equal(a[1], b[1]) for a, b in zip(first.blocks, each.blocks, strict=True)
    )
    if not same:
        raise Unreadable(name, f"the cells at time {i} after the first differ from those of the first", remedy)


def _sort_by_time(name: str, every: list[ResultState]) -> list[ResultState]:
    """Return states in the order of their times or, without times, of the file. Raises Unreadable for equal times."""
    times = [each.time for each in every if each.time is not None]
    if len(times) < len(every):
        if times:
            reason = f"{len(times)} of its {len(every)} entries have a time"
            raise Unreadable(name, reason, "write a time for all of them, or for none")
        return every
    for before, after in zip(sorted(times)[:-1], sorted(times)[1:], strict=True):
        if before == after:
            raise Unreadable(name, f"two of its entries have the time {after:g}", "write each time once")
    return sorted(every, key=lambda each: each.time or 0.0)


def _most_frequent_element(blocks: Iterable[Block]) -> tuple[str | None, Ints | None, tuple[str, ...]]:
    """Return the most frequent element type, its cells (m, a), and descriptions of the other cells."""
    counts: dict[str, int] = {}
    for word, cells in blocks:
        counts[word] = counts.get(word, 0) + len(cells)
    solids = [word for word in counts if word in KINDS and counts[word]]
    chosen = max(solids, key=lambda word: counts[word], default=None)
    rest = tuple(describe_count(n, word) for word, n in counts.items() if n and word != chosen)
    if chosen is None:
        return None, None, rest
    return KINDS[chosen], np.concatenate([cells for word, cells in blocks if word == chosen]), rest


def _plane_cells(blocks: Iterable[Block]) -> tuple[str, Ints] | None:
    """Return the most frequent type of plane cells, and these cells (m, a); None if there are no known ones."""
    each: dict[str, list[Ints]] = {}
    for word, cells in blocks:
        if word in FLAT and len(cells):
            each.setdefault(word, []).append(cells)
    if not each:
        return None
    word = max(each, key=lambda own: sum(map(len, each[own])))
    return word, np.concatenate(each[word]).astype(np.int64)


def describe_count(n: int, word: str) -> str:
    """Return a number of cells as text, with the name that meshio gives to their type."""
    if word in PLURALS:
        return f"{n} {word if n == 1 else PLURALS[word]}"
    return f"{n} cell{'' if n == 1 else 's'} `{KINDS.get(word, word)}`"
