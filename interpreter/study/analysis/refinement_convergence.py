"""Convergence under refinement: orders of errors, limits of displacements, and whether both are reliable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import takewhile

from softmark.interpreter.results.json_records import JsonRecord
from softmark.interpreter.study.analysis.comparison_point import ComparedPoint, Fineness, uncertainty_of, unit_of
from softmark.interpreter.study.analysis.refinement_lines import RefinementLine
from softmark.records import dataclass
from softmark.references.convergence_orders import (
    ConvergenceEstimate,
    ErrorOrder,
    estimate_convergence,
    find_dissimilarity,
    order_of_errors,
)

AXES = "xyz"
TARGETS = ("size", "segments", "step")  # fields that control the resolution


@dataclass(frozen=True)
class Refinement:
    """Solved configurations of a refinement line that differ only in their resolution."""

    target: str  # size, segments or step
    formal: float | None  # theoretical order of displacements
    members: list[tuple[float, ComparedPoint]]  # (h, point) from coarse to fine, with the size h in any unit
    unlike: str | None  # reason why the meshes are not geometrically similar, or None


@dataclass(frozen=True)
class ErrorTrend(JsonRecord):
    """Order of convergence of an error metric along a refinement line.

    `cut` is true if errors below the uncertainty of the reference were omitted.
    """

    unit: str | None
    cut: bool
    order: ErrorOrder

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries of the trend and of its convergence order."""
        return {"unit": self.unit, "cut": self.cut, **self.order.to_json()}


