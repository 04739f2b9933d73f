"""Checks of the states of an analysis, and of amplitudes, references and fits over them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from typing import Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.language.scene_states import find_time_dependent, in_state, states_of
from softmark.interpreter.problem.amplitude_tables import table_fault
from softmark.interpreter.results.state_results import TimeState, format_state
from softmark.interpreter.vocabulary.amplitude_words import PerState, Sine, Table
from softmark.interpreter.vocabulary.analysis_words import Dynamic, Quasistatic
from softmark.references.measured_curve import CurveFromFile
from softmark.references.measured_data import Unreadable
from softmark.references.published_values import GivenValues
from softmark.references.tracked_points import TrackedPoints

SHORTEST = 0.5  # least relative length of fibres that `active_strain` accepts
MOST = 1000  # largest number of states of an analysis
STEPS = 100_000  # largest number of steps of a quasistatic analysis
BEYOND = 1e-9  # relative to the duration: times this close to the end count as the end
SOME = "`analysis press = static(states = [5, 12.5, 18.25] %)`"


def state_of_largest_load(scene: Scene) -> Scene:
    """Return the scene in the state with the largest loads, for checks that depend on their size.

    Without states, or if the table of an amplitude is unreadable, loads and supports that depend on a state act with
    their full value.
    """
    states = states_of(scene)
    with suppress(Unreadable):  # reported elsewhere
        if states:
            sizes = [_state_factor(scene, state) for state in states]
            return in_state(scene, sizes.index(max(sizes)))
    full = {d.name: replace(d, thing=d.thing.in_state(0, 1.0)) for d in _driven_by_state(scene) if d.kind != "material"}
    return replace(scene, declared={**scene.declared, **full}) if full else scene


def _state_factor(scene: Scene, state: float) -> float:
    """Return the factor of the loads in a state, for the search of the largest loads.

    If states are times, it is the largest absolute amplitude at that time. Raises Unreadable.
    """
    if not isinstance(state, TimeState):
        return abs(state)
    moved = (d.thing.amplitude for d in find_time_dependent(scene))
    amplitudes = (c for c in moved if c is not None and not isinstance(c, PerState))
    return max((abs(c.at(state)) for c in amplitudes), default=1.0)


def _has_times(scene: Scene) -> bool:
    """Return whether the states of the analysis are times."""
    return any(isinstance(a.thing, Quasistatic) for a in scene.of_kind("analysis").values())


def _driven_by_state(scene: Scene) -> list[Declared]:
    """Return the loads and supports whose amplitude is the value of the state."""
    return [d for d in find_time_dependent(scene) if isinstance(d.thing.amplitude, PerState)]


def faults(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors and warnings about the states of the analysis.

    Without states, amplitudes and references that need states are reported. A scene with several analyses, itself an
    error, is skipped: states of one do not belong to another.
    """
    if len(scene.of_kind("analysis")) > 1:
        return
    states = states_of(scene)
    if scene.of_kind("contact"):
        from softmark.interpreter.validation.friction_checks import check_rotations

        yield from check_rotations(scene)
    yield from _check_number_of_states(scene, states)
    yield from _check_muscle_amplitudes(scene, states)
    yield from _check_hysteresis_metrics(scene, states)
    if scene.of_kind("contact"):
        from softmark.interpreter.validation import friction_checks

        yield from friction_checks.check_rotations(scene)
    driven = _driven_by_state(scene)
    tables = [r for r in scene.of_kind("reference").values() if r.value("states") is not None]
    if any(a.value("states") is not None and not states for a in scene.of_kind("analysis").values()):
        return
    if not states:
        moving = any(isinstance(a.thing, Dynamic) for a in scene.of_kind("analysis").values())
        yield from (_missing_states_error(d, "amplitude", "depends on the state", moving) for d in driven)
        yield from (_missing_states_error(r, "states", "was measured in several states", moving) for r in tables)
        return
    if _has_times(scene):
        yield from _check_state_times(scene, states)
        yield from (_missing_states_error(d, "amplitude", "depends on the state", True) for d in driven)
    yield from (
        wrong for r in tables if (wrong := _check_column_numbers(r) or _state_count_error(r, len(states))) is not None
    )
    if len(states) > 1:
        yield from (_single_state_error(r) for r in scene.of_kind("reference").values() if _is_single_measurement(r))
        yield from (_fitted_model_error(m) for m in scene.asked("model").values() if _is_fitted(m))
        if not driven and not tables and not _has_times(scene):
            yield _equal_states_warning(scene)


