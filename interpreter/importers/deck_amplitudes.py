"""Amplitudes of a deck (*AMPLITUDE), which describe how loads vary over a step.

Source: Abaqus Analysis User's Guide, "Amplitude curves"; Dhondt, "CalculiX CrunchiX User's Manual", *AMPLITUDE.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise

from softmark.solvers.mesh.files.abaqus.keyword_lines import Card, read_number

OPTIONS = frozenset({"NAME", "DEFINITION", "TIME", "VALUE"})
EQUAL = frozenset({"FIXEDINTERVAL", "BEGIN"})


@dataclass(frozen=True)
class Amplitude:
    """Curve of times and factors, linear or smooth between its points and constant outside them."""

    times: tuple[float, ...]
    values: tuple[float, ...]
    total_time: bool = False
    smooth: bool = False

    def at(self, time: float) -> float:
        """Return the load factor at a time of the step, or at a time of the whole analysis with `total_time`."""
        if time <= self.times[0]:
            return self.values[0]
        for i in range(1, len(self.times)):
            if time <= self.times[i]:
                x = (time - self.times[i - 1]) / (self.times[i] - self.times[i - 1])
                x = x**3 * (10.0 - 15.0 * x + 6.0 * x * x) if self.smooth else x
                return self.values[i - 1] + x * (self.values[i] - self.values[i - 1])
        return self.values[-1]


def read_amplitude(card: Card) -> Amplitude | str:
    """Return the curve of a card, or the reason why it is not read. Raises DeckError."""
    kind = "".join(card.options.get("DEFINITION", "TABULAR").upper().split())
    known = OPTIONS | (EQUAL if kind == "EQUALLYSPACED" else {"SMOOTH"})  # SMOOTH rounds the corners of derivatives
    if kind not in ("TABULAR", "EQUALLYSPACED", "SMOOTHSTEP"):
        return f"DEFINITION={kind} is not supported, only tables"
    if unknown := card.unknown_options(frozenset(known)):
        return f"its option {unknown[0]} is not supported"
    if card.options.get("VALUE", "RELATIVE").upper() != "RELATIVE":
        return "VALUE=ABSOLUTE is not supported"
    numbers = [read_number(word, card) for row in card.each_row() for word in row if word]
    if kind == "EQUALLYSPACED":
        step = read_number(card.options.get("FIXEDINTERVAL", "0"), card)
        begin = read_number(card.options.get("BEGIN", "0"), card)
        times, values = [begin + i * step for i in range(len(numbers))], numbers
    else:
        times, values = numbers[::2], numbers[1::2]
    if not values or len(times) != len(values) or any(b <= a for a, b in pairwise(times)):
        return "its data are not pairs of increasing time and factor"
    total = "".join(card.options.get("TIME", "STEPTIME").upper().split()) == "TOTALTIME"
    return Amplitude(tuple(times), tuple(values), total, kind == "SMOOTHSTEP")


@dataclass(frozen=True)
class StepTimes:
    """Times at which the load factors of a step are evaluated: its end, and the end of the last imported step."""

    period: float
    total: float


@dataclass
class Amplitudes:
    """All amplitude curves of a deck by name in upper case; for a curve that was not read, the reason."""

    curves: Mapping[str, Amplitude | str] = field(default_factory=dict)

    def factor(self, name: str, times: StepTimes) -> float | str:
        """Return the factor of a load at the end of its step, or the reason why there is none."""
        found = self.curves.get(name.upper(), f"the amplitude `{name[:60]}` is not defined")
        if isinstance(found, str):
            return found
        return found.at(times.total if found.total_time else times.period)
