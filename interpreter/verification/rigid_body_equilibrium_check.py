"""Independent check that contact forces balance the loads on a force-driven rigid body in statics.

The loads are read from the scene again. The volume of the rigid body is that of its shape instead of the sum of its
parts. Its contact forces on the deformable body are independent ones (`contact_forces_check.py`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.verification.contact_forces_check import contact_forces
from softmark.interpreter.verification.unverified_model_error import NoIndependentFormula
from softmark.interpreter.vocabulary.loads.body_force import BodyForce

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.prepared_model import DeformedMesh
    from softmark.interpreter.problem.body_case import Case, RigidBodyContact
    from softmark.solvers.independent_forces.solid_forces import Floats

EXACT = 1e-7  # relative to the forces on it: what may be left
NOTHING = 1e-10  # of Young's modulus times the square of the size of the body that deforms: no force


def check_rigid_bodies(case: Case, mesh: DeformedMesh, u: Floats) -> tuple[dict[str, Any], str | None]:
    """Return facts of the balance of force-driven rigid bodies, and the reason if the state is invalid, else None.

    u (n, 3), m, are the displacements of the deformable body.
    """
    touches = [touch for touch in case.contacts if touch.along is not None]
    if not touches:
        return {}, None
    first = touches[0]
    try:
        sizes = _loads(first)
        each = [contact_forces(case, touch, mesh, u) for touch in touches]
    except NoIndependentFormula as unknown:
        return {"pressed": {"residual": None, "reason": str(unknown)}}, None
    borne = sum(float(f[:, first.along].sum()) for f, _ in each)
    size = max(float(np.abs(sizes).sum()), abs(borne), NOTHING * case.largest_young * mesh.mesh.extent**2)
    left, unsure = abs(float(sizes.sum()) - borne), sum(vague for _, vague in each)
    facts = {"pressed": {"residual": left / size, "unsure": unsure / size}}
    if left <= EXACT * size + case.analysis.tolerance * size + unsure:
        return facts, None
    name = first.rigid.name
    return facts, (
        f"the contact forces on `{name}` do not balance its loads: {left / size:.1e} of the forces on it is left"
    )


def _loads(touch: RigidBodyContact) -> Floats:
    """Return the components of all loads on a rigid body along its free directions (k,), N.

    Raises NoIndependentFormula if its volume is not known.
    """
    assert touch.along is not None
    found, thing = [0.0], touch.rigid.thing
    for load in touch.loads:
        action = load.thing.action
        if not isinstance(action, BodyForce):
            found.append(action.force[touch.along])
            continue
        mass = thing.mass
        if mass is None and thing.density is not None:
            if (volume := thing.shape.volume) is None:
                raise NoIndependentFormula(
                    f"no independent formula is available for the volume of `{touch.rigid.name}`"
                )
            mass = thing.density * volume
        found.append((mass or 0.0) * action.acceleration[touch.along])
    return np.array(found)
