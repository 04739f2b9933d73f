"""Results of one configuration of a comparison (a point): effort, errors, displacements and resolution.

A point is read only by `ComparedPoint.from_json`, from the JSON of a task, of a journal or of a saved
`softmark-compare/1`. Entries that older versions did not write have defaults. This module computes no error or
time.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from functools import cached_property
from typing import ClassVar

from softmark.interpreter.results.json_records import Json, JsonRecord, list_reader, mapping_reader
from softmark.interpreter.results.state_results import ANSWERED
from softmark.interpreter.study.analysis.timing_quality import WHOLE
from softmark.interpreter.study.configurations.task_outcome import PointError, PointWarning, ProbeTrace
from softmark.records import dataclass

READ = "read"  # read from a file, without our own timing
CLOCKS = ("cpu_s", "wall_s")
UNKNOWNS = "unknowns"  # the effort where nothing was timed
INVERTED = ("W324", "W351")  # warnings about inverted cells of a solution
INSIDE_OUT = "its cells are inverted"
SPREADS = (*CLOCKS, "step_s", "step_cpu_s", "setup_s")


# ------------------------------------------------------------------ effort


@dataclass(frozen=True)
class Spread(JsonRecord):
    """Median with its quartiles; all three are equal for a single measurement or an exact value."""

    median: float
    q1: float
    q3: float
    runs: int | None = None
    quartiles: bool = True  # False: minimum and maximum, or the 95 % quantile of time steps, replace them

    @classmethod
    def read(cls, known: Json | None) -> Spread | None:
        """Read median and quartiles from JSON; return None if there is no median.

        If there are no quartiles, the minimum replaces the first. The 95 % quantile, or else the maximum, replaces the
        third.
        """
        if not known or known.get("median") is None:
            return None
        median = float(known["median"])
        low, high = known.get("q1", known.get("min")), known.get("q3", known.get("p95", known.get("max")))
        q1, q3 = (median if end is None else float(end) for end in (low, high))
        return cls(median, q1, q3, known.get("runs"), known.get("q1") is not None)

    @classmethod
    def exact(cls, value: float) -> Spread:
        """Return the spread of an exactly known value: median and quartiles are equal to it."""
        return cls(value, value, value)

    def is_distinct_from(self, other: Spread) -> bool:
        """Return whether the quartile intervals are disjoint, so that the difference is larger than the noise."""
        return self.q3 < other.q1 or other.q3 < self.q1

    def entries(self) -> Mapping[str, float]:
        """Return the JSON entries: median and both quartiles."""
        return {"median": self.median, "q1": self.q1, "q3": self.q3}


@dataclass(frozen=True)
class Cost:
    """Times and memory of a configuration; all fields are empty if it was not timed."""

    cpu_s: Spread | None = None
    wall_s: Spread | None = None
    step_s: Spread | None = None
    step_cpu_s: Spread | None = None
    setup_s: Spread | None = None
    frame_s: float | None = None  # time that must fit into one frame, s
    memory_bytes: float | None = None
    phases: Mapping[str, float] = field(default_factory=dict)  # CPU time of each phase, s, if above zero
    flags: tuple[str, ...] = ()
    excluded_runs: int = 0
    contaminated: bool = False  # timing was disturbed by other processes

    @classmethod
    def from_json(cls, known: Json | None) -> Cost:
        """Read the JSON that `timing_quality` writes; missing values become None."""
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
        """Return the time that a clock measured, s, with its quartiles; the clock is one of the names in SPREADS."""
        found: Spread | None = getattr(self, clock)
        return found

    @property
    def is_upper_bound(self) -> bool:
        """True if the times are only upper bounds, because they include a whole external process."""
        return WHOLE in self.flags

    @property
    def runs(self) -> int | None:
        """Number of runs from which the times were computed."""
        solution = self.cpu_s or self.wall_s
        return solution.runs if solution else None

    @cached_property
    def frame(self) -> Spread | None:
        """Computing time that must fit into one frame for real time, s, as median and quartiles.

        The quartiles are those of the clock that measured it, or of the most similar clock.
        """
        if not self.frame_s:
            return None
        known = [s for s in (self.step_s, self.step_cpu_s, self.wall_s, self.cpu_s) if s is not None]
        own = next((s for s in known if abs(s.median - self.frame_s) <= 1e-6 * self.frame_s), None)
        if own is None and known and known[0].median > 0:  # scaled from the most similar clock
            k = self.frame_s / known[0].median
            own = Spread(float(self.frame_s), k * known[0].q1, k * known[0].q3)
        return own or Spread.exact(float(self.frame_s))


UNTIMED = Cost()


# ------------------------------------------------------------------ parts of a result


NOT_MEASURED = PointError()


@dataclass(frozen=True)
class Fineness(JsonRecord):
    """Resolution of a configuration: cell size, number of segments and time step, with their theoretical orders."""

    of: Mapping[str, float] = field(default_factory=dict)  # size, segments and step, if the model has them
    formal: Mapping[str, float] = field(default_factory=dict)  # theoretical order of displacements for each
    problem: str = ""  # digest of everything except the resolution
    meshed: bool = False  # True if the number of elements is that of the model's own mesh
    counts: Sequence[int] | None = None  # cells along each direction


@dataclass(frozen=True)
class ReducedFrom(JsonRecord):
    """Origin of a reduced model: the full model that it was trained on, and the quality of the training."""

    READ: ClassVar = {"extrapolates": tuple}

    of: str  # full model from which it was reduced
    repeats: bool = False  # trained in the same state in which it is judged
    extrapolates: tuple[str, ...] = ()  # values outside its training range
    full_residual: float | None = None  # fraction of the load not balanced in the full model's equations


# ------------------------------------------------------------------ a point


@dataclass(frozen=True)
class ComparedPoint:
    """Results of one configuration of a comparison: one model of a scene with one set of varied values."""

    key: str
    scene: str
    model: str
    label: str
    study: str | None
    variation: Mapping[str, str]
    numbers: Mapping[str, float]  # numeric values of the variation, SI
    problem: Mapping[str, str]  # values of the variation that change the reference
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
        """Read the results of a configuration from an entry of `softmark-compare/1`."""
        size, solve, fineness = found.get("size") or {}, found.get("solve") or {}, found.get("resolution")
        return cls(
            key=str(found.get("key")), scene=str(found.get("scene")), model=str(found.get("model")),
            label=str(found.get("label") or found.get("model") or found.get("key")), study=found.get("study"),
            variation=_texts(found.get("variation")), numbers=found.get("numbers") or {},
            problem=_texts(found.get("problem")), status=str(found.get("status")), message=found.get("message"),
            outline=str(found.get("outline") or ""), nodes=size.get("nodes"), elements=size.get("elements"),
            dofs=size.get("dofs"), iterations=solve.get("iterations"), linear_solver=solve.get("linear_solver"),
            reduced=ReducedFrom.from_json(reduced) if (reduced := solve.get("reduced")) else None,
            errors=mapping_reader(PointError.from_json)(found.get("errors") or {}),
            probes=mapping_reader(ProbeTrace.from_json)(found.get("probes") or {}),
            warnings=list_reader(PointWarning.from_json)(found.get("warnings") or ()),
            fineness=Fineness.from_json(fineness) if fineness else None, cost=Cost.from_json(found.get("cost")),
        )  # fmt: skip

    @property
    def solved(self) -> bool:
        """True if the configuration has a solution."""
        return self.status in ANSWERED

    @property
    def inverted(self) -> bool:
        """True if the solution has inverted cells."""
        return any(warning.code in INVERTED for warning in self.warnings)

    @property
    def timed(self) -> bool:
        """True if the configuration was timed."""
        return self.cost is not UNTIMED

    @property
    def part(self) -> str:
        """Name of the group of configurations with which this one is compared, such as `beam, E = 30 kPa`.

        Errors are comparable only within a group: its configurations have the same scene, and the same values of all
        varied quantities that change the reference.
        """
        return competition_group_name(self.scene, self.problem)

    def metric(self, name: str) -> PointError:
        """Return the result of a metric by its name."""
        return self.errors.get(name, NOT_MEASURED)

    def error(self, metric: str) -> float | None:
        """Return the magnitude of an error metric in its unit, or None if it has no value."""
        value = self.metric(metric).value
        return None if value is None else abs(float(value))

    def within(self, metric: str, largest: float) -> bool:
        """Return whether the error of a metric is below the uncertainty of its reference.

        If the configuration states no uncertainty, `largest` is used in its place.
        """
        error, own = self.error(metric), self.uncertainty(metric)
        return error is not None and error < (largest if own is None else own)

    def uncertainty(self, metric: str) -> float | None:
        """Return the uncertainty of the reference of an error metric, in the unit of the metric; None if not stated."""
        own = self.metric(metric).uncertainty
        return None if own is None else abs(float(own))

    def effort(self, clock: str) -> Spread | None:
        """Return the effort of the configuration: a time, s, or the number of unknowns; None if it is not known."""
        if clock == UNKNOWNS:  # a reduced model has few unknowns, whose equations may cost as much as the full model's
            return Spread.exact(float(self.dofs)) if self.dofs and self.reduced is None else None
        found = self.cost.spread(clock)
        return found if found is not None and found.median > 0 else None

    def other_values(self, varied: str | None) -> tuple[tuple[str, str], ...]:
        """Return the names and values of all varied quantities of this configuration, except the quantity `varied`."""
        return tuple((name, text) for name, text in self.variation.items() if name != varied)


def _texts(found: Json | None) -> dict[str, str]:
    return {str(name): str(text) for name, text in (found or {}).items()}


def competition_group_name(scene: str, problem: Mapping[str, str]) -> str:
    """Return the name of the group of comparable configurations, such as `beam, E = 30 kPa`.

    `problem` has the varied values that change the reference.
    """
    return ", ".join((scene, *(f"{name} = {text}" for name, text in problem.items())))


def format_values(model: str, values: Mapping[str, str]) -> list[str]:
    """Format varied values, such as `h = 5 mm`; the name of the model is omitted from names of its own fields."""
    return [f"{name.removeprefix(f'{model}.')} = {text}" for name, text in values.items()]


def ratio_of(a: float | None, b: float | None) -> float | None:
    """Return a / b, or None if it is undefined or not finite."""
    if a is None or not b:
        return None
    found = a / b
    return found if math.isfinite(found) else None


# ------------------------------------------------------------------ several points


def choose_effort_kind(points: Sequence[ComparedPoint], asked: str | None = None) -> str:
    """Return the kind of effort by which configurations are compared.

    It is the requested one, by default CPU time, or the number of unknowns if nothing was timed.
    """
    return asked or next((clock for clock in CLOCKS if any(p.cost.spread(clock) for p in points)), UNKNOWNS)


def error_metrics(points: Iterable[ComparedPoint]) -> list[str]:
    """Return the names of the metrics that measure an error against a reference, in order of appearance."""
    return list(dict.fromkeys(n for p in points for n, found in p.errors.items() if found.against is not None))


def uncertainty_of(points: Iterable[ComparedPoint], metric: str) -> float:
    """Return the largest stated uncertainty of a metric's reference, in the unit of the metric; 0 if none is stated."""
    return max((u for p in points if (u := p.uncertainty(metric)) is not None), default=0.0)


def unit_of(points: Iterable[ComparedPoint], metric: str) -> str | None:
    """Return the unit of a metric, from the first configuration that has this metric."""
    return next((unit for p in points if (unit := p.metric(metric).unit) is not None), None)


def reference_name_of_metric(points: Iterable[ComparedPoint], metric: str) -> str | None:
    """Return the name of the reference of a metric, from the first configuration that has this metric."""
    return next((name for p in points if (name := p.metric(metric).against) is not None), None)
