"""The error that comes of the gap that a barrier leaves between bodies that touch.

A rigid body seems larger by it. Nothing near a contact moves by more than that; forces go with a power of the travel of
at most two (a cone), so that they are off by twice the gap over the travel, pressures and areas by less.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from softmark.interpreter.evidence.answer import Answer
    from softmark.interpreter.evidence.probe_answers import ProbeAnswer

POWER = 2.0  # of the travel, that forces of contact go with at most


def gaps(whole: Answer) -> dict[str, Callable[[ProbeAnswer], float]]:
    """The part of the stated error that comes of gaps; none where nothing may touch."""
    return {"gap": _left} if whole.case.contacts else {}


def _left(seen: ProbeAnswer) -> float:
    """By the mean gap where something presses; the travel is taken for the largest displacement of the body."""
    from softmark.interpreter.evidence.probe_answers import Unknown

    rest = seen.at_rest
    if rest is None or rest.reason is not None:
        raise Unknown("what the contacts leave open is not known")
    left = max((touch.left for touch in rest.touches.values()), default=0.0)
    if seen.unit == "m":
        return left
    return POWER * left / rest.moved * seen.size if rest.moved > 0.0 else 0.0
