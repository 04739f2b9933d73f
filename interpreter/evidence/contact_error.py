"""Errors of bodies that touch: of the gap that a barrier leaves, and of a mesh that does not follow their border.

Where contact ends the pressure goes as a root, on any mesh inside of some cell: forces converge with the square of the
size and no faster (Drouet and Hild 2015, SIAM J. Numer. Anal. 53:1488), areas with the size, and how the border lies in
its cell makes differences of meshes jump, so that three of them show no order.

A rigid body seems larger by it. Nothing near a contact moves by more than that; forces go with a power of the travel of
at most two (a cone), so that they are off by twice the gap over the travel, pressures and areas by less.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from softmark.interpreter.evidence.answer import Answer
    from softmark.interpreter.evidence.probe_answers import ProbeAnswer

ORDER, OF_AREAS = 2.0, 1.0  # of forces, and pressures inside; and of areas
POWER = 2.0  # of the travel, that forces of contact go with at most


def index(whole: Answer, seen: ProbeAnswer, apart: float, ratio: float, farther: float | None) -> float:
    """The error of what forces tell, from its distance to a mesh that is `ratio` times coarser.

    By the order in theory, with the factor of two grids; where these are near by chance, by the next coarser one. The
    ratio is told of cells in space; of a slice their number goes with the square.
    """
    from softmark.interpreter.evidence.orders import FIRST
    from softmark.interpreter.metrics.contact import ContactArea

    order = OF_AREAS if isinstance(seen.metric, ContactArea) else ORDER
    fall: float = ratio ** (1.5 * order if whole.case.planar else order)
    return FIRST * max(apart, (farther or 0.0) / fall) / (fall - 1.0)


def gaps(whole: Answer) -> dict[str, Callable[[ProbeAnswer], float]]:
    """The part of the stated error that comes of gaps; none where nothing may touch."""
    from softmark.interpreter.vocabulary.pairs import Itself

    own = [pair.name for pair in whole.case.pairs if isinstance(pair.thing, Itself)]
    if not (own or whole.case.contacts):
        return {}
    beds: Any = getattr(whole.prepared, "beds", {})
    return {"gap": partial(_left, {name: beds[name].distance for name in own if not beds[name].rubs})}


def _left(widest: Mapping[str, float], seen: ProbeAnswer) -> float:
    """By the mean gap where something presses; the travel is taken for the largest displacement of the body.

    Of a body that meets itself by what its barrier leaves at most, m, by name, where no more is known.
    """
    from softmark.interpreter.evidence.probe_answers import Unknown

    rest = seen.at_rest
    if rest is None or not (rest.touches or rest.reason is None):
        raise Unknown("what the contacts leave open is not known")
    left = max((dict(widest) | {name: touch.left for name, touch in rest.touches.items()}).values(), default=0.0)
    if seen.unit == "m":
        return left
    return POWER * left / rest.moved * seen.size if rest.moved > 0.0 else 0.0
