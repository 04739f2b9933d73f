"""Rigid bodies beside a body that deforms, for pictures: each with its surface, wherever supports have taken it.

In a plane body they are cut by z = 0, as contact has them, and as thick as the body; beside a body of revolution half
of the cut is shown, as of the body.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.models.shared.contacting import pose_at
from softmark.interpreter.problem.data import located
from softmark.interpreter.problem.rigid_surfaces import section, surface_in_space
from softmark.interpreter.results.report import SeenInstrument, SeenSurface
from softmark.solvers.contact.pose import Pose

if TYPE_CHECKING:
    from softmark.interpreter.problem.case import Case, Touch


def instruments(case: Case, body: SeenSurface) -> tuple[SeenInstrument, ...]:
    """Every rigid body that a body may touch, once, at the times of its frames, or now."""
    own = {touch.rigid.name: touch for touch in case.contacts}
    return tuple(_instrument(case, touch, body) for touch in own.values())


def _instrument(case: Case, touch: Touch, body: SeenSurface) -> SeenInstrument:
    shape = located(touch.rigid.thing.shape, touch.rigid.at("shape"))
    X, triangles = surface_in_space(shape, body.position)
    if case.planar:
        span = float(body.position[:, 2].min()), float(body.position[:, 2].max())
        X, triangles = section(X, triangles, shape, span, case.planar == "axisymmetric")
    poses = [_pose(touch, share) for share in _shares(touch, body)]
    turns = np.stack([np.eye(3) if pose.turn is None else pose.turn for pose in poses])
    about = np.array([pose.about for pose in poses])
    shifts = about + np.array([pose.shift for pose in poses]) - np.einsum("tij,tj->ti", turns, about)
    return SeenInstrument(touch.rigid.name, X, triangles, turns, shifts)


def _shares(touch: Touch, body: SeenSurface) -> Sequence[float]:
    """How much of its way a rigid body has gone at every frame; of a state of rest all of it."""
    if body.times is None:
        return (1.0,)
    from softmark.interpreter.models.shared.motion import course_of_rigid

    course = course_of_rigid(touch)
    return [course.at(float(t)) for t in body.times]


def _pose(touch: Touch, share: float) -> Pose:
    return pose_at(touch, share) or Pose()
