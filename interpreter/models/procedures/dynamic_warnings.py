"""Warnings of dynamic analyses: energy that grows or is lost, time steps that are too long or were halved."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.solvers.dynamics.energy_balance import LOSS
from softmark.solvers.dynamics.time_step_resolution import WRONG, Resolution

if TYPE_CHECKING:
    from softmark.solvers.dynamics.dynamic_problem import Dynamics
    from softmark.solvers.dynamics.trajectory import Trajectory

KEEPS = "trapezoidal"  # integrator with the least numerical damping


def energy_warning(declared: Declared, analysis: Dynamic, track: Trajectory) -> tuple[Diagnostic, ...]:
    """Return a warning if energy increases without a source, or if numerical damping has dissipated most of it."""
    found, at = track.balance, declared.at()
    if found.has_excessive_gain:
        problem = f"{100 * found.gain:.0f} % of the largest energy was created"
        message = f"the energy of `{declared.name}` is not conserved: {problem}"
        remedy = "use a smaller step, or write an `amplitude` for loads and supports that act suddenly"
        return (diagnostic("W318", at, message, "the step is too long", remedy),)
    if found.loss <= LOSS:
        return ()
    other = "" if analysis.integrator == KEEPS else f", or `{KEEPS}`"
    message = f"the integrator dissipated {100 * found.loss:.0f} % of the energy of `{declared.name}`"
    remedy = f"use a smaller step{other}: the final state at rest is accurate, the motion towards it is not"
    return (diagnostic("W361", at, message, "numerical damping", remedy),)


def dissipation_warning(declared: Declared, track: Trajectory, problem: Dynamics) -> Iterator[Diagnostic]:
    """Yield a warning if the dissipated viscoelastic energy decreases in time."""
    if (history := problem.remembering) is None:
        return
    from softmark.interpreter.models.shared.viscoelastic_limits import dissipation_warnings

    moved = float((track.energies["kinetic"] + track.energies["strain"]).max())
    yield from dissipation_warnings(declared, np.array(history.losses), moved, history.has_unknown_energy)


def time_step_warning(declared: Declared, analysis: Dynamic, found: Resolution | None) -> tuple[Diagnostic, ...]:
    """Return a warning if the time step is too long for the slowest vibration that loads excite."""
    if found is None or not found.doubtful:
        return ()
    moves = {"vibration": "slowest vibration", "turn": "turning", "return": "return to rest"}[found.motion]
    of = "time" if found.motion == "return" else "period"
    period = units.format_value(float(f"{found.period:.3g}"), units.TIME)
    problem = (
        f"{found.steps:.2g} steps per {of} of {period}"
        if found.steps < found.few
        else f"at the end its error is {100 * min(found.error, 1.0):.0f} % of the amplitude ({of} {period})"
    )
    message = f"the {moves} of `{declared.name}` is not resolved by the time step: {problem}"
    step, shorter = units.format_value(analysis.step, units.TIME), _suggested_step(found, analysis)
    remedy = f"use a step of {shorter} or less: states at rest are accurate, the motion is not"
    return (diagnostic("W362", declared.at(), message, f"a step of {step}", remedy),)


def _suggested_step(found: Resolution, analysis: Dynamic) -> str:
    """Return a rounded time step that resolves the motion, as text; errors are of first or second order in it."""
    order = 1.0 if analysis.integrator == "implicit_euler" else 0.5
    step = min(found.period / (2.0 * found.few), analysis.step * (0.5 * WRONG / max(found.error, 1e-9)) ** order)
    return units.format_value(float(f"{step:.1g}"), units.TIME)


def halved_step_warning(declared: Declared, track: Trajectory) -> tuple[Diagnostic, ...]:
    """Return a warning if time steps were halved."""
    if not track.events:
        return ()
    first, message = track.events[0], f"`{declared.name}` halved its time step {len(track.events)} times"
    label = f"first at {units.format_value(first.time, units.TIME)}"
    return (diagnostic("W315", declared.at(), message, label, first.text),)
