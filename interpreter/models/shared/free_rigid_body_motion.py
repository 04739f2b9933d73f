"""Motions beside free rigid bodies: nothing is imported where there is none."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.solid_dynamics import PreparedMotion
    from softmark.interpreter.problem.body_case import Case


def afloat(motion: PreparedMotion, case: Case) -> PreparedMotion:
    """A motion, and of the rigid bodies that are free in it."""
    if not any(touch.rigid.thing.free for touch in case.contacts):
        return motion
    from softmark.interpreter.models.shared.free_rigid_body_dynamics import beside

    return beside(motion, case)
