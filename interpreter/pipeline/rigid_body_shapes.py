"""Rigid bodies beside one that deforms, for pictures: each with its surface, where supports took it or it has flown.

In a plane body they are cut by z = 0, as contact has them, and as thick as the body; beside a body of revolution half
of the cut is shown, as of the body.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.models.shared.rigid_contact_setup import pose_at
from softmark.interpreter.problem.data_sets import located
from softmark.interpreter.problem.rigid_surfaces import section, surface_in_space
from softmark.interpreter.results.run_report import SeenInstrument, SeenSurface
from softmark.solvers.contact.rigid_transform import RigidMotion

if TYPE_CHECKING:
    from softmark.interpreter.problem.body_case import Case, Touch
    from softmark.solvers.mesh.mesh import Floats


def instruments(case: Case, body: SeenSurface, flights: Mapping[str, Any] | None = None) -> tuple[SeenInstrument, ...]:
    """Every rigid body that a body may touch, once, at the times of its frames, or now.

    `flights` are the motions of those that are free, by name, as `solve.rigid` of a report tells them.
    """
    own = {touch.rigid.name: touch for touch in case.contacts}
    return tuple(_instrument(case, touch, body, (flights or {}).get(name)) for name, touch in own.items())


def _instrument(case: Case, touch: Touch, body: SeenSurface, flight: Mapping[str, Any] | None) -> SeenInstrument:
    shape = located(touch.rigid.thing.shape, touch.rigid.at("shape"))
    X, triangles = surface_in_space(shape, body.position)
    if case.planar:
        span = float(body.position[:, 2].min()), float(body.position[:, 2].max())
        X, triangles = section(X, triangles, shape, span, case.planar == "axisymmetric")
    turns, shifts = _flown(flight, body.times) if flight and touch.along is None else _taken(touch, body)
    return SeenInstrument(touch.rigid.name, X, triangles, turns, shifts)


def _flown(flight: Mapping[str, Any], times: Floats | None) -> tuple[Floats, Floats]:
    """Turns (t, 3, 3) and shifts (t, 3) of a free body, m: on a straight line between two moments that are known."""
    from scipy.spatial.transform import Rotation, Slerp

    known, middle = np.array(flight["times_s"]), np.array(flight["middle_m"])
    t = known[-1:] if times is None else np.clip(times, known[0], known[-1])
    turns: Floats = Slerp(known, Rotation.from_rotvec(flight["rotation_rad"]))(t).as_matrix()
    places = np.stack([np.interp(t, known, column) for column in middle.T], axis=1)
    return turns, places - turns @ middle[0]


def _taken(touch: Touch, body: SeenSurface) -> tuple[Floats, Floats]:
    """Turns (t, 3, 3) and shifts (t, 3) of a body that supports have taken along, m."""
    poses = [pose_at(touch, share) or RigidMotion() for share in _shares(touch, body)]
    turns = np.stack([np.eye(3) if pose.turn is None else pose.turn for pose in poses])
    return turns, np.concatenate([pose.moved(np.zeros((1, 3))) for pose in poses])


def _shares(touch: Touch, body: SeenSurface) -> Sequence[float]:
    """How much of its way a rigid body has gone at every frame; of a state of rest all of it."""
    if body.times is None:
        return (1.0,)
    from softmark.interpreter.models.shared.solid_dynamics import course_of_rigid

    course = course_of_rigid(touch)
    return [course.at(float(t)) for t in body.times]
