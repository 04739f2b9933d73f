"""What friction does to points counted once more, from what a state says of them: where they hold on to a body."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.evidence.held import motion
from softmark.interpreter.evidence.unchecked import Unchecked
from softmark.solvers.checks import rubbing

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.prepared import Moved
    from softmark.interpreter.problem.case import Touch
    from softmark.solvers.checks.solids import Floats, Ints


def rubbed(
    touch: Touch, mesh: Moved, points: tuple[Ints, Floats], x: Floats, n: Floats, p: Floats, spring: float, flat: bool
) -> Floats:
    """Tractions (m, 3), Pa, at points x (m, 3), m, under pressures p (m,) along normals n (m, 3). Raises Unchecked.

    `points` are their nodes and shares (m, a) of these: where nothing presses they may be points that are not kept.
    """
    own = mesh.rubbed.get(touch.name)
    if own is None or own.points is None:
        raise Unchecked(f"what the friction of `{touch.name}` remembers is not known")
    which = rubbing.numbers(*points, own.points.of, own.points.shares)
    if np.any((which < 0) & (p > 0.0)):
        raise Unchecked(f"`{touch.name}` presses where its friction remembers nothing")
    held = rubbing.taken(own.anchors[which], *motion(touch))
    if flat:
        held = held * (1.0, 1.0, 0.0)
    return rubbing.traction(x, held, n, touch.thing.friction * p, spring)
