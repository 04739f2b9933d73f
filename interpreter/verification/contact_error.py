"""Errors of bodies that touch: of the gap that a barrier leaves, and of a mesh that does not follow their border.

Where contact ends the pressure goes as a root, on any mesh inside of some cell: forces converge with the square of the
size and no faster (Drouet and Hild 2015, SIAM J. Numer. Anal. 53:1488), areas with the size, and how the border lies in
its cell makes differences of meshes jump, so that three of them show no order.

Of pressures, their mean is not more than the greatest, so that a force is no more than area times greatest pressure: a
mesh in which it is more knows neither. By how much says how far these may be off where nothing else does.

A rigid body seems larger by the gap. Nothing near a contact moves by more than that; forces go with a power of the
travel of at most two (a cone), so that they are off by twice the gap over the travel, pressures and areas by less.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from softmark.interpreter.metrics.contact import ContactArea
    from softmark.interpreter.metrics.metric_base import Metric
    from softmark.interpreter.problem.body_case import Case
    from softmark.interpreter.results.reaction_results import ContactNumbers
    from softmark.interpreter.verification.probe_errors import ProbeAnswer
    from softmark.interpreter.verification.solution_under_test import Answer

ORDER, OF_AREAS = 2.0, 1.0  # of forces, and pressures inside; and of areas
WITHIN = 0.5  # of the facets that the border is in
POWER = 2.0  # of the travel, that forces of contact go with at most
PEAK = 1.5  # the greatest pressure over the mean of a round contact (Hertz 1881); 1.27 of one along a line
ROUNDED = 1.05  # where all that is pressed is pressed alike it is 1, but for how the border is found


def index(whole: Answer, seen: ProbeAnswer, apart: float, ratio: float, farther: float | None) -> float:
    """The error of what forces tell, from its distance to a mesh that is `ratio` times coarser.

    By the order in theory, with the factor of two grids; where these are near by chance, by the next coarser one. The
    ratio is told of cells in space; of a slice their number goes with the square.
    """
    from softmark.interpreter.metrics.contact import ContactArea
    from softmark.interpreter.verification.grid_convergence import FIRST

    order = OF_AREAS if isinstance(seen.metric, ContactArea) else ORDER
    fall: float = ratio ** (1.5 * order if whole.case.planar else order)
    found = FIRST * max(apart, (farther or 0.0) / fall) / (fall - 1.0)
    return max(found, _border(seen.metric, seen)) if isinstance(seen.metric, ContactArea) else found


def _border(metric: ContactArea, seen: ProbeAnswer) -> float:
    """Half of the facets that the border is in, in the unit of an area; nothing where these are not known."""
    touch = None if seen.at_rest is None else seen.at_rest.touches.get(metric.of)
    field: Any = None if touch is None else touch.field
    if not (touch and field and touch.area > 0.0):
        return 0.0
    found: float = WITHIN * field.pressing.border / field.sides / touch.area * seen.size
    return found


def gaps(whole: Answer) -> dict[str, Callable[[ProbeAnswer], float]]:
    """The part of the stated error that comes of gaps; none where nothing may touch."""
    from softmark.interpreter.vocabulary.self_contact_words import Itself

    own = [pair.name for pair in whole.case.pairs if isinstance(pair.thing, Itself)]
    if not (own or whole.case.contacts):
        return {}
    beds: Any = getattr(whole.prepared, "beds", {})
    return {"gap": partial(_left, whole.case, {name: beds[name].distance for name in own if name in beds})}


def is_statically_determinate(case: Case, metric: Metric | None) -> bool:
    """Return whether balance with only dead loads fixes the force of a contact or support along a direction.

    This requires that nothing else holds the body along any axis of that direction. A gap then does not change it.
    """
    from softmark.interpreter.metrics.force import Force
    from softmark.interpreter.vocabulary.analysis_words import Dynamic
    from softmark.interpreter.vocabulary.load_words import (
        BodyForce,
        LineForce,
        PointLoad,
        RemoteStress,
        SurfaceTraction,
    )

    if not isinstance(metric, Force) or metric.measured_from is not None or isinstance(case.analysis, Dynamic):
        return False
    if case.beds or case.pairs:
        return False
    axes = {axis for axis, part in enumerate(metric.along) if part}
    holding = {s.name for s in case.supports if axes & set(getattr(s.thing, "components", (0, 1, 2)))}
    dead = all(
        isinstance(load.thing.action, PointLoad | SurfaceTraction | LineForce | BodyForce | RemoteStress)
        for load in case.loads
    )
    return dead and not (holding | {touch.name for touch in case.contacts}) - {metric.of}


def _left(case: Case, widest: Mapping[str, float], seen: ProbeAnswer) -> float:
    """By the mean gap where something presses; the travel is taken for the largest displacement of the body.

    Of a body that meets itself by what its barrier leaves at most, m, by name, where no more is known.
    """
    from softmark.interpreter.verification.probe_errors import Unknown

    rest = seen.at_rest
    told = rest is not None and (rest.reason is None or bool(rest.touches))
    if rest is None or not (told or (widest and seen.unit == "m")):
        raise Unknown("what the contacts leave open is not known")
    left = max((dict(widest) | {name: touch.left for name, touch in rest.touches.items()}).values(), default=0.0)
    if seen.unit == "m":
        return left
    if is_statically_determinate(case, seen.metric):
        return 0.0
    return POWER * left / rest.moved * seen.size if rest.moved > 0.0 else 0.0


def joints(whole: Answer) -> dict[str, Callable[[ProbeAnswer], float]]:
    """The part that comes of joints that give way; none where nothing is tied."""
    from softmark.interpreter.vocabulary.self_contact_words import Tied

    beds: Any = getattr(whole.prepared, "beds", {})
    own = [beds[pair.name] for pair in whole.case.pairs if isinstance(pair.thing, Tied) and pair.name in beds]
    return {"joint": partial(_given, whole, own)} if own else {}


def _given(whole: Answer, tied: Sequence[Any], seen: ProbeAnswer) -> float:
    """By the share of the energy that is in the springs of joints: without these a body is stiffer by as much.

    That is so of whatever moves a body as a whole, to first order; displacements are off by how far joints open as
    well, in the mean square. Raises Unknown where it is most of the energy, or nothing is known of it.
    """
    from softmark.interpreter.verification.grid_convergence import HOPELESS
    from softmark.interpreter.verification.probe_errors import Unknown

    rest, mesh = seen.at_rest, whole.mesh
    if rest is None or rest.reason is not None or mesh is None:
        raise Unknown("what joints give way by is not known")
    stored = [joint.value(mesh.displacement.ravel()) for joint in tied]
    share = sum(stored) / rest.energy if rest.energy > 0.0 else 0.0
    if share > HOPELESS:
        raise Unknown("joints give way by more than the body does")
    open_by = max(math.sqrt(2.0 * W / (joint.stiffness * joint.area)) for W, joint in zip(stored, tied, strict=True))
    found = share * seen.size
    return max(found, open_by) if seen.unit == "m" else found


def beyond(touch: ContactNumbers) -> float | None:
    """What presses over area times largest pressure, where it is more than 1: no pressure is like that."""
    field: Any = touch.field
    if field is None or not touch.area * touch.pressure > 0.0:
        return None
    found = abs(float(field.pressing.f.sum())) / (field.sides * touch.area * touch.pressure)
    return found if found > ROUNDED else None


def at_least(seen: ProbeAnswer) -> float | None:
    """How far an area or a pressure may be off that contradicts the force, in its unit; None where it does not.

    Raises Unknown where it is more than all of it.
    """
    from softmark.interpreter.metrics.contact import ContactArea, ContactPressure
    from softmark.interpreter.metrics.pressure_along import PressureAlong
    from softmark.interpreter.verification.grid_convergence import HOPELESS
    from softmark.interpreter.verification.probe_errors import Unknown

    metric, rest = seen.metric, seen.at_rest
    if not isinstance(metric, ContactArea | ContactPressure | PressureAlong) or rest is None:
        return None
    times = beyond(rest.touches[metric.of]) if metric.of in rest.touches else None
    if times is None:
        return None
    if PEAK * times - 1.0 > HOPELESS:
        raise Unknown(f"the mesh is too coarse: the force is {times:.2g} times the area and the greatest pressure")
    return (PEAK * times - 1.0) * seen.size
