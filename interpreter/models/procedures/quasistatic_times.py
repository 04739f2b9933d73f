"""Time steps of quasistatic analyses of viscoelastic or poroelastic bodies, and the loads at each step."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.procedures.case_amplitudes import amplitude_of
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.vocabulary.amplitude_words import (
    Pulse,
    Ramp,
    Smooth,
    Table,
    at_full_size,
    deviations_between_steps,
    with_full_material,
)
from softmark.interpreter.vocabulary.analysis_words import Quasistatic
from softmark.records import dataclass
from softmark.solvers.dynamics.load_amplitudes import Amplitude
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.external_loads import ScaledLoad
from softmark.solvers.statics.quasistatic_history import InstantLoading

SAME = 1e-9  # of a step: nearer times count as equal
KINKED = 1e-3  # of a table's largest value: steps also end at rows that deviate more from interpolation between steps
BEFORE = 1e-9  # of a step: how long before a jump an amplitude is evaluated


def case_at_full_size(case: Case) -> Case:
    """Return the case with all loads, supports and fluid drains at full size."""

    def full(declared: Declared) -> Declared:
        """Return one load or support at full size."""
        return replace(declared, thing=at_full_size(declared.thing))

    body, parts = with_full_material(case.body), tuple(map(with_full_material, case.parts))
    loads, supports, drains = (tuple(map(full, acting)) for acting in (case.loads, case.supports, case.drains))
    return replace(case, body=body, parts=parts, loads=loads, supports=supports, drains=drains)


@dataclass(frozen=True)
class LoadAndSupportAmplitudes:
    """Amplitudes of loads and supports over time in a quasistatic analysis.

    `amplitudes` has one for each load, followed by those of muscles and tendons. `target` (c,) are the prescribed
    values
    of supports at amplitude 1. `movers` has the amplitudes of moving supports, each with the indices of the entries of
    `target` that it scales.
    """

    analysis: Quasistatic
    amplitudes: tuple[Amplitude, ...]
    movers: tuple[tuple[Amplitude, Ints], ...]
    target: Floats

    @classmethod
    def of(cls, case: Case, driven: Iterable[tuple[Declared, Energy]], owners: Iterable[Declared], target: Floats
           ) -> LoadAndSupportAmplitudes:  # fmt: skip
        """Return the schedule of a case whose loads and supports are at full size.

        `driven` has each load separately. `owners` has, for each entry of the `target` (c,), the support that imposes
        it.
        """
        analysis: Any = case.analysis
        moved: dict[Amplitude, list[int]] = {}
        for place, owner in enumerate(owners):
            moved.setdefault(amplitude_of(owner), []).append(place)
        movers = tuple((amplitude, np.array(places)) for amplitude, places in moved.items())
        return cls(analysis, tuple(amplitude_of(load) for load, _ in driven), movers, target)

    def acting(self, driven: Iterable[tuple[Declared, Energy]], t: float) -> list[tuple[Declared, Energy]]:
        """Return each load scaled by its amplitude at a time t, s."""
        shares = self.at(t, False).shares
        return [(load, ScaledLoad(energy, share)) for (load, energy), share in zip(driven, shares, strict=True)]

    def after(self, begin: float | None) -> list[InstantLoading]:
        """Return loads and supports at the end of every step after a time `begin`, s, up to the present output time.

        If `begin` is None, the steps begin at the start of the analysis.
        """
        near, first = SAME * self.analysis.step, -1.0 if begin is None else begin
        now = self.analysis.now
        return [self.at(t, jumps) for t, jumps in self.grid() if first + near < t <= now + near]

    def grid(self) -> Iterator[tuple[float, bool]]:
        """Yield the times of steps, outputs and amplitude breaks, s, with a flag.

        The flag is true for the state just before a jump of an amplitude at that time.
        """
        analysis, near = self.analysis, SAME * self.analysis.step
        times = {analysis.step * i for i in range(int(np.ceil(analysis.duration / analysis.step * (1.0 - SAME))))}
        times |= {analysis.duration, *map(float, analysis.moments)}
        amplitudes = {*self.amplitudes, *(amplitude for amplitude, _ in self.movers)}
        jumps = {t for c in amplitudes if isinstance(c, Pulse) for t in (c.start, c.until)}
        times |= jumps | {t for c in amplitudes if isinstance(c, Ramp | Smooth) for t in (c.start, c.start + c.over)}
        tables = (
            deviations_between_steps(c.rows, analysis.step, analysis.duration)
            for c in amplitudes
            if isinstance(c, Table)
        )
        times |= {t for rows in tables for t, off in rows if off > KINKED}
        last = -1.0
        for t in sorted(times):
            if t - last <= near or t > analysis.duration + near:
                continue
            if t > 0.0 and any(abs(t - jump) <= near for jump in jumps):
                yield t, True
            yield t, False
            last = t

    def at(self, t: float, before: bool) -> InstantLoading:
        """Return loads and supports at a time t, s, or just before a jump at that time if `before`."""
        at = t - BEFORE * self.analysis.step if before else t
        target = self.target.copy()
        for amplitude, which in self.movers:
            target[which] *= amplitude.at(at)
        return InstantLoading(t, tuple(amplitude.at(at) for amplitude in self.amplitudes), target)
