"""Where a mesh must have nodes: surfaces on which a coordinate of its shape is constant, and the lines of a grid there.

Plain numbers, known without making the mesh.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

from softmark.records import dataclass

SAME = 1e-9  # of the span of a coordinate: what is nearer is at the same place
LEAST = 0.05  # of the usual distance of lines: two are no nearer, or cells become needles
THINNEST = 1e-6  # of the span: a layer that is held as a whole may be as thin as that


@dataclass(frozen=True)
class Cut:
    """A surface on which nodes must lie: where the coordinate `axis` of a shape is `at` (m).

    `thin`: everything between it and the nearest end of the body is held, so that the layer may be as thin as it likes.
    `turn` (rad) is the direction of the normal of a chord of a disc, from the first transverse axis.
    """

    axis: str
    at: float
    thin: bool = False
    turn: float = 0.0


def along(cuts: Iterable[Cut], axis: str) -> tuple[Cut, ...]:
    """The cuts of one coordinate."""
    return tuple(cut for cut in cuts if cut.axis == axis)


def lines(low: float, high: float, count: int, cuts: Sequence[Cut]) -> list[float] | None:
    """Lines of a grid from `low` to `high` (m) with nodes at the cuts; None where `count` even cells have them all.

    Intervals between cuts are divided into cells of about the even size. A cut too near to another is left out.
    """
    span = high - low
    each = span / count
    inner = [cut for cut in cuts if low + SAME * span < cut.at < high - SAME * span]
    steps = [(cut.at - low) / each for cut in inner]
    if all(abs(step - round(step)) * each <= SAME * span for step in steps):
        return None
    ends = anchors(low, high, each, inner)
    found = [low]
    for a, b in pairwise(ends):
        n = max(1, round((b - a) / each))
        found += [*(a + (b - a) * k / n for k in range(1, n)), b]
    return found if len(ends) > 2 else None


def anchors(low: float, high: float, each: float, cuts: Iterable[Cut]) -> list[float]:
    """The ends and the cuts that are far enough from all others, in order."""
    found = [low, high]
    for cut in cuts:
        least = THINNEST * (high - low) if cut.thin else LEAST * each
        if min(abs(cut.at - other) for other in found) >= least:
            found.append(cut.at)
    return sorted(found)


def cells(low: float, high: float, count: int, cuts: Sequence[Cut]) -> int:
    """How many cells that grid has."""
    found = lines(low, high, count, cuts)
    return count if found is None else len(found) - 1
