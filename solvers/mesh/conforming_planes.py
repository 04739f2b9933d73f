"""Surfaces of constant coordinate on which a mesh must have nodes, and grid lines that fit them.

They are plain numbers, computed without making the mesh.
"""

from __future__ import annotations

from bisect import bisect
from collections.abc import Iterable, Sequence
from itertools import accumulate, pairwise
from typing import Any

from softmark.records import dataclass

SAME = 1e-9  # relative to the coordinate range: closer values coincide
LEAST = 0.05  # smallest distance of two lines relative to the usual one, to avoid needle-shaped cells
SAMPLES = 400  # samples of an interval for the integral of cell sizes
THINNEST = 1e-6  # relative to the range: smallest thickness of a fully held layer


@dataclass(frozen=True)
class Cut:
    """A surface on which nodes must lie: where the coordinate `axis` of a shape equals `at` (m).

    `thin` is True if a support fixes everything between the surface and the nearest end of the body; this layer may
    then be arbitrarily thin. `turn` (rad) is the direction of the normal of a chord of a disc, measured from the first
    transverse axis.

    If `finer` is above 1, the cut is graded: cells there are smaller by this factor, and they grow linearly to their
    usual size over the distance `reach` (m). In a body given by its surface, cells are finer wherever the condition
    `where` holds, which is called as `where.holds(x, y, z, extent)`; `axis` is then no coordinate.
    """

    axis: str
    at: float
    thin: bool = False
    turn: float = 0.0
    finer: float = 1.0
    reach: float = 0.0
    where: Any = None

    @property
    def graded(self) -> bool:
        """True if cells are finer at the cut; nodes then need not lie on it."""
        return self.finer > 1.0

    def share(self, away: Any, reach: float) -> Any:
        """Return the cell size at the distance `away` (m), a number or an array, as a fraction of the usual size.

        The fraction grows linearly from 1 / `finer` at the cut to 1 at the distance `reach` (m).
        """
        least = 1.0 / self.finer
        return least + (1.0 - least) * away / reach


def smallest_size(size: float, cuts: Iterable[Cut]) -> float:
    """Return the size of the smallest cells (m) in a mesh of cells of `size` (m) that is graded at cuts.

    The facets of a surface must be no larger than these cells; larger ones would act as notches.
    """
    return size / max((cut.finer for cut in cuts), default=1.0)


def cuts_along(cuts: Iterable[Cut], axis: str) -> tuple[Cut, ...]:
    """Return the cuts that are normal to the coordinate `axis`."""
    return tuple(cut for cut in cuts if cut.axis == axis)


def grid_lines(low: float, high: float, count: int, cuts: Sequence[Cut]) -> list[float] | None:
    """Return the coordinates of grid lines from `low` to `high` (m) with a line at each cut, in ascending order.

    Return None if `count` equal cells already have lines at all cuts. Intervals between cuts are divided into cells of
    about the equal size. A cut too near to another is left out.
    """
    span = high - low
    each = span / count
    graded = [cut for cut in cuts if cut.graded]
    if graded:
        return _graded_grid_lines(low, high, each, graded, [cut for cut in cuts if not cut.graded])
    inner = [cut for cut in cuts if low + SAME * span < cut.at < high - SAME * span]
    steps = [(cut.at - low) / each for cut in inner]
    if all(abs(step - round(step)) * each <= SAME * span for step in steps):
        return None
    ends = fixed_grid_lines(low, high, each, inner)
    found = [low]
    for a, b in pairwise(ends):
        n = max(1, round((b - a) / each))
        found += [*(a + (b - a) * k / n for k in range(1, n)), b]
    return found if len(ends) > 2 else None


def _graded_grid_lines(low: float, high: float, each: float, graded: Sequence[Cut], cuts: Sequence[Cut]) -> list[float]:
    """Return grid lines at equal steps of the integral of 1 / (local cell size).

    `each` (m) is the cell size far from all graded cuts. Half this size gives twice as many lines, and every second of
    them lies on a line for the full size.
    """
    span = high - low
    held = [c for c in (*graded, *cuts) if low + SAME * span < c.at < high - SAME * span]
    found = [low]
    for a, b in pairwise(fixed_grid_lines(low, high, each / max(c.finer for c in graded), held)):
        steps = [a + (b - a) * i / SAMPLES for i in range(SAMPLES + 1)]
        dense = [1.0 / (each * _size_fraction(0.5 * (s + t), graded)) for s, t in pairwise(steps)]
        total = [0.0, *accumulate(d * (b - a) / SAMPLES for d in dense)]
        n = max(1, round(total[-1]))
        for k in range(1, n):
            i = bisect(total, total[-1] * k / n) - 1
            found.append(steps[i] + (total[-1] * k / n - total[i]) / dense[i])
        found.append(b)
    return found


def _size_fraction(at: float, graded: Sequence[Cut]) -> float:
    """Return the cell size at the coordinate `at`, m, as a fraction of the usual size; it is least at graded cuts."""
    found: float = min(1.0, *(c.share(abs(at - c.at), c.reach) for c in graded))
    return found


def fixed_grid_lines(low: float, high: float, each: float, cuts: Iterable[Cut]) -> list[float]:
    """Return, in ascending order, both ends and the cuts that are far enough from all others, m.

    These grid lines are fixed; other lines are placed between them. `each` (m) is the usual cell size.
    """
    found = [low, high]
    for cut in cuts:
        least = THINNEST * (high - low) if cut.thin else LEAST * each
        if min(abs(cut.at - other) for other in found) >= least:
            found.append(cut.at)
    return sorted(found)


def count_cells(low: float, high: float, count: int, cuts: Sequence[Cut]) -> int:
    """Return the number of cells between the lines that `grid_lines` returns for these arguments."""
    found = grid_lines(low, high, count, cuts)
    return count if found is None else len(found) - 1
