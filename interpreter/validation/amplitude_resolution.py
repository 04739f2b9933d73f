"""Checks that the time step resolves the amplitudes of loads, muscles and supports.

Loads enter as their exact means over each step, so that a short pulse has the right impulse; oscillations faster than
the steps appear slower than they are (aliasing). Supports are prescribed at the ends of steps, and their motion within
a step is lost.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.language.scene_states import find_time_dependent
from softmark.interpreter.problem.amplitude_tables import table_fault
from softmark.interpreter.problem.body_case import porous
from softmark.interpreter.vocabulary.amplitude_words import (
    Pulse,
    Ramp,
    Sine,
    Smooth,
    Table,
    at_full_size,
    deviations_between_steps,
)
from softmark.interpreter.vocabulary.analysis_words import Dynamic, Quasistatic

if TYPE_CHECKING:
    from softmark.interpreter.problem.body_case import Case

SEEN = 4.0  # steps per period: with fewer, the doubled step of the error estimate aliases
SHOWN = 10.0  # steps per period: with fewer, second-order integrators have errors above 3 %
HELD = 2.0  # least number of steps with the support displaced
NEAR = 1e-6  # relative to a step: tolerance for times at the ends of steps
MISSED = 0.3  # relative to a table's largest value: error of four steps per period, 1 - cos(pi / 4)
OFF = 0.05  # the same for ten steps, 1 - cos(pi / 10)


def check_amplitude_resolution(scene: Scene) -> Iterator[Diagnostic]:
    """Yield diagnostics of amplitudes that the time step does not resolve: errors for aliasing, otherwise warnings."""
    analysis = next((a.thing for a in scene.of_kind("analysis").values()), None)
    if isinstance(analysis, Quasistatic):
        yield from _check_quasistatic(scene, analysis)
    if not isinstance(analysis, Dynamic):
        return
    for declared in find_time_dependent(scene):
        amplitude = declared.thing.amplitude
        if amplitude is None:
            continue
        if isinstance(amplitude, Table):
            yield from _check_table(declared, amplitude, analysis)
        elif isinstance(amplitude, Sine):
            yield from _check_sine(declared, amplitude, analysis.step)
        elif amplitude.start >= analysis.duration:
            yield _late_amplitude_warning(declared, amplitude.start, analysis.duration)
        elif declared.kind == "support":
            yield from _check_moving_support(declared, amplitude, analysis.step)
        elif isinstance(amplitude, Pulse) and _pulse_duration(amplitude) < analysis.step * (1.0 - NEAR):
            yield diagnostic(
                "W378",
                declared.at("amplitude"),
                f"the pulse of `{declared.name}` is shorter than the time step",
                f"it lasts {_format_time(_pulse_duration(amplitude))}, the step is {_format_time(analysis.step)}",
                f"use a step of "
                f"{_format_time(_round_time_step(_pulse_duration(amplitude) / SHOWN))} or less to resolve the "
                "response to the pulse; its impulse and the slow response are right",
            )


def _check_quasistatic(scene: Scene, analysis: Quasistatic) -> Iterator[Diagnostic]:
    """Check the amplitudes of a quasistatic analysis for oscillations that its steps do not resolve.

    Steps end at every break of an amplitude.
    """
    materials = [m.thing for m in scene.of_kind("material").values()]
    remembers = any(getattr(thing, "branches", ()) or porous(thing) for thing in materials)
    for declared in find_time_dependent(scene):
        amplitude = at_full_size(declared.thing).amplitude
        if isinstance(amplitude, Sine) and remembers:
            yield from _check_sine(declared, amplitude, analysis.step)
        elif isinstance(amplitude, Table):
            yield from _check_column_unit(declared, amplitude)
        elif isinstance(amplitude, Pulse | Ramp | Smooth) and amplitude.start >= analysis.duration:
            yield _late_amplitude_warning(declared, amplitude.start, analysis.duration)
        elif isinstance(amplitude, Pulse) and not _pulse_duration(amplitude):
            yield diagnostic("W378", declared.at("amplitude"), f"the pulse of `{declared.name}` ends before it begins",
                             f"from {_format_time(amplitude.start)} until {_format_time(amplitude.until)}",
                             "set `until`, the time at which the pulse ends, after `start`; as written, the pulse "
                             "has no effect")  # fmt: skip


def _late_amplitude_warning(declared: Declared, start: float, end: float) -> Diagnostic:
    """Return the warning for an amplitude that begins after the analysis ends."""
    return diagnostic("W378", declared.at("amplitude"), f"`{declared.name}` begins after the end of the analysis",
                      f"it begins at {_format_time(start)}, the analysis ends at {_format_time(end)}",
                      "use a longer `duration`; as written, it has no effect")  # fmt: skip


def is_resolved_by_step(case: Case, step: float) -> bool:
    """Return whether time steps of this length, s, resolve all amplitudes of a case."""
    things = [d.thing for d in (*case.loads, *case.muscles, *case.supports)]
    swings = [t.amplitude for t in things if isinstance(t.amplitude, Sine)]
    tables = [t.amplitude for t in things if isinstance(t.amplitude, Table)]
    end = case.analysis.duration if isinstance(case.analysis, Dynamic) else 0.0
    followed = all(_table_deviation(amplitude, step, end) <= MISSED for amplitude in tables)
    return followed and all(1.0 / (c.frequency * step) >= SEEN for c in swings)


def _check_table(declared: Declared, amplitude: Table, analysis: Dynamic) -> Iterator[Diagnostic]:
    """Check how far a table deviates from straight lines between the ends of time steps."""
    if amplitude.path.startswith("data:"):
        return  # checked by the run
    if (fault := table_fault(declared, analysis.duration)) is not None:
        yield fault
        return
    yield from _check_column_unit(declared, amplitude)
    left = _table_deviation(amplitude, analysis.step, analysis.duration)
    label = f"off by up to {100.0 * left:.2g} % of its maximum between steps of {_format_time(analysis.step)}"
    if left > MISSED and declared.kind == "support":
        yield diagnostic("E316", declared.at("amplitude"), "the time step does not resolve the table of "
                                                        f"`{declared.name}`", label,
                         "use a shorter step: the motion of a support within a step is not computed")  # fmt: skip
    elif left > OFF:
        held = "the motion of a support within a step is not computed"
        acts = "its impulse and the slow response are right, but the response within a step is not resolved"
        help = held if declared.kind == "support" else acts
        yield diagnostic(
            "W329",
            declared.at("amplitude"),
            f"the time step does not fully resolve the table of `{declared.name}`",
            label,
            f"{help}: use a shorter step, or remove details that do not matter from the table",
        )


def _check_column_unit(declared: Declared, amplitude: Table) -> Iterator[Diagnostic]:
    """Check the unit in the name of a table's time column."""
    if units.has_conflicting_unit(amplitude.at_, amplitude.time_unit, units.TIME):
        yield diagnostic("W334", declared.at("amplitude"), f"the column name `{amplitude.at_}` states a different unit",
                         f"`time_unit` is {_format_time(amplitude.time_unit)}",
                         "correct `time_unit` or the name of the column")  # fmt: skip


