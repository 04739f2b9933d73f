"""A point of a comparison: one configuration with its effort, its errors, its shape, and how finely it was solved.

It is read from the JSON of a task, of a journal or of a saved `softmark-compare/1` by `ComparedPoint.from_json`, and
nowhere else; what an older version did not write has a default. Nothing here computes an error or a time.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from functools import cached_property
from typing import ClassVar

from softmark.interpreter.results.json_records import Json, Plain, by_name, several
from softmark.interpreter.results.state_results import ANSWERED
from softmark.interpreter.study.analysis.timing_quality import WHOLE
from softmark.interpreter.study.configurations.task_outcome import PointError, PointWarning, ProbeTrace
from softmark.records import dataclass

READ = "read"  # solved by somebody else, and no clock of ours
CLOCKS = ("cpu_s", "wall_s")
UNKNOWNS = "unknowns"  # the effort where nothing was timed
INVERTED = ("W324", "W351")  # warnings that cells of a solution are inside out
INSIDE_OUT = "its cells are inside out"
SPREADS = (*CLOCKS, "step_s", "step_cpu_s", "setup_s")


# ------------------------------------------------------------------ effort


@dataclass(frozen=True)
class Spread(Plain):
    """A median with its quartiles; all three the same where a thing was measured once or is exact."""

    median: float
    q1: float
    q3: float
    runs: int | None = None
    quartiles: bool = True  # False: least and largest, or what 95 % of time steps stay below, stand for them

    @classmethod
    def read(cls, known: Json | None) -> Spread | None:
        """From median, q1 and q3; from least and largest where there are no quartiles, as in a report.

        Time steps come with what 95 % of them stay below instead. None without a median.
        """
        if not known or known.get("median") is None:
            return None
        median = float(known["median"])
        low, high = known.get("q1", known.get("min")), known.get("q3", known.get("p95", known.get("max")))
        q1, q3 = (median if end is None else float(end) for end in (low, high))
        return cls(median, q1, q3, known.get("runs"), known.get("q1") is not None)

    @classmethod
    def exact(cls, value: float) -> Spread:
        """Of what is known without noise."""
        return cls(value, value, value)

    def apart(self, other: Spread) -> bool:
        """Whether the quartile intervals do not meet: the difference is more than noise."""
        return self.q3 < other.q1 or other.q3 < self.q1

    def entries(self) -> Mapping[str, float]:
        """Without what it rests on."""
        return {"median": self.median, "q1": self.q1, "q3": self.q3}


@dataclass(frozen=True)
class Cost:
    """What timing a configuration found; all empty where it was not timed."""

    cpu_s: Spread | None = None
    wall_s: Spread | None = None
    step_s: Spread | None = None
    step_cpu_s: Spread | None = None
    setup_s: Spread | None = None
    frame_s: float | None = None  # s of what must fit a frame
    memory_bytes: float | None = None
    phases: Mapping[str, float] = field(default_factory=dict)  # s of each part, those above zero
    flags: tuple[str, ...] = ()
    excluded_runs: int = 0
    contaminated: bool = False  # something else ran meanwhile

    @classmethod
    def from_json(cls, known: Json | None) -> Cost:
        """As `quality.cost` makes it; nothing gives what was not timed."""
        if not known:
            return UNTIMED
        return cls(
            **{name: Spread.read(known.get(name)) for name in SPREADS},
            frame_s=known.get("frame_s"), memory_bytes=known.get("memory_bytes"),
            phases={str(n): float(s) for n, s in (known.get("phases") or {}).items() if s and s > 0},
            flags=tuple(map(str, known.get("flags") or ())),
            excluded_runs=int(known.get("excluded_runs") or 0), contaminated=bool(known.get("contaminated")),
        )  # fmt: skip

    def spread(self, clock: str) -> Spread | None:
        """The seconds of one of SPREADS."""
        found: Spread | None = getattr(self, clock)
        return found

    @property
    def most(self) -> bool:
        """Whether its times are upper bounds."""
        return WHOLE in self.flags

    @property
    def runs(self) -> int | None:
        """How many runs its times rest on."""
        solution = self.cpu_s or self.wall_s
        return solution.runs if solution else None

    @cached_property
    def frame(self) -> Spread | None:
        """Seconds of what must fit a frame, with the spread of the clock that they were taken from."""
        if not self.frame_s:
            return None
        known = [s for s in (self.step_s, self.step_cpu_s, self.wall_s, self.cpu_s) if s is not None]
        own = next((s for s in known if abs(s.median - self.frame_s) <= 1e-6 * self.frame_s), None)
        if own is None and known and known[0].median > 0:  # the spread of its likest clock, in proportion
            k = self.frame_s / known[0].median
            own = Spread(float(self.frame_s), k * known[0].q1, k * known[0].q3)
        return own or Spread.exact(float(self.frame_s))


UNTIMED = Cost()


# ------------------------------------------------------------------ what came of it


NOT_MEASURED = PointError()


@dataclass(frozen=True)
class Fineness(Plain):
    """How finely a configuration was solved (see `resolution_of`, which makes it)."""

    of: Mapping[str, float] = field(default_factory=dict)  # size, segments and step, as far as it has them
    formal: Mapping[str, float] = field(default_factory=dict)  # the order in displacements that theory gives each
    problem: str = ""  # a digest of all else
    meshed: bool = False  # the number of elements is that of its own mesh
    counts: Sequence[int] | None = None  # cells along each direction


@dataclass(frozen=True)
class ReducedFrom(Plain):
    """What a reduced model says of itself."""

    READ: ClassVar = {"extrapolates": tuple}

    of: str  # the model that it is made from
    repeats: bool = False  # it was trained in the very state that it is judged in
    extrapolates: tuple[str, ...] = ()  # what is outside of its training
    full_residual: float | None = None  # the part of the load that is not balanced in the equations of the full model


# ------------------------------------------------------------------ a point


@dataclass(frozen=True)
class ComparedPoint:
    """One configuration: one model of one scene at one value of everything that is varied, and what came of it."""

    key: str
    scene: str
    model: str
    label: str
    study: str | None
    variation: Mapping[str, str]
    numbers: Mapping[str, float]  # of the variation, those values that are numbers, SI
    problem: Mapping[str, str]  # of the variation, what changes what errors are measured from
    status: str
    message: str | None
    outline: str
    nodes: int | None
    elements: int | None
    dofs: int | None
    iterations: int | None
    linear_solver: str | None
    reduced: ReducedFrom | None
    errors: Mapping[str, PointError]
    probes: Mapping[str, ProbeTrace]
    warnings: tuple[PointWarning, ...]
    fineness: Fineness | None
    cost: Cost

    @classmethod
    def from_json(cls, found: Json) -> ComparedPoint:
        """From a point of `softmark-compare/1`."""
        size, solve, fineness = found.get("size") or {}, found.get("solve") or {}, found.get("resolution")
        return cls(
            key=str(found.get("key")), scene=str(found.get("scene")), model=str(found.get("model")),
            label=str(found.get("label") or found.get("model") or found.get("key")), study=found.get("study"),
            variation=_texts(found.get("variation")), numbers=found.get("numbers") or {},
            problem=_texts(found.get("problem")), status=str(found.get("status")), message=found.get("message"),
            outline=str(found.get("outline") or ""), nodes=size.get("nodes"), elements=size.get("elements"),
            dofs=size.get("dofs"), iterations=solve.get("iterations"), linear_solver=solve.get("linear_solver"),
            reduced=ReducedFrom.from_json(reduced) if (reduced := solve.get("reduced")) else None,
            errors=by_name(PointError.from_json)(found.get("errors") or {}),
            probes=by_name(ProbeTrace.from_json)(found.get("probes") or {}),
            warnings=several(PointWarning.from_json)(found.get("warnings") or ()),
            fineness=Fineness.from_json(fineness) if fineness else None, cost=Cost.from_json(found.get("cost")),
        )  # fmt: skip

    @property
    def solved(self) -> bool:
        """Whether it has a solution."""
        return self.status in ANSWERED

    @property
    def inverted(self) -> bool:
        """Return whether the solution has inverted cells."""
        return any(warning.code in INVERTED for warning in self.warnings)

    @property
    def timed(self) -> bool:
        """Whether it was timed."""
        return self.cost is not UNTIMED

    @property
    def part(self) -> str:
        """What it competes in: its scene, at one value of everything that changes what errors are measured from."""
        return part_of(self.scene, self.problem)

    def metric(self, name: str) -> PointError:
        """What a metric gave."""
        return self.errors.get(name, NOT_MEASURED)

    def error(self, metric: str) -> float | None:
        """The size of an error; None where there is none."""
        value = self.metric(metric).value
        return None if value is None else abs(float(value))

    def within(self, metric: str, largest: float) -> bool:
        """Whether an error is below what the reference leaves open: where this point lies, or at most `largest`."""
        error, own = self.error(metric), self.uncertainty(metric)
        return error is not None and error < (largest if own is None else own)

    def uncertainty(self, metric: str) -> float | None:
        """What the reference leaves open of an error, in its unit; None where nobody says."""
        own = self.metric(metric).uncertainty
        return None if own is None else abs(float(own))

    def effort(self, clock: str) -> Spread | None:
        """Seconds, or the number of unknowns; None where it is not known."""
        if clock == UNKNOWNS:  # a reduced model has a handful, whose equations may cost as much as those of the full
            return Spread.exact(float(self.dofs)) if self.dofs and self.reduced is None else None
        found = self.cost.spread(clock)
        return found if found is not None and found.median > 0 else None

    def rest(self, varied: str | None) -> tuple[tuple[str, str], ...]:
        """What is varied besides."""
        return tuple((name, text) for name, text in self.variation.items() if name != varied)


def _texts(found: Json | None) -> dict[str, str]:
    return {str(name): str(text) for name, text in (found or {}).items()}


def part_of(scene: str, problem: Mapping[str, str]) -> str:
    """`beam, E = 30 kPa`: what a configuration competes in."""
    return ", ".join((scene, *(f"{name} = {text}" for name, text in problem.items())))


def said_values(model: str, values: Mapping[str, str]) -> list[str]:
    """`h = 5 mm` for each value; a field of the model itself without the name of the model."""
    return [f"{name.removeprefix(f'{model}.')} = {text}" for name, text in values.items()]


def ratio_of(a: float | None, b: float | None) -> float | None:
    """a / b; None where there is none, as for a b of zero or next to it."""
    if a is None or not b:
        return None
    found = a / b
    return found if math.isfinite(found) else None


# ------------------------------------------------------------------ what several points say


def clock_of(points: Sequence[ComparedPoint], asked: str | None = None) -> str:
    """The effort that points are compared by: what was asked for, else CPU time; unknowns where nothing was timed."""
    return asked or next((clock for clock in CLOCKS if any(p.cost.spread(clock) for p in points)), UNKNOWNS)


def error_metrics(points: Iterable[ComparedPoint]) -> list[str]:
    """Metrics that measure from something, in the order in which they come."""
    return list(dict.fromkeys(n for p in points for n, found in p.errors.items() if found.against is not None))


def uncertainty_of(points: Iterable[ComparedPoint], metric: str) -> float:
    """What the reference leaves open, in the metric's unit: the largest that a point states; 0 if none does."""
    return max((u for p in points if (u := p.uncertainty(metric)) is not None), default=0.0)


def unit_of(points: Iterable[ComparedPoint], metric: str) -> str | None:
    """The unit of a metric, as the first point that has it says."""
    return next((unit for p in points if (unit := p.metric(metric).unit) is not None), None)


def against_of(points: Iterable[ComparedPoint], metric: str) -> str | None:
    """What a metric measures from, as the first point that has it says."""
    return next((name for p in points if (name := p.metric(metric).against) is not None), None)
