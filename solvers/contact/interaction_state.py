"""State that a contact passes from one solved equilibrium to the next: rigid body, barrier stiffness and friction."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.solvers.contact.signed_distance.distance_function import Gap
    from softmark.solvers.contact.surface_points import AddedContactPoints, SurfacePoints
    from softmark.solvers.energies.energy import Floats


@dataclass(frozen=True)
class FrictionState:
    """Friction history of one contact after an equilibrium has been solved.

    `anchors` are the points at which the surface last stuck: for contact with a rigid body an array (m, 3), m,
    on the rigid body in its declared position, one for each of the `points` of the surface; for contact between
    deformable surfaces a `FrictionHistory` (deformable_friction.py). `slid` (m,), m, is the accumulated slip of
    each point. `work`, J, is all heat of friction so far, and `now`, J, is the heat of this equilibrium only.
    """

    anchors: Any
    slid: Floats
    work: float
    now: float
    points: SurfacePoints | None = None


@dataclass(frozen=True)
class InteractionState:
    """State of one contact or tie after an equilibrium has been solved.

    `body` is the rigid body in its present position, None between deformable surfaces. `stiffening` is the
    factor by which the barrier has become stiffer. `added` are contact points that were added inside facets.
    `friction` is None without friction.
    """

    body: Gap | None = None
    stiffening: float = 1.0
    added: AddedContactPoints | None = None
    friction: FrictionState | None = None

    @property
    def friction_work(self) -> float:
        """Heat that friction has dissipated so far, including this equilibrium, J."""
        return 0.0 if self.friction is None else self.friction.work
