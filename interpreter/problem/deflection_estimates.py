"""Estimates of deflections by beam theory, for warnings before anything is computed."""

from __future__ import annotations

from typing import Any

from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.vocabulary.loads.point_force import PointLoad
from softmark.interpreter.vocabulary.loads.surface_traction import SurfaceTraction
from softmark.interpreter.vocabulary.loads.tendon import TendonLoad
from softmark.interpreter.vocabulary.loads.torque import MomentLoad
from softmark.solvers.mesh.shape import Prism, cross


def bending_angle(case: Case) -> float | None:
    """Return the slope, rad, at the free end of a straight cantilever for small deflections; None if not applicable.

    The slope is w L^3 / (6 EI) under a distributed force, P L^2 / (2 EI) under an end force, M L / EI under an end
    moment.
    Source: Timoshenko 1955.
    """
    shape = case.shape
    if not isinstance(shape, Prism) or case.parts:
        return None
    EI: float = case.material.young * min(shape.section.moments)
    per_length = case.material.density * shape.section.area
    along = shape.axis
    distributed = _perpendicular_length([per_length * g for g in case.gravity], along)
    turned = _perpendicular_length(
        [sum(m[i] for m in (_moment(d, shape) for d in case.loads)) for i in range(3)], along
    )
    ends = [_force(d.thing.action, shape) for d in case.loads]
    end = _perpendicular_length([sum(f[i] for f in ends) for i in range(3)], along)
    length: float = shape.length
    return (distributed * length**3 / 6 + end * length**2 / 2 + turned * length) / EI


def _force(action: Any, shape: Prism) -> tuple[float, ...]:
    if isinstance(action, PointLoad):
        return action.force
    if isinstance(action, SurfaceTraction):  # as if on the end face; an estimate
        return tuple(t * shape.section.area for t in action.traction)
    return (0.0, 0.0, 0.0)


def _moment(load: Any, shape: Prism) -> tuple[float, ...]:
    action = load.thing.action
    if isinstance(action, TendonLoad):  # its pull on the mean of the arms at its ends
        middle = (0.5 * (a + b) - r for a, b, r in zip(action.begin, action.end, shape.root, strict=True))
        return cross(tuple(middle), tuple(-action.tension * a for a in shape.axis))
    return action.moment if isinstance(action, MomentLoad) else (0.0, 0.0, 0.0)


def _perpendicular_length(vector: list[float], axis: tuple[float, ...]) -> float:
    """Return the length of the component of a vector perpendicular to the axis."""
    along = sum(v * a for v, a in zip(vector, axis, strict=True))
    return float(sum((v - along * a) ** 2 for v, a in zip(vector, axis, strict=True)) ** 0.5)
