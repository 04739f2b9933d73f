"""Rigid bodies for pictures: their surfaces next to a deformable body, moved by supports or in free motion.

For a plane body, rigid bodies are cut at z = 0, as in contact, and drawn as thick as the body. For a body of revolution
half of the cut is shown, as for the body itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.models.shared.rigid_contact_setup import pose_at
from softmark.interpreter.problem.data_sets import download_shape
from softmark.interpreter.problem.rigid_surfaces import extruded_plane_section, surface_in_space
from softmark.interpreter.results.run_report import DrawnRigidBody, DrawnSurface
from softmark.solvers.contact.rigid_transform import RigidMotion

if TYPE_CHECKING:
    from softmark.interpreter.problem.body_case import Case, RigidBodyContact
    from softmark.solvers.mesh.mesh import Floats


def drawn_rigid_bodies(
    case: Case, body: DrawnSurface, flights: Mapping[str, Any] | None = None
) -> tuple[DrawnRigidBody, ...]:
    """Return each rigid body that a body may touch, at the times of the drawn frames, or in the final state.

    `flights` are the motions of free rigid bodies by name, as in `solve.rigid` of a report.
    """
    own = {touch.rigid.name: touch for touch in case.contacts}
    return tuple(_draw_rigid_body(case, touch, body, (flights or {}).get(name)) for name, touch in own.items())


def _draw_rigid_body(
    case: Case, touch: RigidBodyContact, body: DrawnSurface, flight: Mapping[str, Any] | None
) -> DrawnRigidBody:
    shape = download_shape(touch.rigid.thing.shape, touch.rigid.at("shape"))
    X, triangles = surface_in_space(shape, body.position)
    if case.planar:
        span = float(body.position[:, 2].min()), float(body.position[:, 2].max())
        X, triangles = extruded_plane_section(X, triangles, shape, span, case.planar == "axisymmetric")
    turns, shifts = (
        _free_body_motion(flight, body.times) if flight and touch.along is None else _support_motion(touch, body)
    )
    return DrawnRigidBody(touch.rigid.name, X, triangles, turns, shifts)


def _free_body_motion(flight: Mapping[str, Any], times: Floats | None) -> tuple[Floats, Floats]:
    """Return rotations (t, 3, 3) and translations (t, 3), m, of a free rigid body at the times of the frames.

    They are interpolated linearly between the computed times.
    """
    from scipy.spatial.transform import Rotation, Slerp

    known, middle = np.array(flight["times_s"]), np.array(flight["middle_m"])
    t = known[-1:] if times is None else np.clip(times, known[0], known[-1])
    turns: Floats = Slerp(known, Rotation.from_rotvec(flight["rotation_rad"]))(t).as_matrix()
    places = np.stack([np.interp(t, known, column) for column in middle.T], axis=1)
    return turns, places - turns @ middle[0]


def _support_motion(touch: RigidBodyContact, body: DrawnSurface) -> tuple[Floats, Floats]:
    """Return rotations (t, 3, 3) and translations (t, 3), m, of a rigid body moved by supports, for each frame."""
    poses = [pose_at(touch, share) or RigidMotion() for share in _motion_fractions(touch, body)]
    turns = np.stack([np.eye(3) if pose.rotation_matrix is None else pose.rotation_matrix for pose in poses])
    return turns, np.concatenate([pose.moved(np.zeros((1, 3))) for pose in poses])


def _motion_fractions(touch: RigidBodyContact, body: DrawnSurface) -> Sequence[float]:
    """Return the completed fraction of a rigid body's prescribed motion in every frame; 1 in a static state."""
    if body.times is None:
        return (1.0,)
    from softmark.interpreter.models.procedures.case_amplitudes import amplitude_of_rigid

    amplitude = amplitude_of_rigid(touch)
    return [amplitude.at(float(t)) for t in body.times]
