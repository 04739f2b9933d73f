"""Entry point to dynamic analyses with free rigid bodies, which imports their code only if a scene needs it."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.solid_dynamics import PreparedMotion
    from softmark.interpreter.problem.body_case import Case


def include_free_rigid_bodies(motion: PreparedMotion, case: Case) -> PreparedMotion:
    """Return the dynamic analysis, extended by the free rigid bodies of the case if there are any."""
    if not any(touch.rigid.thing.free for touch in case.contacts):
        return motion
    from softmark.interpreter.models.shared.free_rigid_body_dynamics import add_free_rigid_bodies

    return add_free_rigid_bodies(motion, case)
