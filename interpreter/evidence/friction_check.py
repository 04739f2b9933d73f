"""What friction does to nodes counted once more, from what a state says of them: where they hold on to a rigid body."""

from __future__ import annotations

from typing import TYPE_CHECKING

from softmark.interpreter.evidence.held import motion
from softmark.interpreter.evidence.unchecked import Unchecked
from softmark.solvers.checks import rubbing

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.prepared import Moved
    from softmark.interpreter.problem.case import Touch
    from softmark.solvers.checks.solids import Floats


def rubbed(touch: Touch, mesh: Moved, x: Floats, n: Floats, p: Floats, spring: float, flat: bool) -> Floats:
    """Tractions (m, 3), Pa, at nodes x (m, 3), m, under pressures p (m,) along normals n (m, 3). Raises Unchecked."""
    own = mesh.rubbed.get(touch.name)
    if own is None or own.anchors.shape != x.shape:
        raise Unchecked(f"what the friction of `{touch.name}` remembers is not known")
    held = rubbing.taken(own.anchors, *motion(touch))
    if flat:
        held = held * (1.0, 1.0, 0.0)
    return rubbing.traction(x, held, n, touch.thing.friction * p, spring)
