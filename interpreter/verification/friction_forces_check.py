"""Independent friction forces, from the anchor points of sticking contact that a state stores."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.verification.support_reactions_check import rigid_motion
from softmark.interpreter.verification.unverified_model_error import NoIndependentFormula
from softmark.solvers.independent_forces import rigid_friction_forces

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.prepared_model import DeformedMesh
    from softmark.interpreter.problem.body_case import RigidBodyContact
    from softmark.solvers.independent_forces.solid_forces import Floats, Ints


def friction_tractions(
    touch: RigidBodyContact,
    mesh: DeformedMesh,
    points: tuple[Ints, Floats],
    x: Floats,
    n: Floats,
    p: Floats,
    spring: float,
    flat: bool,
) -> Floats:
    """Return friction tractions (m, 3), Pa, at points x (m, 3), m, under pressures p (m,), Pa, along normals n (m, 3).

    `points` are the nodes and shape functions of the points (m, a). A point without pressure need not be stored in the
    state.
    """
    state = mesh.interactions.get(touch.name)
    if state is None or (own := state.friction) is None or own.points is None:
        raise NoIndependentFormula(f"the friction history of `{touch.name}` is not known")
    which = rigid_friction_forces.match_points(*points, own.points.of, own.points.shares)
    if np.any((which < 0) & (p > 0.0)):
        raise NoIndependentFormula(f"`{touch.name}` is in contact at points that have no friction history")
    held = rigid_friction_forces.move_points(own.anchors[which], *rigid_motion(touch))
    if flat:
        held = held * (1.0, 1.0, 0.0)
    return rigid_friction_forces.friction_traction(x, held, n, touch.thing.friction * p, spring)