def _table_deviation(amplitude: Table, step: float, duration: float) -> float:
    """Return the largest deviation of a table from straight lines between steps, relative to its largest value."""
    return max((off for _, off in deviations_between_steps(amplitude.rows, step, duration)), default=0.0)


def _check_sine(declared: Declared, amplitude: Sine, step: float) -> Iterator[Diagnostic]:
    """Check the number of time steps per period of a sine."""
    count = 1.0 / (amplitude.frequency * step)
    if count >= SHOWN * (1.0 - NEAR):
        return
    label = f"{count:.3g} steps of {_format_time(step)} per period of {_format_time(1.0 / amplitude.frequency)}"
    better = _format_time(_round_time_step(1.0 / (SHOWN * amplitude.frequency)))
    if count < SEEN:
        yield diagnostic("E381", declared.at("amplitude"),
                         f"the time step does not resolve the sine of `{declared.name}`", label,
                         f"use a step of {better} or less: with this step a slower oscillation would be computed "
                         "(aliasing)")  # fmt: skip
    else:
        yield diagnostic(
            "W377",
            declared.at("amplitude"),
            f"the sine of `{declared.name}` has few time steps per period",
            label,
            f"use a step of {better} or less: amplitude and phase are off by several percent",
        )


def _check_moving_support(declared: Declared, amplitude: Pulse | Ramp | Smooth, step: float) -> Iterator[Diagnostic]:
    """Check the amplitude of a moving support, whose motion within a time step is lost."""
    if not isinstance(amplitude, Pulse):
        if amplitude.over < step * (1.0 - NEAR):
            yield diagnostic(
                "W378",
                declared.at("amplitude"),
                f"`{declared.name}` moves all the way within one time step",
                f"it moves in {_format_time(amplitude.over)}, the step is {_format_time(step)}",
                f"use a step of {_format_time(_round_time_step(amplitude.over / SHOWN))} or less to resolve the motion",
            )
        return
    width = _pulse_duration(amplitude)
    if width < HELD * step * (1.0 - NEAR):
        yield diagnostic(
            "E382",
            declared.at("amplitude"),
            f"the time step does not resolve the pulse of `{declared.name}`",
            f"it lasts {width / step:.2g} steps of {_format_time(step)}",
            f"use a step of {_format_time(_round_time_step(width / SHOWN))} or less: the motion of a support within a "
            "step is not computed",
        )
    elif width < SHOWN * step and not (_is_whole(amplitude.start / step) and _is_whole(amplitude.until / step)):
        yield diagnostic(
            "W378",
            declared.at("amplitude"),
            f"the pulse of `{declared.name}` begins or ends within a time step",
            f"it lasts {width / step:.3g} steps of {_format_time(step)}",
            f"use a step that divides the times of the pulse, or one of "
            f"{_format_time(_round_time_step(width / SHOWN))} "
            "or less: a support moves in whole steps",
        )


def _pulse_duration(amplitude: Pulse) -> float:
    """Return the duration of a pulse, s."""
    return max(0.0, amplitude.until - amplitude.start)


def _is_whole(number: float) -> bool:
    """Return whether a number is whole, up to rounding."""
    return abs(number - round(number)) < NEAR


def _round_time_step(step: float) -> float:
    """Round a time step, s, down to two digits."""
    if not step > 0.0:
        return step
    digit = 10.0 ** (math.floor(math.log10(step)) - 1)
    return float(f"{math.floor(step / digit * (1.0 + 1e-12)) * digit:.2g}")


def _format_time(t: float) -> str:
    return units.format_value(float(f"{t:.4g}"), units.TIME)
