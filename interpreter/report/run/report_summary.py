"""Conclusions drawn from a report: error metrics, models closest to each reference, and summary sentence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property

import numpy as np

from softmark.interpreter.language.number_formatting import format_quantity
from softmark.interpreter.report.page.html_markup import count, join_names
from softmark.interpreter.results.declarations import DeclaredName
from softmark.interpreter.results.run_report import ModelResult, ProbeResult, ReferenceResult, Report
from softmark.interpreter.results.state_results import ANSWERED, LEFT_OUT, format_state
from softmark.records import dataclass

Result = ModelResult | ReferenceResult
UNKNOWN = DeclaredName("")


@dataclass(frozen=True)
class MetricColumn:
    """Metric as a column of the results table; `against` is the reference of an error, None for a measurement."""

    name: str
    unit: str
    probe: str | None = None
    against: str | None = None
    summary: str = ""
    line: int | None = None
    model: str | None = None  # model from which the metric is a difference, if it is not a reference
    part: str = ""  # `the quarter of layer that is modelled`, if the metric refers to a part of the body
    clock: bool = False  # true for real-time metrics, whose verdict matters and not the number

    @property
    def is_error(self) -> bool:
        """True if the metric is an error, so that smaller values are better."""
        return self.against is not None

    @property
    def percent(self) -> bool:
        """True if dimensionless values of the metric are shown as percentages."""
        return self.is_error or self.clock or self.model is not None


@dataclass(frozen=True)
class ReportSummary:
    """Report together with the conclusions drawn from it."""

    report: Report

    @property
    def declared(self) -> Mapping[str, DeclaredName]:
        """Declarations in the text of the scene, by name."""
        return self.report.names.declared

    @cached_property
    def lines(self) -> range:
        """Line numbers of the text of the scene."""
        return range(1, len(str(self.report.scene.get("text", "")).splitlines()) + 1)

    def line(self, name: str) -> int | None:
        """Return the line number where a name is declared, or None if the text of the scene is not known."""
        line = self.declared.get(name, UNKNOWN).line
        return line if line in self.lines else None

    @cached_property
    def all_results(self) -> dict[str, Result]:
        """Results of all models, then of all references, by name."""
        return {**self.report.models, **self.report.references}

    @cached_property
    def moved(self) -> float:
        """Largest absolute value of all probe displacements and length metrics, m, as the scale of rounding errors."""
        found = [0.0]
        for result in self.all_results.values():
            found += [abs(m.value) for m in result.metrics.values() if m.unit == "m" and m.value is not None]
            for probe in result.probes.values():
                u = probe.displacement[np.isfinite(probe.displacement)]
                found.append(float(np.abs(u).max(initial=0.0)))
        return max(found)

    @cached_property
    def metrics(self) -> tuple[MetricColumn, ...]:
        """Metrics with at least one value, in the order of the scene."""
        found = {name: m.unit for r in self.all_results.values() for name, m in r.metrics.items()}
        order = {name: i for i, name in enumerate(self.declared)}
        names = sorted(found, key=lambda name: order.get(name, len(order)))
        return tuple(self._metric_column(name, found[name]) for name in names)

    def _metric_column(self, name: str, unit: str) -> MetricColumn:
        clock = any("verdict" in r.metrics[name].details for r in self.all_results.values() if name in r.metrics)
        known = self.declared.get(name, UNKNOWN)
        against, line = known.against, self.line(name)
        measured = against if against in self.report.references else None
        computed = against if against in self.report.models else None
        return MetricColumn(
            name, unit, known.probe, measured, known.summary, line, computed, known.part, clock
        )  # fmt: skip

    @cached_property
    def errors(self) -> tuple[MetricColumn, ...]:
        """Metrics that measure an error against a reference."""
        return tuple(m for m in self.metrics if m.is_error)

    @cached_property
    def ranked_error_metrics(self) -> tuple[MetricColumn, ...]:
        """Error metrics by importance: first those that expectations use.

        Expectations show what the scene is about. The other metrics follow in the order of the scene.
        """
        order = {name: i for i, name in enumerate(self.report.names.expected)}
        return tuple(sorted(self.errors, key=lambda m: order.get(m.name, len(order))))

    def best(self, metric: MetricColumn) -> tuple[str, ...]:
        """Return the models with the smallest value of an error metric.

        Models whose difference from it is below the uncertainty of the reference are included.
        """
        values = {n: v for n, m in self.report.models.items() if (v := value_of(m, metric.name)) is not None}
        least = min(values.values(), default=0.0)
        within = least + self.uncertainty(metric)
        return tuple(n for n, v in values.items() if v <= within) if metric.is_error else ()

    def uncertainty(self, metric: MetricColumn) -> float:
        """Return the smallest meaningful difference of a metric, the uncertainty of its reference, in its unit."""
        found = (m.metrics.get(metric.name) for m in self.report.models.values())
        return max((m.uncertainty for m in found if m is not None and m.uncertainty), default=0.0)

    def tied(self, metric: MetricColumn) -> bool:
        """Return whether several models are best, because the uncertainty cannot distinguish their errors."""
        values = {value_of(self.report.models[n], metric.name) for n in self.best(metric)}
        return len(values) > 1

    @cached_property
    def probes(self) -> dict[str, dict[str, ProbeResult]]:
        """Results at each probe, by the name of the model or reference."""
        found: dict[str, dict[str, ProbeResult]] = {}
        for name, result in self.all_results.items():
            for probe, seen in result.probes.items():
                found.setdefault(probe, {})[name] = seen
        return found

    @cached_property
    def unsolved(self) -> dict[str, Result]:
        """Models and references that were attempted but have no solution."""
        return {n: r for n, r in self.all_results.items() if r.status not in (*ANSWERED, *LEFT_OUT)}

    # -------------------------------------------------------------- sentences

    @property
    def last_state_phrase(self) -> str:
        """Phrase such as ` in the last state, 18.25 %`, added to numbers; empty for a scene without states."""
        last = next((r.states[-1] for r in self.all_results.values() if r.states), None)
        return "" if last is None else f" in the last state, {format_state(last)}"

    @property
    def conclusion(self) -> str:
        """Summary sentence: number of models, models closest to the first reference, and outcome of expectations."""
        parts = [
            self._model_count_phrase(),
            *self._unsolved_phrases(),
            *self._closest_to_first_phrases(),
            self._expectation_phrase(),
        ]
        return "; ".join(part for part in parts if part) + "."

    def _model_count_phrase(self) -> str:
        references = count(len(self.report.references), "reference")
        if not self.report.models:
            return "No model was run" + (f", only {references}" if self.report.references else "")
        states = max(len(m.states) for m in self.report.models.values())
        models = count(len(self.report.models), "model") + (f" in {count(states, 'state')}" if states else "")
        models += " so far" if self.report.partial else ""
        return models + (f" against {references}" if self.report.references else ", no reference")

    def _unsolved_phrases(self) -> Iterator[str]:
        """Yield phrases such as `2 of 4 models gave no solution (`a`, `b`)`, for models and for references."""
        for results, noun in ((self.report.models, "model"), (self.report.references, "reference")):
            lost = [f"`{n}`" for n in results if n in self.unsolved]
            if lost:
                shown = [*lost[:3], f"{len(lost) - 3} more"] if len(lost) > 4 else lost
                whole = count(len(results), noun)
                yield f"{len(lost)} of {whole} gave no solution ({join_names(shown)})"

    def _closest_to_first_phrases(self) -> Iterator[str]:
        """Yield phrases on the models closest to the first reference, and to the first measurement."""
        where = f"{self.last_state_phrase.strip()}, " if self.last_state_phrase else ""
        said = [where + words for words in self.closest()]
        known = list(dict.fromkeys(str(m.against) for m in self.ranked_error_metrics if self.best(m)))
        measured = (i for i, n in enumerate(known) if self.report.references[n].kind == "measurement")
        chosen = dict.fromkeys([0, next(measured, 0)])
        yield from (said[i] for i in chosen if i < len(said))

    def closest(self, probe: str | None = None) -> list[str]:
        """Return a phrase for each reference: `the closest to theory is rod: 5.9 % (eta), ...`.

        It uses the most important metric of the reference. With `probe`, only metrics at that probe count.
        """
        said: dict[str, str] = {}
        for metric in self.ranked_error_metrics:
            if probe is not None and metric.probe != probe:
                continue
            if metric.against in said or not (best := self.best(metric)):
                continue
            amount = self._smallest_error_text(metric, best)
            who = ("is " if len(best) == 1 else "are ") + join_names([f"`{n}`" for n in best])
            last = self._farthest_model_phrase(metric, best)
            said[str(metric.against)] = f"the closest to `{metric.against}` {who}: {amount} (`{metric.name}`){last}"
        return list(said.values())

    def _farthest_model_phrase(self, metric: MetricColumn, best: tuple[str, ...]) -> str:
        """Return `, the farthest is linear_tet: 47 %`, which puts the smallest error into perspective."""
        values = {n: v for n, m in self.report.models.items() if (v := value_of(m, metric.name)) is not None}
        worst = max(values, key=lambda n: values[n])
        if worst in best:
            return ""
        return f", the farthest is `{worst}`: {format_quantity(values[worst], metric.unit, digits=2, percent=True)}"

    def _smallest_error_text(self, metric: MetricColumn, best: tuple[str, ...]) -> str:
        """Return the smallest error as text, or the uncertainty below which several models cannot be distinguished."""
        if self.tied(metric):
            return f"no difference above ± {format_quantity(self.uncertainty(metric), metric.unit, 2, percent=True)}"
        value = value_of(self.report.models[best[0]], metric.name)
        return format_quantity(value or 0.0, metric.unit, digits=2, percent=True)

    def _expectation_phrase(self) -> str:
        judged = self.report.expectations
        if not judged:
            return "expectations are not yet judged" if self.report.partial else "no expectations"
        met, open_ = sum(e.passed is True for e in judged), sum(e.passed is None for e in judged)
        rest = f", {open_} not judged" if open_ else ""
        return f"{met} of {count(len(judged), 'expectation')} met{rest}"

    @property
    def status(self) -> tuple[str, str]:
        """Overall outcome: `good`, `warn` or `bad`, and a line of words."""
        if self.report.partial:
            return "warn", "Unfinished: the run is in progress or was interrupted"
        if self.unsolved:
            return "bad", f"Finished, without a solution for {join_names([f'`{n}`' for n in self.unsolved])}"
        missed = sum(e.passed is False for e in self.report.expectations)
        if missed:
            return "bad", f"Finished, {count(missed, 'expectation')} not met"
        if not self.report.models:
            return "warn", "Finished, no model was run"
        if inverted := [f"`{n}`" for n, m in self.report.models.items() if m.inverted]:
            return "bad", f"Finished, with inverted cells in {join_names(inverted)}: not a physical state"
        ran = (
            "everything that was run" if any(r.status in LEFT_OUT for r in self.all_results.values()) else "everything"
        )
        return "good", f"Finished, {ran} converged" + (
            ", every expectation met" if self._has_met_all_expectations else ""
        )

    @property
    def _has_met_all_expectations(self) -> bool:
        return bool(self.report.expectations) and all(e.passed for e in self.report.expectations)


def value_of(result: Result, metric: str) -> float | None:
    """Return the value of a metric, None if there is none."""
    found = result.metrics.get(metric)
    return None if found is None or found.value is None else float(found.value)


def kind_of_reference(reference: ReferenceResult) -> str:
    """Return the kind of a reference: `consensus of 3 codes`."""
    codes = reference.facts.get("codes")
    return f"{reference.kind} of {codes} codes" if codes else reference.about
