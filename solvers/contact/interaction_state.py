"""State of an interaction: what a contact carries from one equilibrium state to the next."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.solvers.contact.signed_distance.distance_function import Gap
    from softmark.solvers.contact.surface_points import AddedContactPoints, SurfacePoints
    from softmark.solvers.energies.energy import Floats


@dataclass(frozen=True)
class FrictionState:
    """Friction state of one contact after a solved state.

    For contact with a rigid body, `anchors` (m, 3), m, are the points of the rigid body in its declared position at
    which the `points` of the surface last stuck. For contact between deformable surfaces, `anchors` is a
    `FrictionHistory` (deformable_friction.py). `slid` (m,) is the accumulated slip of each point or contact sample, m.
    `work` is the heat dissipated by friction up to and including this state, J, and `now` the heat of this state only,
    J.
    """

    anchors: Any
    slid: Floats
    work: float
    now: float
    points: SurfacePoints | None = None


@dataclass(frozen=True)
class InteractionState:
    """State of one interaction after a solved state.

    `body` is the rigid body in its present position, or None between deformable surfaces. `stiffening` is the stiffness
    of the barrier relative to its initial stiffness, and `added` are the contact points that were added on facets.
    `friction` is None without friction.
    """

    body: Gap | None = None
    stiffening: float = 1.0
    added: AddedContactPoints | None = None
    friction: FrictionState | None = None

    @property
    def friction_work(self) -> float:
        """Heat dissipated by friction up to and including this state, J."""
        return 0.0 if self.friction is None else self.friction.work
