"""Zones where section theory is invalid: within one width of a support, a load or a joint of a beam."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.cross_section_coverage import coverage, selects_whole_sections
from softmark.interpreter.vocabulary.loads.line_force import LineForce
from softmark.interpreter.vocabulary.loads.point_force import PointLoad
from softmark.interpreter.vocabulary.loads.surface_traction import SurfaceTraction
from softmark.interpreter.vocabulary.loads.tendon import TendonLoad
from softmark.interpreter.vocabulary.loads.torque import MomentLoad
from softmark.solvers.mesh.frame_shapes import Network
from softmark.solvers.mesh.mesh import Floats
from softmark.solvers.mesh.shape import Swept, Vector3


def nearby_disturbance(case: Case, thing: Any, X: Floats) -> str | None:
    """Return a support, load or joint that disturbs the stress at one of the points X (n, 3), m, as text; else None.

    It disturbs the stress within one section width along the axis. `thing` is the declaration of the beam or frame
    model.
    """
    if not len(X):
        return None
    axis, width = _nearest_axis_points_and_widths(case, X)
    for words, place in _disturbed_places(case, thing):
        if np.any(np.linalg.norm(axis - np.array(place), axis=1) < width):
            return words
    return None


def _nearest_axis_points_and_widths(case: Case, X: Floats) -> tuple[Floats, Floats]:
    """Return the nearest points on axes (n, 3), m, of points X (n, 3), m, and the section widths there (n,), m."""
    network = case.shape
    if not isinstance(network, Network):
        return _axis_points_and_widths(case.prism, X)
    axis, width, own = np.zeros_like(X), np.zeros(len(X)), network.nearest(X)
    for number in np.unique(own).tolist():
        axis[own == number], width[own == number] = _axis_points_and_widths(network.members[number], X[own == number])
    return axis, width


def _axis_points_and_widths(shape: Swept, X: Floats) -> tuple[Floats, Floats]:
    """Return the nearest points on the axis of one shape (n, 3), m, and the section widths there (n,), m."""
    s = np.clip(shape.stations(X), 0.0, shape.length).tolist()
    return np.array([shape.centre(at) for at in s]), np.array([max(shape.section_at(at).extents) for at in s])


def _disturbed_places(case: Case, thing: Any) -> Iterator[tuple[str, Vector3]]:
    """Yield the places on the axes, m, at which a support, load or joint acts, each with its name as text.

    `thing` is the declaration of the beam or frame model.
    """
    for load in case.loads:
        match load.thing.action:
            case PointLoad(at=at):
                yield f"`{load.name}`", _nearest_axis_point(case, at)
            case LineForce(begin=begin, end=end) | TendonLoad(begin=begin, end=end):
                yield from ((f"an end of `{load.name}`", _nearest_axis_point(case, at)) for at in (begin, end))
            case MomentLoad(where=where) | SurfaceTraction(where=where):
                yield from ((f"`{load.name}`", at) for at in _selected_places(case, thing, where))
    for support in case.supports:
        yield from ((f"`{support.name}`", at) for at in _selected_places(case, thing, support.thing.where))
    if isinstance(network := case.shape, Network):
        joints = [point for i, point in enumerate(network.points, start=1) if len(network.at(i)) > 1]
        yield from (("a joint", point) for point in joints)


def _nearest_axis_point(case: Case, at: Vector3) -> Vector3:
    """Return the point of the axis, m, that is nearest to a point."""
    if isinstance(case.shape, Network):
        return at
    return case.prism.centre(min(max(case.prism.section_coordinates(at)[0], 0.0), case.prism.length))


def _selected_places(case: Case, thing: Any, where: Any) -> Iterator[Vector3]:
    """Yield the points on the axes, m, that a condition `where` selects: ends of beams and nodes.

    `thing` is the declaration of the beam or frame model.
    """
    if isinstance(network := case.shape, Network):
        from softmark.interpreter.models.beam_frame import frame_selection

        points, members, _ = frame_selection.select_points_and_members(where, network)
        yield from (network.points[i] for i in points)
        for member in (network.members[i] for i in members):
            yield from (member.centre(s) for s in np.linspace(0.0, member.length, thing.segments + 1).tolist())
        return
    shape, stations = case.prism, tuple(thing.stations(case))
    ends = [s for s in (0.0, shape.length) if coverage(where, shape, s) == "all"]
    held = [s for s, taken in zip(stations, selects_whole_sections(where, shape, stations), strict=True) if taken]
    yield from (shape.centre(s) for s in {*ends, *held})
