"""What a mesh makes of parts that its cells do not follow: the error that comes of cells of the wrong material.

Every cell that a border passes is of the material that it holds the most of. With all of them of the one material, or
of the other, whichever is farther from what was taken, the answer is off to one side of that of the parts themselves by
more than it is: how far the two are apart is a part of the stated error. Where next to nothing is missed, as a polygon
misses of a circle, what is missed is that part.
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

    left, side = missed(whole.case, whole.prepared)
    if left == 0.0:
        return {}
    if not side:
        return {"regions": lambda seen: left * seen.size}
    return {"regions": lambda seen: _apart(whole, seen, side)}


def _apart(whole: Answer, seen: ProbeAnswer, side: int) -> float:
    """How far the same is with every cell that a border passes of one material."""
    solution, _ = whole.solved("leaning", whole.declared, replace(whole.case, leaning=side))
    return seen.apart(seen.of(solution))
