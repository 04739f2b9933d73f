"""Checks of amplitudes given by a table: the table must be readable and cover the whole analysis."""

from __future__ import annotations

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.vocabulary.amplitude_words import Table
from softmark.references.measured_data import Unreadable

NEAR = 1e-9  # relative to the duration: what ends there goes to its end


def table_fault(declared: Declared, duration: float) -> Diagnostic | None:
    """Return the error if an amplitude table is unreadable or too short for an analysis, else None.

    `duration` is the length of the analysis, s.
    """
    amplitude = declared.thing.amplitude
    if not isinstance(amplitude, Table):
        return None
    at = declared.at("amplitude")
    try:
        times, _, _ = amplitude.rows
    except Unreadable as error:
        problem = f"the table of `{declared.name}` cannot be used: {error.reason}"
        return diagnostic("E409", at, problem, "not an amplitude", error.remedy)
    if times[0] > NEAR * duration or times[-1] < duration * (1.0 - NEAR):
        span = units.format_range(times[0], times[-1], units.TIME)
        return diagnostic("E315", at, f"the table of `{declared.name}` does not cover the whole analysis",
                          f"it goes from {span}",
                          f"add rows from 0 to {units.format_value(duration, units.TIME)}, the time of the analysis, "
                          "or use a shorter analysis")  # fmt: skip
    return None