@dataclass(frozen=True)
class Limit(JsonRecord):
    """Limit under refinement of a displacement, m, or of a metric, in its unit.

    For a probe it is the limit of the largest displacement component. Metrics are used for lines without common probes,
    and for quantities such as forces.
    """

    of: str
    kind: str  # probe or metric
    what: str
    unit: str | None
    finest: float | None
    refined: ConvergenceEstimate

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries, with those of the estimated limit."""
        own = {self.kind: self.of, "what": self.what, "unit": self.unit}
        return {**own, "finest": self.finest, **self.refined.to_json()}

    @property
    def doubt(self) -> str | None:
        """Reason why the limit is unreliable; None if it is reliable.

        For a metric the text begins with the name of the metric.
        """
        if self.refined.asymptotic:
            return None
        why = str(self.refined.doubt or self.refined.reason)
        return f"of `{self.of}` itself: {why}" if self.kind == "metric" else why


@dataclass(frozen=True)
class LineOrders(JsonRecord):
    """Convergence orders of all error metrics, and limits, along a refinement line.

    `doubt` is the reason if they are unreliable, else None.
    """

    line: RefinementLine
    refinement: Refinement
    doubt: str | None
    errors: Mapping[str, ErrorTrend]
    limits: list[Limit]

    @property
    def asymptotic(self) -> bool:
        """True if the observed convergence orders are reliable, because no doubt about them was found."""
        return self.doubt is None

    def doubt_of(self, metric: str) -> str | None:
        """Return the reason why the order of one metric is unreliable, or None.

        If the metric has a limit of its own, as forces do, the reason comes from that limit, otherwise from the whole
        line.
        """
        own = [limit for limit in self.limits if limit.kind == "metric"]
        return next((limit.doubt for limit in own if limit.of == metric), self.doubt)

    def entries(self) -> Mapping[str, object]:
        """Return the JSON entries, including the refinement line and the name of its refined number."""
        return {
            "line": self.line.name, "model": self.line.model, "study": self.line.study, "varied": self.line.varied,
            "refines": self.refinement.target, "formal": self.refinement.formal,
            "asymptotic": self.asymptotic, "doubt": self.doubt, "reason": None,
            "members": len(self.refinement.members), "errors": self.errors, "limits": self.limits,
        }  # fmt: skip


def orders_of(line: RefinementLine, metrics: Sequence[str], points: Sequence[ComparedPoint]) -> LineOrders | None:
    """Return the convergence orders and limits of a refinement line.

    Return None if the line has only one configuration, or if its number does not only control the resolution.
    """
    found = refinement_of(line)
    if isinstance(found, str):
        return None
    probes = [_displacement_limit(found, probe) for probe in _common_probes([p for _, p in found.members])]
    alone = [m for m in metrics if not probes or any(p.metric(m).by_itself for _, p in found.members)]
    values = {m: _metric_limit(found, m) for m in alone}
    limits = probes or [own for own in values.values() if own is not None]
    nothing = [] if limits else ["its configurations have no common probe or metric"]
    doubt = next(iter([*nothing, *(d for limit in limits if (d := limit.doubt) is not None)]), None)
    limits = [*probes, *(own or _missing_limit(m) for m, own in values.items())] if probes else limits
    return LineOrders(line, found, doubt, {m: _error_trend(found.members, m, points) for m in metrics}, limits)


def refinement_of(line: RefinementLine) -> Refinement | str:
    """Return the refinement that a line describes, or the reason why it is not a refinement.

    The varied number must control only a cell size, a number of segments, or a time step.
    """
    if line.varied is None:
        return "one configuration gives no order"
    solved = [(p, p.fineness) for p in line.members if p.solved and p.fineness]
    if not solved:
        return "none of its configurations has a solution"
    if len({fine.problem for _, fine in solved}) > 1:
        return f"`{line.varied}` changes the problem, not the discretisation"
    decided = [t for t in TARGETS if len({fine.of.get(t) for _, fine in solved}) > 1]
    if len(decided) != 1:
        what = "neither size, segments nor step" if not decided else f"{' and '.join(decided)} at once"
        return f"`{line.varied}` decides {what}"
    return _refinement(decided[0], solved)


def _refinement(target: str, solved: Sequence[tuple[ComparedPoint, Fineness]]) -> Refinement:
    formal = {fine.formal.get(target) for _, fine in solved}
    by_h = {
        _representative_size(target, p, fine): (p, fine) for p, fine in solved
    }  # of two with the same mesh, the last
    rows = sorted(by_h.items(), key=lambda row: -row[0])
    counts = [fine.counts for _, (_, fine) in rows if fine.counts]
    why = find_dissimilarity(counts) if target == "size" and len(counts) == len(rows) else None
    return Refinement(target, formal.pop() if len(formal) == 1 else None, [(h, p) for h, (p, _) in rows], why)


def _representative_size(target: str, point: ComparedPoint, fine: Fineness) -> float:
    """Return the time step, segment length or cell size, up to a constant factor.

    The cell size is (V / N)^(1/3) with the volume V and the number of cells N.
    Source: ASME V&V 20-2009.
    """
    if target == "size" and fine.meshed and point.elements:
        return float(point.elements ** (-1 / 3))
    value = float(fine.of[target])
    return 1.0 / value if target == "segments" else value


def _error_trend(
    members: Sequence[tuple[float, ComparedPoint]], metric: str, points: Sequence[ComparedPoint]
) -> ErrorTrend:
    floor = uncertainty_of(points, metric)
    family = [(h, e) for h, p in members if (e := p.error(metric)) is not None]
    above = list(takewhile(lambda pair: pair[1] > floor, family))
    found, cut = order_of_errors(above, floor), len(above) < len(family)
    if cut and found.reason is not None:
        why = "its errors are below the uncertainty of the reference" if floor else "its error is zero"
        found = replace(found, reason=why)
    return ErrorTrend(unit_of(points, metric), cut, found)


def _common_probes(members: Sequence[ComparedPoint]) -> list[str]:
    """Return the names of the probes that have the same points in all configurations."""
    first, *others = (p.probes for p in members)
    return [
        n for n, probe in first.items() if all(n in own and probe.has_same_points(own[n]) for own in (first, *others))
    ]


def _displacement_limit(line: Refinement, probe: str) -> Limit:
    """Return the limit of the displacement component, m, that is largest on the finest mesh.

    The limit comes with its order and its grid convergence index.
    """
    finest = line.members[-1][1].probes[probe].displacement
    i, axis = max(
        ((i, a) for i in range(len(finest)) for a in range(3)),
        key=lambda place: abs(finest[place[0]][place[1]]),
    )
    family = [(h, float(p.probes[probe].displacement[i][axis])) for h, p in line.members]
    what = f"displacement along {AXES[axis]} of the point with the largest displacement"
    return Limit(probe, "probe", what, "m", family[-1][1], estimate_limit(line, family, line.formal))


def _metric_limit(line: Refinement, metric: str) -> Limit | None:
    """Return the limit of the value of a metric, or None if some configurations have no value.

    No theoretical order is assumed, because theory gives orders only for displacements.
    """
    family = [(h, float(v)) for h, p in line.members if (v := p.metric(metric).value) is not None]
    if len(family) < len(line.members):
        return None
    unit = unit_of([p for _, p in line.members], metric)
    return Limit(metric, "metric", "value", unit, family[-1][1], estimate_limit(line, family, None))


def _missing_limit(metric: str) -> Limit:
    """Return a limit without a value, for a metric that some configurations of the refinement line do not have."""
    return Limit(
        metric,
        "metric",
        "value",
        None,
        None,
        ConvergenceEstimate("unusable", "only some of its configurations have it"),
    )


def estimate_limit(
    line: Refinement, family: Sequence[tuple[float, float]], formal: float | None
) -> ConvergenceEstimate:
    """Estimate the limit of a family of values (h, value) under refinement.

    If the meshes are not geometrically similar, the estimate is marked as unreliable.
    """
    found = estimate_convergence(family, formal)
    if line.unlike is None or found.order is None:
        return found
    doubt = line.unlike if found.doubt is None else f"{found.doubt}; {line.unlike}"
    return replace(found, asymptotic=False, doubt=doubt)
