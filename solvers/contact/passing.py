"""Whether a rigid body went through a surface from one state to the next, so that an equilibrium is on the wrong side.

Every state is found by itself: what has gone past a body in one step touches nothing, and what has gone half-way pushes
nodes out behind it. In between both are taken to go straight.
"""

from __future__ import annotations

import numpy as np

from softmark.solvers.contact.gaps.gap import inside
from softmark.solvers.contact.pose import Pose, Posed, declared
from softmark.solvers.contact.touching import Touching
from softmark.solvers.energies.energy import Floats

STEPS = 32  # from one state to the next
APART = 0.25  # of the way of a rigid body, and of how deep its middle is, where nothing is pressed in the end
DEEP, WIDE = 0.75, 0.4  # of that depth, and of the way, where something is: what slides around an edge goes on a curve


def passed(contact: Touching, before: Floats, x: Floats) -> float:
    """How deep, m, points were behind the surface of a rigid body on the way from a state (dofs,) to another; or 0.

    Asked are those that are pressed in the end, or all of them where none is.
    """
    now = contact.at(1.0)
    start, end = (body.pose if isinstance(body, Posed) else Pose() for body in (contact.earlier, now.body))
    own = declared(now.body)
    on = now.pressures(x) > 0.0
    pressed = bool(on.any())
    on = on if pressed else np.ones_like(on)
    first, last = (now.places(y)[on] for y in (before, x))
    travel = float(np.linalg.norm(end.moved(first) - start.moved(first), axis=1).max(initial=0.0))
    deepest = 0.0
    for share in np.arange(1, STEPS) / STEPS if travel > 0.0 else ():
        shift, rotation = ((1.0 - share) * np.array(a) + share * np.array(b)
                           for a, b in ((start.shift, end.shift), (start.rotation, end.rotation)))  # fmt: skip
        pose = Pose(tuple(shift.tolist()), tuple(rotation.tolist()), end.about)
        deepest = min(deepest, float(Posed(own, pose).gap((1.0 - share) * first + share * last).min()))
    inner = inside(own)
    allowed = max(DEEP * inner, WIDE * travel) if pressed else APART * min(inner, travel)
    return -deepest if -deepest > allowed else 0.0