def _check_muscle_amplitudes(scene: Scene, states: tuple[float, ...]) -> Iterator[Diagnostic]:
    """Check for muscle tensions with a negative amplitude, and for fibres that active strain shortens too far."""
    for muscle in scene.of_kind("material").values():
        amplitude = getattr(muscle.thing, "amplitude", None)
        if amplitude is None:
            continue
        least, most = _amplitude_range(scene, amplitude, states)
        if muscle.thing.pulls:
            if least < 0.0:
                yield diagnostic("W398", muscle.at("amplitude"), f"the activation of `{muscle.name}` is negative in "
                                                              "part of its `amplitude`",
                                 f"down to {100.0 * least:.3g} % of its tension", "use an `amplitude` that keeps its "
                                                                                  "sign: a muscle pulls or does "
                                                                                  "nothing")  # fmt: skip
        elif isinstance(s := muscle.thing.shortening, float) and max(abs(least * s), abs(most * s)) > SHORTEST:
            yield diagnostic(
                "E379",
                muscle.at("amplitude"),
                f"`{muscle.name}` shortens too far in part of its `amplitude`",
                f"its factor goes from {least:.3g} to {most:.3g}, the full shortening is {100.0 * s:.3g} %",
                f"use smaller values: fibres shorten or lengthen by at most {100.0 * SHORTEST:g} %",
            )


def _amplitude_range(scene: Scene, amplitude: Any, states: tuple[float, ...]) -> tuple[float, float]:
    """Return the least and largest value of an amplitude in an analysis, including 0; 0 for an unreadable table."""
    if isinstance(amplitude, PerState):
        return min(states, default=0.0), max(states, default=0.0)
    if isinstance(amplitude, Sine):
        swings = amplitude.frequency * max(
            (getattr(a.thing, "duration", 0.0) for a in scene.of_kind("analysis").values()), default=0.0
        )
        ends = math.sin(2.0 * math.pi * swings)
        return (-1.0 if swings >= 0.75 else min(0.0, ends)), (1.0 if swings >= 0.25 else max(0.0, ends))
    try:
        return (min(amplitude.rows[1]), max(amplitude.rows[1])) if isinstance(amplitude, Table) else (0.0, 1.0)
    except Unreadable:
        return 0.0, 0.0


def _check_number_of_states(scene: Scene, states: tuple[float, ...]) -> Iterator[Diagnostic]:
    """Check that there is at least one state, and not more than a run can store."""
    for analysis in scene.of_kind("analysis").values():
        given = analysis.value("times" if _has_times(scene) else "states")
        if given is not None and not given.values:
            field = "times" if _has_times(scene) else "states"
            yield diagnostic("E311", analysis.at(field), f"the list of {field} of `{analysis.name}` is empty",
                             "an empty list", f"add some: {SOME}; or remove `{field}`")  # fmt: skip
    if len(states) > MOST:
        analysis = next(iter(scene.of_kind("analysis").values()))
        yield diagnostic("E311", analysis.at("states"), f"`{analysis.name}` has {len(states)} states",
                         f"more than {MOST}", "use fewer states: each is solved and kept")  # fmt: skip


def _check_state_times(scene: Scene, times: tuple[float, ...]) -> Iterator[Diagnostic]:
    """Check that state times increase, lie within the amplitude, and do not need too many time steps."""
    analysis = next(iter(scene.of_kind("analysis").values()))
    thing: Quasistatic = analysis.thing
    if any(b <= a for a, b in pairwise(times)):
        yield diagnostic("E361", analysis.at("times"), f"the times of `{analysis.name}` do not increase",
                         "not in order", "write each time after the one before it")  # fmt: skip
    if times and times[-1] > thing.duration * (1.0 + BEYOND):
        yield diagnostic(
            "E361",
            analysis.at("times"),
            f"`{analysis.name}` ends before the last of its `times`",
            f"it ends at {units.format_value(thing.duration, units.TIME)}",
            f"extend it to {units.format_value(times[-1], units.TIME)}, or give earlier times",
        )
    if (count := thing.duration / thing.step) > STEPS:
        yield diagnostic("E361", analysis.at("step"), f"`{analysis.name}` takes {count:.2g} steps",
                         f"more than {STEPS}", "use longer steps: every step is an equilibrium")  # fmt: skip
    if (wrong := _table_error(scene, thing.duration)) is not None:
        yield wrong


def _table_error(scene: Scene, duration: float) -> Diagnostic | None:
    """Return the error if a load or support cannot follow its amplitude table, or None."""
    return next((wrong for d in find_time_dependent(scene) if (wrong := table_fault(d, duration)) is not None), None)


