"""Whether a rigid body went through a surface from one state to the next, so that an equilibrium is on the wrong side.

Every state is found by itself: what has gone past a body in one step touches nothing, and what has gone half-way pushes
nodes out behind it. In between both are taken to go straight.
"""

from __future__ import annotations

import numpy as np

from softmark.solvers.contact.gaps.gap import inside
from softmark.solvers.contact.pose import Pose, Posed
from softmark.solvers.contact.touching import Touching
from softmark.solvers.energies.energy import Floats

STEPS = 32  # from one state to the next
EACH, MOST = 8, 4096  # of what falls, for the way that the middle of a rigid body is deep; at most
APART = 0.25  # of the way of a rigid body, and of how deep its middle is, where nothing is pressed in the end
DEEP, WIDE = 0.75, 0.4  # of that depth, and of the way, where something is: what slides around an edge goes on a curve


def passed(contact: Touching, before: Floats, x: Floats, falling: bool = False) -> float:
    """How deep, m, points were behind the surface of a rigid body on the way from a state (dofs,) to another; or 0.

    Asked are those that are pressed in the end, or all of them where none is: it is the rigid body that goes through.
    Where they come through it, `falling`, all are asked: others may hang on it.
    """
    now = contact.at(1.0)
    start, end = (body.pose if isinstance(body, Posed) else Pose() for body in (contact.earlier, now.body))
    own = now.body.own if isinstance(now.body, Posed) else now.body
    on = now.pressures(x) > 0.0
    pressed = bool(on.any())
    on = on if pressed and not falling else np.ones_like(on)
    first, last = (now.places(y)[on] for y in (before, x))
    way = last - first if falling else end.moved(first) - start.moved(first)
    travel, inner = float(np.linalg.norm(way, axis=1).max(initial=0.0)), inside(own)
    deepest = 0.0
    steps = min(max(STEPS, int(EACH * travel / inner)), MOST) if falling and inner > 0.0 else STEPS
    for share in np.arange(1, steps) / steps if travel > 0.0 else ():
        shift, rotation = ((1.0 - share) * np.array(a) + share * np.array(b)
                           for a, b in ((start.shift, end.shift), (start.rotation, end.rotation)))  # fmt: skip
        pose = Pose(tuple(shift.tolist()), tuple(rotation.tolist()), end.about)
        deepest = min(deepest, float(Posed(own, pose).gap((1.0 - share) * first + share * last).min()))
    allowed = max(DEEP * inner, WIDE * travel) if pressed else APART * min(inner, travel)
    allowed = DEEP * inner if falling else allowed
    return -deepest if -deepest > allowed else 0.0
