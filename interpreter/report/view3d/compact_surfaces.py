"""Reduction of surfaces for embedding in a page: thinned points, few frames, and 16-bit numbers."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.report.page.html_markup import join_few_names
from softmark.interpreter.results.even_thinning import pick_evenly
from softmark.interpreter.results.run_report import DrawnSurface
from softmark.records import dataclass

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

POINTS = 4000  # largest number for one surface
FRAMES = 40
ROOM = 1_900_000  # bytes of base64 for all surfaces of a page
FINEST = 65535


@dataclass(frozen=True)
class ReducedSurfaces:
    """Surfaces reduced for a page, and notes on the omitted detail."""

    shapes: Mapping[str, DrawnSurface]
    notes: tuple[str, ...]


def reduce_surfaces(shapes: Mapping[str, DrawnSurface], points: int = POINTS, room: int = ROOM) -> ReducedSurfaces:
    """Return surfaces with at most `points` points each, and with as many frames as fit into `room` bytes.

    If even a few frames do not fit, surfaces are thinned further.
    """
    limit = points
    while True:
        thin = {name: thin_surface(shape, limit) for name, shape in shapes.items()}
        frames = _affordable_frame_count(thin, room)
        if frames >= 12 or limit <= 500 or not any(s.frames is not None for s in thin.values()):
            break
        limit //= 2
    kept = {name: _thin_frames(shape, max(frames, 2)) for name, shape in thin.items()}
    return ReducedSurfaces(kept, tuple(notes_of(shapes, kept)))


def _affordable_frame_count(shapes: Mapping[str, DrawnSurface], room: int) -> int:
    """Return the number of frames of every surface that fit into `room` bytes."""
    fixed = sum(
        8 * s.position.size / 3 + 3 * len(s.position) * (1 + len(s.carried)) + 8 * s.triangles.size / 3
        for s in shapes.values()
    )
    each = sum(8 * s.position.size / 3 for s in shapes.values() if s.frames is not None)
    return min(FRAMES, int((room - fixed) / each)) if each else FRAMES


def _thin_frames(shape: DrawnSurface, most: int) -> DrawnSurface:
    """Return the surface with at most `most` frames: the first, the last, and others evenly between them."""
    if shape.frames is None or shape.times is None or len(shape.times) <= most:
        return shape
    chosen = pick_evenly(len(shape.times), most)
    labels = tuple(shape.labels[i] for i in chosen) if shape.labels else ()
    times = np.arange(len(chosen), dtype=np.float64) if labels else shape.times[chosen]
    beside = tuple(i if len(i.turns) == 1 else i.sampled(chosen) for i in shape.instruments)
    return replace(shape, times=times, frames=shape.frames[chosen], labels=labels, instruments=beside)


def notes_of(given: Mapping[str, DrawnSurface], kept: Mapping[str, DrawnSurface]) -> list[str]:
    """Return sentences on surfaces that are coarser on the page than in the results."""
    coarse: dict[
        tuple[str, int, str], dict[str, int]
    ] = {}  # (`with` or `at`, total number, things) -> remaining number by name
    for name, shape in given.items():
        own = kept[name]
        if len(own.position) < len(shape.position):
            coarse.setdefault(("with", len(shape.position), "points"), {})[name] = len(own.position)
        if shape.times is not None and own.times is not None and len(own.times) < len(shape.times):
            moments = "states" if shape.labels else "moments"
            coarse.setdefault(("at", len(shape.times), moments), {})[name] = len(own.times)
    return [_thinning_note(*what, left) for what, left in coarse.items()]


def _thinning_note(how: str, total: int, things: str, left: Mapping[str, int]) -> str:
    """Return a sentence such as `a` and `b` are drawn with 1143 to 1198 of 1570 points."""
    low, high = min(left.values()), max(left.values())
    counts = f"{low}" if low == high else f"{low} to {high}"
    verb = "is" if len(left) == 1 else "are"
    return f"{join_few_names([f'`{n}`' for n in left])} {verb} drawn {how} {counts} of {total} {things}."


def thin_surface(shape: DrawnSurface, limit: int, triangles: bool = False) -> DrawnSurface:
    """Return a surface with at most `limit` points, or triangles if `triangles`.

    Points in the same grid cell are replaced by their average. Frames, errors and other fields are averaged too.
    Source: vertex clustering, Rossignac and Borrel (1993).
    """
    size = len(shape.triangles) if triangles else len(shape.position)
    if size <= limit:
        return shape
    extent = np.ptp(shape.position, axis=0)
    cell = float(np.linalg.norm(extent)) / (limit**0.5 * 2.0) or 1.0
    rest = shape.position if shape.frames is None else shape.frames[0]
    bare = DrawnSurface(
        rest, shape.triangles
    )  # cells follow from the initial positions; frames and fields are averaged once at the end
    for _ in range(60):
        small = _merge_points(bare, cell)
        if (len(small.triangles) if triangles else len(small.position)) <= limit:
            break
        cell *= 1.12
    return _merge_points(shape, cell)


def _merge_points(shape: DrawnSurface, cell: float) -> DrawnSurface:
    """Return the surface with all points in the same cubic cell (edge length `cell`, m) merged."""
    rest = shape.position if shape.frames is None else shape.frames[0]
    keys = np.floor((rest - rest.min(axis=0)) / cell).astype(np.int64)
    _, group = np.unique(_number_rows(keys), return_inverse=True)
    number = np.bincount(group).astype(float)

    def mean(values: Floats) -> Floats:
        columns = values.reshape(len(values), -1)
        sums = np.stack([np.bincount(group, c) for c in columns.T], axis=1)
        result: Floats = (sums / number[:, None]).reshape(len(number), *values.shape[1:])
        return result

    corners = group[shape.triangles]
    kept = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    _, first = np.unique(_number_rows(np.sort(corners[kept], axis=1)), return_index=True)
    frames = None if shape.frames is None else mean(shape.frames.transpose(1, 0, 2)).transpose(1, 0, 2)
    error = None if shape.error is None else mean(shape.error)
    carried = tuple(c if c.values is None else replace(c, values=mean(c.values)) for c in shape.carried)
    triangles = corners[kept][np.sort(first)]
    whole = replace(shape, position=mean(shape.position), triangles=triangles, frames=frames)
    return replace(whole, error=error, carried=carried)


def _number_rows(keys: Ints) -> Ints:
    """Return one number (n,) for each row of non-negative integers (n, 3), in the same order as the rows.

    Sorting these numbers is 10 times faster than sorting rows.
    """
    size = keys.max(axis=0, initial=0) + 1
    if float(np.prod(size.astype(float))) < 2.0**62:
        numbered: Ints = np.ravel_multi_index(tuple(keys.T), tuple(size))
        return numbered
    number: Ints = np.unique(keys, axis=0, return_inverse=True)[1].ravel()
    return number


def bounds(shape: DrawnSurface) -> tuple[Floats, Floats]:
    """Return both corners (3,) of the bounding box of a surface over all times, m."""
    every = [shape.position] if shape.frames is None else [shape.position, shape.frames.reshape(-1, 3)]
    low = np.min([X.min(axis=0) for X in every], axis=0)
    high = np.max([X.max(axis=0) for X in every], axis=0)
    return low, high


def pack_surface(name: str, shape: DrawnSurface, mesh: int) -> dict[str, Any]:
    """Return a surface as JSON that `shapes.js` reads; `mesh` is the index of its triangles on the page.

    Positions are in 1/65535 of the bounding box, errors in 1/65535 of the largest error.
    """
    low, high = bounds(shape)
    span = np.where(high > low, high - low, 1.0)
    found: dict[str, Any] = {
        "name": name,
        "points": len(shape.position),
        "mesh": mesh,
        "low": low.tolist(),
        "high": (low + span * (high > low)).tolist(),
        "position": encode_16_bits((shape.position - low) / span),
    }
    if shape.frames is not None and shape.times is not None:
        found |= {"times": shape.times.tolist(), "frames": encode_16_bits((shape.frames - low) / span)}
    if shape.labels:
        found["labels"] = shape.labels
    if shape.error is not None:
        most = float(shape.error.max(initial=0.0))
        found |= {
            "error": encode_16_bits(shape.error / (most or 1.0)),
            "most": most,
            "against": shape.measured_from or "",
        }
    return found


def packed_triangles(triangles: Ints) -> dict[str, Any]:
    """Return the point indices of triangles as JSON, in 16 bits if they fit."""
    wide = int(triangles.max(initial=0)) > FINEST
    return {"wide": wide, "triangles": _base64(triangles.astype("<u4" if wide else "<u2"))}


def encode_16_bits(shares: Floats) -> str:
    """Return numbers between 0 and 1 as text, encoded in 16 bits each."""
    return _base64(np.clip((shares * FINEST).round(), 0, FINEST).astype("<u2"))


def _base64(array: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")


def largest_rounding_step(shapes: Mapping[str, DrawnSurface]) -> float:
    """Return the largest rounding step of positions on the page, m, of all surfaces."""
    return max((float(np.ptp(bounds(s), axis=0).max()) / FINEST for s in shapes.values()), default=0.0)