def _check_hysteresis_metrics(scene: Scene, states: tuple[float, ...]) -> Iterator[Diagnostic]:
    """Check that hysteresis metrics have states of loading and unloading; dynamic analyses are refused with curves."""
    if any(isinstance(a.thing, Dynamic) for a in scene.of_kind("analysis").values()) or _has_times(scene):
        return  # over time a curve may load and unload without states
    for metric in scene.of_kind("metric").values():
        if metric.thing.of_all_states and (wrong := _loop_error(metric, states)) is not None:
            yield wrong


def _missing_states_error(declared: Declared, field: str, does: str, moving: bool) -> Diagnostic:
    help = f"add states to the analysis: {SOME}"
    if moving:
        help = f"use an amplitude in time such as `ramp(over = 0.5 s)`, or states: {SOME}"
    return diagnostic("E311", declared.at(field), f"`{declared.name}` {does}, but the analysis has no states",
                      "no states", help)  # fmt: skip


def _check_column_numbers(reference: Declared) -> Diagnostic | None:
    """Return the error for invalid column numbers, or for both a list of columns and a single one, or None."""
    if "state" in reference.fields:
        return diagnostic("E312", reference.at("state"), f"`{reference.name}` has both a `state` and `states`",
                          "only one of the two", "keep `states`, one for each state of the analysis")  # fmt: skip
    broken = next((s for s in reference.value("states").values if s != int(s)), None)
    if broken is None:
        return None
    return diagnostic("E312", reference.at("states"), f"{broken:g} is not the number of a state in a table",
                      "not a whole number", "write whole numbers: columns x1, y1, z1 are of state 1, x2, y2, z2 of "
                                            "state 2")  # fmt: skip


def _state_count_error(reference: Declared, count: int) -> Diagnostic | None:
    own = len(reference.value("states").values)
    if own == count:
        return None
    several = "state" if own == 1 else "states"
    return diagnostic("E312", reference.at("states"),
                      f"`{reference.name}` has {own} {several}, but the analysis has {count}", "not one per state",
                      "give one per state, in the order of the analysis; a state may be repeated")  # fmt: skip


def _is_single_measurement(reference: Declared) -> bool:
    many = isinstance(
        reference.thing, CurveFromFile | GivenValues
    )  # curves cover all states, and given values name their state
    return bool(reference.thing.how == "measured" and reference.value("states") is None and not many)


def _single_state_error(reference: Declared) -> Diagnostic:
    """Return the error for a measurement of one state that is used in other states."""
    help = "keep one state in the analysis, or put the measurement in a scene of its own with that state only"
    if isinstance(reference.thing, TrackedPoints):
        help = "give the state of the table for each state of the analysis: `states = [1, 2, 3]`"
    at = reference.at("state" if "state" in reference.fields else "")
    return diagnostic("E312", at, f"`{reference.name}` was measured in one state, but the analysis has several",
                      "which state?", help)  # fmt: skip


def _loop_error(metric: Declared, states: tuple[float, ...]) -> Diagnostic | None:
    """Return the error for a hysteresis metric if the states of the analysis do not load and then unload, else None.

    The metric measures the loop between the loading and the unloading force-displacement curve.
    """
    turn = max(range(len(states)), key=lambda i: abs(states[i] - states[0]), default=0)
    sides = [states[: turn + 1], states[turn:]]
    falls = turn > 0 and states[turn] < states[0]
    there, back = ([(b - a) * (-1.0 if falls else 1.0) for a, b in pairwise(side)] for side in sides)
    if there and back and min(there) > 0.0 and max(back) < 0.0:
        return None
    given = f"its states are {', '.join(map(format_state, states[:8]))}" if states else "the analysis has no states"
    return diagnostic(
        "E509",
        metric.at(),
        f"`{metric.name}` needs a loop, but the states do not load and unload",
        given,
        "load in some states and unload in later ones: `static(states = [25, 50, 75, 100, 75, 50, 25] %)`",
    )


def _is_fitted(model: Declared) -> bool:
    return vars(model.thing.stiffness).get("metric") is not None if "stiffness" in vars(model.thing) else False


def _fitted_model_error(model: Declared) -> Diagnostic:
    return diagnostic(
        "E314",
        model.at("stiffness"),
        f"`{model.name}` would be fitted again in every state",
        "different springs in each state",
        "calibrate it in a scene with one state and give the stiffness found there, "
        "`stiffness = uniform(...)`, or keep one state in the analysis",
    )


def _equal_states_warning(scene: Scene) -> Diagnostic:
    analysis = next(iter(scene.of_kind("analysis").values()))
    values = ", ".join(map(format_state, states_of(scene)[:6]))
    return diagnostic("W325", analysis.at("states"), f"the states of `{analysis.name}` are all the same",
                      f"nothing differs between {values}",
                      "give a load or a support `amplitude = per_state`, or remove `states`")  # fmt: skip
