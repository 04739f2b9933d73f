"""Singular contact pressure at the edge of a sharp punch and under the tip of a cone.

At distance d from the edge of a flat punch the pressure grows as d^(-1/2), and under the tip of a cone as the logarithm
of d, so every refinement finds a larger value. At a rounded edge or tip it converges.
Source: Sadowsky 1928, ZAMM 8; Love 1939, Quart. J. Math. 10.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.metrics.contact import ContactPressure
from softmark.interpreter.metrics.pressure_along import PressureAlong
from softmark.interpreter.models.shared.rigid_contact_setup import pose_at
from softmark.interpreter.problem.data_sets import download_shape
from softmark.interpreter.problem.rigid_surfaces import sharp_points, sharp_points_in_section, surface_in_space
from softmark.solvers.contact.signed_distance import gap_of
from softmark.solvers.mesh.nearest_points import build_point_search

if TYPE_CHECKING:
    from softmark.interpreter.metrics.metric_base import Metric
    from softmark.interpreter.problem.body_case import Case, RigidBodyContact
    from softmark.interpreter.results.reaction_results import EquilibriumForces
    from softmark.solvers.mesh.mesh import Floats


def singular_pressure(metric: Metric | None, case: Case, rest: EquilibriumForces | None, X: Floats) -> str | None:
    """Return why a contact pressure metric, evaluated at points X (n, 3), m, does not converge, or None.

    It does not converge in a facet in contact that contains a sharp edge or tip of the rigid body.
    """
    if not isinstance(metric, ContactPressure | PressureAlong) or rest is None or not rest.knows(metric.subject_name):
        return None
    touch = next((touch for touch in case.contacts if touch.name == metric.of), None)
    field: Any = rest.touches[metric.of].field if metric.of in rest.touches else None
    gap = None if touch is None else gap_of(download_shape(touch.rigid.thing.shape, touch.rigid.at("shape")))
    if touch is None or field is None or gap is None or gap.least_curvature_radius > 0.0:
        return None
    if isinstance(metric, ContactPressure):
        X = np.zeros((0, 3)) if metric.at is None else np.array([metric.at])
    places, flat = _sharp_points(case, touch, field.X), (1.0, 1.0, 0.0) if case.planar else (1.0, 1.0, 1.0)
    x, pressed = field.pressing.x[field.may] * flat, field.pressing.pressures[field.may] > 0.0
    if not len(places) or not pressed.any():
        return None
    reach = field.edge
    there = build_point_search(places, len(x)).distance(x) < reach
    if len(X):  # by undeformed positions
        there &= build_point_search(X * flat, len(x)).distance(field.X[field.may] * flat) < reach
    return f"a sharp edge or corner of `{touch.rigid.name}`" if (there & pressed).any() else None


def _sharp_points(case: Case, touch: RigidBodyContact, X: Floats) -> Floats:
    """Return points (n, 3), m, on sharp edges and tips of a rigid body in its current position.

    For a plane body they are corners of the section z = 0.
    """
    shape = download_shape(touch.rigid.thing.shape, touch.rigid.at("shape"))
    surface = surface_in_space(shape, X)
    found, pose = sharp_points_in_section(*surface) if case.planar else sharp_points(*surface), pose_at(touch, 1.0)
    return found if pose is None else pose.moved(found)
