"""Conversion of a report to a pandas table: one row for each number, in SI."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from softmark.interpreter.api.optional_packages import import_extra
from softmark.interpreter.results.run_report import MetricResult, ModelResult, ReferenceResult, Report

if TYPE_CHECKING:
    from pandas import DataFrame

COLUMNS = {  # name of a column: its content; unknown values are None
    "model": "the name of the model, or of the reference",
    "kind": "`model`, or the kind of the reference",
    "metric": "the name of the metric",
    "state": "value of the state of the analysis; NaN if there are no states",
    "value": "in `unit`",
    "unit": "SI unit; 1 for a plain number",
    "stated_error": "error of the value as stated by the model, in `unit`",
    "reference": "reference of the metric",
    "uncertainty": "uncertainty of that reference, in `unit`",
    "published": "published value given in the scene, in `unit`",
    "verdict": "worst result of its expectations: `met`, `not_met` or `cannot_tell`",
    "status": "status of the model: `converged`, `not_converged`, ...",
    "reason": "reason why there is no value",
    "seconds": "wall time of the solution, s, median of its runs",
}
NUMBERS = ("state", "value", "stated_error", "uncertainty", "published", "seconds")
WORST = ("not_met", "cannot_tell", "met")

Row = dict[str, Any]


def frame(report: Report) -> DataFrame:
    """Return a report as a DataFrame with a row for each model or reference, metric and state. Raises MissingExtra."""
    pandas = import_extra("pandas", "report.frame()", "notebook")
    found: DataFrame = pandas.DataFrame(list(rows(report)), columns=list(COLUMNS))
    return found.astype(dict.fromkeys(NUMBERS, float))


def rows(report: Report) -> Iterator[Row]:
    """Yield the rows of the table as dicts with the keys COLUMNS.

    A model without metrics gets one row without a metric.
    """
    verdicts = _verdicts(report)
    for result in report.outcomes:
        for name in result.metrics or ((None,) if result.name in report.models else ()):
            own = _result_row(report, result, name) | {"verdict": verdicts.get((result.name, name))}
            yield from _rows_of_states(result, name, own)


def _result_row(report: Report, result: ModelResult | ReferenceResult, name: str | None) -> Row:
    row: Row = dict.fromkeys(COLUMNS) | {"model": result.name, "kind": "model", "status": result.status}
    if isinstance(result, ModelResult):
        clock = result.time.get("solve_s")
        row["seconds"] = None if clock is None else clock.median
    else:
        row["kind"] = result.kind
    if name is None:
        return row | {"reason": result.message}
    stated = result.stated.get(name) if isinstance(result, ModelResult) else None
    declared = report.names.declared.get(name)
    row |= {"metric": name, "stated_error": None if stated is None else stated.value}
    return row | _metric_columns(result.metrics[name]) | {"reference": None if declared is None else declared.against}


def _metric_columns(metric: MetricResult) -> Row:
    return {"value": metric.value, "unit": metric.unit, "uncertainty": metric.uncertainty,
            "published": metric.published, "reason": metric.reason}  # fmt: skip


def _rows_of_states(result: ModelResult | ReferenceResult, name: str | None, row: Row) -> Iterator[Row]:
    """Yield one row for each state, or a single row without states.

    The stated error is that of the last state, and the time that of the whole run.
    """
    if not result.states or name is None:
        yield row
        return
    each: tuple[Any, ...] = result.each
    for number, (state, own) in enumerate(zip(result.states, each, strict=True)):
        last = number == len(result.states) - 1
        metric = own.metrics.get(name)
        known = _metric_columns(metric) if metric is not None else {"value": None, "reason": own.message}
        yield row | known | {"state": float(state), "stated_error": row["stated_error"] if last else None}


def _verdicts(report: Report) -> dict[tuple[str, str | None], str]:
    """Return the worst verdict of all expectations about a metric of a model, by model and metric."""
    found: dict[tuple[str, str | None], str] = {}
    for e in report.expectations:
        for key in e.about:
            ranked = sorted({e.verdict, found.get(key, e.verdict)}, key=WORST.index)
            found[key] = ranked[0]
    return found
