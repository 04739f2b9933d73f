"""What a mesh makes of parts that its cells do not follow: the error that comes of cells of the wrong material.

Every cell that a border passes is of the material that it holds the most of. With all cells that the border of one part
passes its own, or none of them, whichever is farther from what was taken, the answer is off to one side of that of the
part itself by more than it is. How far these answers are from the one that was found, summed over the parts, for two
that err in opposite ways must not make up for each other, is a part of the stated error. Where next to nothing is
missed, as a polygon misses of a circle, what is missed is that part, relative to the smallest volume beside it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from softmark.interpreter.evidence.answer import Answer
    from softmark.interpreter.evidence.probe_answers import ProbeAnswer


def parts(whole: Answer) -> dict[str, Callable[[ProbeAnswer], float]]:
    """The part of the stated error that comes of parts of other materials; none where meshes follow them."""
    from softmark.interpreter.models.shared.regions import missed

    found = missed(whole.case, whole.prepared)
    if not found:
        return {}
    return {"regions": lambda seen: sum(_apart(whole, seen, left, way) for left, way in found)}


def _apart(whole: Answer, seen: ProbeAnswer, left: float, way: tuple[int, int]) -> float:
    """How far the same is with every cell that the border of a part passes of one material."""
    if way == (0, 0):
        return left * seen.size
    solution, _ = whole.solved(f"leaning {way}", whole.declared, replace(whole.case, leaning=way))
    return seen.apart(seen.of(solution))
