"""Errors of contact: due to the gap that a barrier leaves, and due to meshes that do not follow the contact edge.

At the edge of contact the pressure falls as a square root, inside some cell of any mesh. Forces therefore converge with
the square of the cell size at most, and areas with the cell size. The position of the edge in its cell makes
differences between meshes irregular, so that three meshes show no order.
Source: Drouet and Hild 2015, SIAM J. Numer. Anal. 53:1488.

The mean pressure cannot exceed the largest pressure, so the force is at most area times largest pressure. A mesh that
violates this has an error in both, at least as large as the excess.

A rigid body seems larger by the gap. Nothing near a contact moves by more than the gap. Forces vary with at most the
square of the travel (for a cone), so their relative error is twice the gap over the travel; pressures and areas have
smaller errors.
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
    from softmark.interpreter.verification.probe_errors import ProbeResultUnderTest
    from softmark.interpreter.verification.solution_under_test import SolutionUnderTest

ORDER, OF_AREAS = 2.0, 1.0  # convergence orders of forces and inner pressures, and of areas
WITHIN = 0.5  # share of the area of facets at the edge of contact
POWER = 2.0  # largest exponent of contact forces over travel
PEAK = 1.5  # the greatest pressure over the mean of a round contact (Hertz 1881); 1.27 of one along a line
ROUNDED = 1.05  # 1 for uniform pressure, plus the error of the edge


def contact_error_index(seen: ProbeResultUnderTest, apart: float, ratio: float, farther: float | None) -> float:
    """Return the error of a contact metric, from its distance `apart` to a mesh that is `ratio` times coarser.

    It uses the theoretical order and the safety factor for two grids. The distance `farther` to the next coarser grid
    counts if the first two agree by chance.
    """
    from softmark.interpreter.metrics.contact import ContactArea
    from softmark.interpreter.verification.grid_convergence import FIRST

    order = OF_AREAS if isinstance(seen.metric, ContactArea) else ORDER
    fall: float = ratio**order
    found = FIRST * max(apart, (farther or 0.0) / fall) / (fall - 1.0)
    return max(found, contact_edge_error(seen.metric, seen)) if isinstance(seen.metric, ContactArea) else found


def contact_edge_error(metric: ContactArea, seen: ProbeResultUnderTest) -> float:
    """Return the error of a contact area from facets that the edge of the contact crosses, in the unit of the metric.

    It is half the area of these facets; for a relative metric it is divided by the contact area. It is zero if
    the facets are not known.
    """
    touch = None if seen.at_rest is None else seen.at_rest.touches.get(metric.of)
    field: Any = None if touch is None else touch.field
    if not (touch and field and touch.area > 0.0):
        return 0.0
    found: float = WITHIN * field.pressing.border / field.sides / touch.area * seen.size
    return found


def gap_errors(whole: SolutionUnderTest) -> dict[str, Callable[[ProbeResultUnderTest], float]]:
    """Return the error part due to contact gaps, as {part name: function of a probe result}; empty without contact."""
    from softmark.interpreter.vocabulary.self_contact_words import SelfContact

    own = [pair.name for pair in whole.case.pairs if isinstance(pair.thing, SelfContact)]
    if not (own or whole.case.contacts):
        return {}
    beds: Any = getattr(whole.prepared, "beds", {})
    return {"gap": partial(_gap_error, whole.case, {name: beds[name].distance for name in own if name in beds})}


def is_statically_determinate(case: Case, metric: Metric | None) -> bool:
    """Return whether the force that a metric measures follows from the balance with dead loads alone.

    This requires that nothing else holds the body along any axis of the metric's direction. A gap then does not
    change the force.
    """
    from softmark.interpreter.metrics.force import Force
    from softmark.interpreter.vocabulary.analysis_words import Dynamic

    if not isinstance(metric, Force) or metric.measured_from is not None or isinstance(case.analysis, Dynamic):
        return False
    if case.beds or case.pairs:
        return False
    axes = {axis for axis, part in enumerate(metric.along) if part}
    holding = {s.name for s in case.supports if axes & set(s.thing.components)}
    dead = all(load.thing.action.dead for load in case.loads)
    return dead and not (holding | {touch.name for touch in case.contacts}) - {metric.of}


def _gap_error(case: Case, widest: Mapping[str, float], seen: ProbeResultUnderTest) -> float:
    """Return the error due to the mean contact gap, scaled by the largest displacement of the body.

    `widest` has the largest gap, m, that the barrier of each self-contact may leave, by name. It is used where the mean
    gap is not known.
    """
    from softmark.interpreter.verification.probe_errors import NoErrorEstimate

    rest = seen.at_rest
    told = rest is not None and (rest.reason is None or bool(rest.touches))
    if rest is None or not (told or (widest and seen.unit == "m")):
        raise NoErrorEstimate("the gaps at the contacts are not known")
    left = max((dict(widest) | {name: touch.left for name, touch in rest.touches.items()}).values(), default=0.0)
    if seen.unit == "m":
        return left
    if is_statically_determinate(case, seen.metric):
        return 0.0
    return POWER * left / rest.moved * seen.size if rest.moved > 0.0 else 0.0


def tie_errors(whole: SolutionUnderTest) -> dict[str, Callable[[ProbeResultUnderTest], float]]:
    """Return the error part due to compliant ties, as {part name: function of a probe result}; empty without ties."""
    from softmark.interpreter.vocabulary.self_contact_words import Tied

    beds: Any = getattr(whole.prepared, "beds", {})
    own = [beds[pair.name] for pair in whole.case.pairs if isinstance(pair.thing, Tied) and pair.name in beds]
    return {"joint": partial(_tie_error, whole, own)} if own else {}


def _tie_error(whole: SolutionUnderTest, tied: Sequence[Any], seen: ProbeResultUnderTest) -> float:
    """Return the error due to the elastic energy stored in ties, which make the body too soft.

    To first order, the relative error of every load effect on the whole body is the ratio of this energy to the total.
    Displacements have at least the root mean square opening of the ties as error. Raises NoErrorEstimate if the ties
    store most of the energy, or if it is not known.
    """
    from softmark.interpreter.verification.grid_convergence import HOPELESS
    from softmark.interpreter.verification.probe_errors import NoErrorEstimate

    rest, mesh = seen.at_rest, whole.mesh
    if rest is None or rest.reason is not None or mesh is None:
        raise NoErrorEstimate("the energy in the tie constraints is not known")
    stored = [joint.value(mesh.displacement.ravel()) for joint in tied]
    share = sum(stored) / rest.energy if rest.energy > 0.0 else 0.0
    if share > HOPELESS:
        raise NoErrorEstimate("the tie constraints deform more than the body")
    open_by = max(math.sqrt(2.0 * W / (joint.stiffness * joint.area)) for W, joint in zip(stored, tied, strict=True))
    found = share * seen.size
    return max(found, open_by) if seen.unit == "m" else found


def force_excess(touch: ContactNumbers) -> float | None:
    """Return the ratio of the force to area times largest pressure if it exceeds 1, its physical bound, else None."""
    field: Any = touch.field
    if field is None or not touch.area * touch.pressure > 0.0:
        return None
    found = abs(float(field.pressing.f.sum())) / (field.sides * touch.area * touch.pressure)
    return found if found > ROUNDED else None


def least_error(seen: ProbeResultUnderTest) -> float | None:
    """Return a lower bound of the error of a contact area or pressure, in its unit, from the contact force.

    The force cannot exceed the contact area times the largest pressure; the error is at least the excess. None if there
    is no excess. Raises NoErrorEstimate if the bound is larger than the value.
    """
    from softmark.interpreter.metrics.contact import ContactArea, ContactPressure
    from softmark.interpreter.metrics.pressure_along import PressureAlong
    from softmark.interpreter.verification.grid_convergence import HOPELESS
    from softmark.interpreter.verification.probe_errors import NoErrorEstimate

    metric, rest = seen.metric, seen.at_rest
    if not isinstance(metric, ContactArea | ContactPressure | PressureAlong) or rest is None:
        return None
    times = force_excess(rest.touches[metric.of]) if metric.of in rest.touches else None
    if times is None:
        return None
    if PEAK * times - 1.0 > HOPELESS:
        raise NoErrorEstimate(
            f"the mesh is too coarse: the contact force is {times:.2g} times the contact area times the "
            "largest pressure"
        )
    return (PEAK * times - 1.0) * seen.size
