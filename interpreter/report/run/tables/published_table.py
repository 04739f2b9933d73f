"""Table of published values next to computed ones.

Source of such a table: Marchal et al. (2008), Table 1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from softmark.interpreter.language.number_formatting import Scale, choose_decimals, choose_scale, typeset_number
from softmark.interpreter.report.page.embedded_csv import Cell, csv_link
from softmark.interpreter.report.page.html_markup import join_names, prose, section, tag, text
from softmark.interpreter.report.run.report_summary import MetricColumn, ReportSummary, value_of
from softmark.interpreter.results.run_report import MetricResult, ModelResult
from softmark.records import dataclass

LEAD = (
    "Computed numbers and published numbers of the same experiment; the difference is computed minus published, also "
    "in per cent of the published value. They are for information only."
)
HEADS = ("ours", "published", "difference")


def section_of(findings: ReportSummary) -> str:
    """Return the HTML section with the table; empty if the scene has no published values."""
    columns = [m for m in findings.metrics if any(_published_value(r, m) is not None for r in _models(findings))]
    if not columns:
        return ""
    pairs = _PublishedMetrics(findings, columns)
    return section(
        "published", "Published", tag("p", LEAD, class_="lead"), pairs.html(), _sources(findings), pairs.csv()
    )


def _models(findings: ReportSummary) -> Sequence[ModelResult]:
    return list(findings.report.models.values())


def _published_value(model: ModelResult, metric: MetricColumn) -> float | None:
    found = model.metrics.get(metric.name)
    return None if found is None else found.published


def _sources(findings: ReportSummary) -> str:
    """Return the sources of the published values, if the scene has them."""
    entries = findings.report.scene.get("published") or ()
    same: dict[str, list[str]] = {}
    for entry in entries:
        if isinstance(entry, Mapping):
            metric = [f"`{entry['metric']}`"] if entry.get("metric") else []
            same.setdefault(_source(entry), []).extend(metric)
    items = [tag("li", prose(f"{join_names(m)}: {said}" if m else said)) for said, m in same.items()]
    return tag("ul", *items, class_="notes sources") if items else ""


def _source(entry: Mapping[str, Any]) -> str:
    note = f" {entry['note']}" if entry.get("note") else ""
    return f"{entry.get('source') or 'no source given'}.{note}".replace("..", ".")


@dataclass(frozen=True)
class _PublishedMetrics:
    """Metrics of models that have published values."""

    findings: ReportSummary
    columns: Sequence[MetricColumn]

    @property
    def rows(self) -> dict[str, ModelResult]:
        """Models that have published values, by name."""
        known = self.findings.report.models.items()
        return {n: m for n, m in known if any(_published_value(m, c) is not None for c in self.columns)}

    def html(self) -> str:
        """Return the HTML table with a row for each model and a group of columns for each metric."""
        scales = {m.name: self._scale_and_decimals(m) for m in self.columns}
        top = [tag("th", "Model", rowspan=2, scope="col")]
        top += [self._head(m, scales[m.name][0]) for m in self.columns]
        low = [tag("th", word, scope="col") for _ in self.columns for word in HEADS]
        body = [self._row(n, m, scales) for n, m in self.rows.items()]
        caption = tag("caption", tag("span", "Computed and published values"))
        table = tag(
            "table",
            caption,
            tag("thead", tag("tr", *top), tag("tr", *low)),
            tag("tbody", *body),
            class_="pairs",
        )
        return tag(
            "div",
            table,
            class_="scroll",
            tabindex=0,
            role="region",
            aria_label="Computed and published values",
        )

    def _scale_and_decimals(self, metric: MetricColumn) -> tuple[Scale, int]:
        values = [value_of(m, metric.name) for m in self.rows.values()]
        values += [_published_value(m, metric) for m in self.rows.values()]
        scale = choose_scale(values, metric.unit, metric.percent)
        return scale, choose_decimals(values, scale, 4)

    def _head(self, metric: MetricColumn, scale: Scale) -> str:
        name = tag("a", tag("code", text(metric.name)), href=f"#L{metric.line}") if metric.line else text(metric.name)
        unit = tag("span", text(f" / {scale.unit}"), class_="unit") if scale.unit else ""
        return tag("th", name, unit, colspan=len(HEADS), scope="colgroup")

    def _row(self, name: str, model: ModelResult, scales: Mapping[str, tuple[Scale, int]]) -> str:
        cells = [cell for m in self.columns for cell in _cells(model.metrics.get(m.name), *scales[m.name])]
        head = tag("th", tag("code", text(name)), scope="row", title=model.outline)
        return tag("tr", head, *(tag("td", cell, class_="n") for cell in cells))

    def csv(self) -> str:
        """Return the link to a CSV file with every number, in SI."""
        header = ["name", "metric", "unit", "ours", "published", "difference", "difference / published"]
        rows: list[list[Cell]] = []
        for name, model in self.rows.items():
            for metric in self.columns:
                ours, theirs = value_of(model, metric.name), _published_value(model, metric)
                rows.append([name, metric.name, metric.unit, ours, theirs, *_differences(ours, theirs)])
        return csv_link("published", header, rows, "Save this table as CSV")


def _differences(ours: float | None, theirs: float | None) -> tuple[float | None, float | None]:
    """Return the absolute difference, and the difference relative to the published value."""
    if ours is None or theirs is None:
        return None, None
    return ours - theirs, (ours - theirs) / abs(theirs) if theirs else None


def _cells(found: MetricResult | None, scale: Scale, decimals: int) -> list[str]:
    """Return table cells with the computed value, the published value, and the absolute and relative difference."""
    ours, theirs = (found.value, found.published) if found else (None, None)
    absolute, share = _differences(ours, theirs)
    shown = [_number(v, scale, decimals) for v in (ours, theirs)]
    sign = "+" if absolute is not None and absolute > 0 else ""
    below = tag("small", _percent(share)) if share is not None else ""
    return [*shown, sign + _number(absolute, scale, decimals) + below]


def _number(value: float | None, scale: Scale, decimals: int) -> str:
    return "–" if value is None else tag("data", text(scale.text(value, decimals)), value=repr(float(value)))


def _percent(share: float) -> str:
    return text(("+" if share > 0 else "") + typeset_number(f"{100 * share:.0f} %"))
