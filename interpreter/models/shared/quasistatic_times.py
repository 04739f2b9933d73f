"""The times of a quasistatic analysis at which bodies that remember are solved, and what acts at each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.shared.solid_dynamics import course_of
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.vocabulary.amplitude_words import Pulse, Ramp, Smooth, Table, in_full, in_whole, off_the_steps
from softmark.interpreter.vocabulary.analysis_words import Quasistatic
from softmark.records import dataclass
from softmark.solvers.dynamics.load_amplitudes import Course
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.external_loads import Share
from softmark.solvers.statics.quasistatic_history import Instant

SAME = 1e-9  # of a step: times that are nearer are one
KINKED = 1e-3  # of a table's largest value: steps end at its rows that are farther from what steps make of it
BEFORE = 1e-9  # of a step: where a course is looked at before it jumps


def whole_of(case: Case) -> Case:
    """The case with all that acts at its full size."""

    def full(declared: Declared) -> Declared:
        return replace(declared, thing=in_full(declared.thing))

    body, parts = in_whole(case.body), tuple(map(in_whole, case.parts))
    loads, supports, drains = (tuple(map(full, acting)) for acting in (case.loads, case.supports, case.drains))
    return replace(case, body=body, parts=parts, loads=loads, supports=supports, drains=drains)


@dataclass(frozen=True)
class Timed:
    """What acts in an analysis: `courses` of every load, `movers`, and the `target` that supports impose (c,) in full.

    What pulls within comes after the loads. A mover is a course, and which of what is imposed follows it.
    """

    analysis: Quasistatic
    courses: tuple[Course, ...]
    movers: tuple[tuple[Course, Ints], ...]
    target: Floats

    @classmethod
    def of(cls, case: Case, driven: Iterable[tuple[Declared, Energy]], owners: Iterable[Declared], target: Floats
           ) -> Timed:  # fmt: skip
        """That of a case at full size: all that is `driven` by itself, and who imposes each of the target (c,)."""
        analysis: Any = case.analysis
        moved: dict[Course, list[int]] = {}
        for place, owner in enumerate(owners):
            moved.setdefault(course_of(owner), []).append(place)
        movers = tuple((course, np.array(places)) for course, places in moved.items())
        return cls(analysis, tuple(course_of(load) for load, _ in driven), movers, target)

    def acting(self, driven: Iterable[tuple[Declared, Energy]], t: float) -> list[tuple[Declared, Energy]]:
        """All that is driven, by itself as it acts at a time, s."""
        shares = self.at(t, False).shares
        return [(load, Share(energy, share)) for (load, energy), share in zip(driven, shares, strict=True)]

    def after(self, begin: float | None) -> list[Instant]:
        """What acts at the end of every step up to now, from a time on, s, or from the start."""
        near, first = SAME * self.analysis.step, -1.0 if begin is None else begin
        now = self.analysis.now
        return [self.at(t, jumps) for t, jumps in self.grid() if first + near < t <= now + near]

    def grid(self) -> Iterator[tuple[float, bool]]:
        """The ends of steps, and whether it is just before a jump: the start, every step, every time, every break."""
        analysis, near = self.analysis, SAME * self.analysis.step
        times = {analysis.step * i for i in range(int(np.ceil(analysis.duration / analysis.step * (1.0 - SAME))))}
        times |= {analysis.duration, *map(float, analysis.moments)}
        courses = {*self.courses, *(course for course, _ in self.movers)}
        jumps = {t for c in courses if isinstance(c, Pulse) for t in (c.start, c.until)}
        times |= jumps | {t for c in courses if isinstance(c, Ramp | Smooth) for t in (c.start, c.start + c.over)}
        tables = (off_the_steps(c.rows, analysis.step, analysis.duration) for c in courses if isinstance(c, Table))
        times |= {t for rows in tables for t, off in rows if off > KINKED}
        last = -1.0
        for t in sorted(times):
            if t - last <= near or t > analysis.duration + near:
                continue
            if t > 0.0 and any(abs(t - jump) <= near for jump in jumps):
                yield t, True
            yield t, False
            last = t

    def at(self, t: float, before: bool) -> Instant:
        """What acts at a time, s, or just before it."""
        at = t - BEFORE * self.analysis.step if before else t
        target = self.target.copy()
        for course, which in self.movers:
            target[which] *= course.at(at)
        return Instant(t, tuple(course.at(at) for course in self.courses), target)
