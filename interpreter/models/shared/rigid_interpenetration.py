"""Detection of rigid bodies that overlap each other in a motion.

Nothing prevents the overlap; a warning reports it.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.shared.rigid_contact_setup import pose_at
from softmark.interpreter.problem.body_case import RigidBodyContact
from softmark.records import dataclass
from softmark.solvers.contact.rigid_transform import RigidMotion
from softmark.solvers.contact.signed_distance import gap_of
from softmark.solvers.contact.signed_distance.distance_function import Gap
from softmark.solvers.energies.energy import Floats

if TYPE_CHECKING:
    from softmark.solvers.dynamics.load_amplitudes import Amplitude

PARTS = 16  # sample points along each side of the bounding box of a body
DEEP = 0.01  # of the largest side of that box: a smaller overlap counts as contact


@dataclass(frozen=True)
class MovingRigidBody:
    """Rigid body and its motion: `states` (t, 18) of a free body, or the `amplitude` of a prescribed motion."""

    touch: RigidBodyContact
    gap: Gap
    amplitude: Amplitude
    states: Floats | None

    def moved(self, X: Floats, i: int) -> Floats:
        """Return the positions (n, 3), m, of points of a free body at the time with index i.

        X (n, 3), m, are the points in the declared position of the body.
        """
        assert self.states is not None
        now, was = self.states[i], self.states[0]
        own = (X - was[:3]) @ was[3:12].reshape(3, 3)
        found: Floats = now[:3] + own @ now[3:12].reshape(3, 3).T
        return found

    def inside(self, x: Floats, i: int, time: float) -> Floats:
        """Return the penetration depth (n,), m, of points x (n, 3), m, in space into the body; negative outside.

        The position of the body is taken at the time with index i, `time` in s.
        """
        if self.states is None:
            pose = pose_at(self.touch, self.amplitude.at(time)) or RigidMotion()
            return -self.gap.gap(pose.back(x))
        now, was = self.states[i], self.states[0]
        own = (x - now[:3]) @ now[3:12].reshape(3, 3)
        return -self.gap.gap(was[:3] + own @ was[3:12].reshape(3, 3).T)


def interpenetration_warnings(
    touches: Mapping[str, tuple[RigidBodyContact, Amplitude]], names: tuple[str, ...], times: Floats, states: Floats
) -> tuple[Diagnostic, ...]:
    """Return a warning for every pair of rigid bodies that overlap at one of the `times` (t,), s.

    `states` (t, b, 18) are the states of the free rigid bodies `names`.
    """
    things = []
    for name, (touch, amplitude) in touches.items():
        gap = gap_of(touch.rigid.thing.shape)
        assert gap is not None  # refused when the scene is checked
        things.append(MovingRigidBody(touch, gap, amplitude, states[:, names.index(name)] if name in names else None))
    each = sorted(things, key=lambda thing: thing.states is None)  # free bodies first
    found = (_overlap_warning(one, other, times) for one, other in combinations(each, 2) if one.states is not None)
    return tuple(said for said in found if said is not None)


def _overlap_warning(one: MovingRigidBody, other: MovingRigidBody, times: Floats) -> Diagnostic | None:
    """Return a warning if a free body and another body overlap at any time."""
    if (bounds := one.touch.rigid.thing.shape.bounds) is None:
        return None
    sides = [np.linspace(a, b, 2 * PARTS + 1)[1::2] for a, b in zip(*bounds, strict=True)]
    X = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 3)
    deep, least = -one.gap.gap(X), DEEP * float(np.ptp(np.array(bounds), axis=0).max())
    X, deep = X[deep > least], deep[deep > least]
    for i, time in enumerate(times.tolist()):
        if len(X) and np.minimum(deep, other.inside(one.moved(X, i), i, time)).max() > least:
            first, second = one.touch.rigid, other.touch.rigid
            return diagnostic(
                "W639",
                first.at(),
                f"`{first.name}` passes through `{second.name}`: there is no contact between rigid bodies",
                f"penetration at {units.format_value(time, units.TIME)}",
                "make one of the bodies deformable, or end the motion earlier",
            )
    return None
