"""Charts of error against the number of unknowns and against Poisson's ratio, one line per model family."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property

from softmark.interpreter.language.number_formatting import choose_scale, format_quantity, group_digits, typeset_number
from softmark.interpreter.report.charts.chart_axes import Axis, logarithmic
from softmark.interpreter.report.charts.curve_labels import Point
from softmark.interpreter.report.charts.curve_styles import model_look
from softmark.interpreter.report.charts.line_chart import Chart, Curve
from softmark.interpreter.report.page.embedded_csv import Cell, csv_link
from softmark.interpreter.report.page.figure_frame import ColumnGroup, figure_block
from softmark.interpreter.report.page.html_markup import join_names, prose, section, tag
from softmark.interpreter.report.run.model_families import families_by_poisson, families_by_size
from softmark.interpreter.report.run.report_summary import MetricColumn, ReportSummary, value_of
from softmark.records import dataclass

LEAD = (
    "Models of one kind with several mesh sizes. A falling line approaches the solution that it is compared with; a "
    "rising line agreed on coarse meshes only because errors cancelled."
)
LEAD_NU = (
    "Models of one kind and size with several Poisson's ratios. A model that locks deviates as the ratio approaches "
    "0.5."
)
NOTABLE = 1.1  # an error that changes by less than this factor counts as constant
WIDTH, HEIGHT = 600.0, 330.0
Families = Mapping[str, Mapping[str, float]]


def section_of(findings: ReportSummary) -> str:
    """Return a figure for each error metric and each of the two quantities; empty if no family has two members."""
    parts = []
    for lead, families, kind in (
        (LEAD, families_by_size(findings), _UnknownsErrorChart),
        (LEAD_NU, families_by_poisson(findings), _PoissonErrorChart),
    ):
        figures = [kind(findings, i, m, families).render_figure() for i, m in enumerate(findings.errors)]
        if found := [figure for figure in figures if figure]:
            parts += [tag("p", lead, class_="lead"), *found]
    return section("refinement", "Refinement", *parts, _conflicting_references_sentence(findings)) if parts else ""


def _conflicting_references_sentence(findings: ReportSummary) -> str:
    """Return a sentence on families that refinement moves closer to one reference and away from another."""
    said: dict[tuple[str, str], list[str]] = {}
    lines = {m: _UnknownsErrorChart(findings, 0, m, families_by_size(findings)).lines for m in findings.errors}
    for family in dict.fromkeys(f for own in lines.values() for f in own):
        ends = {m: (own[family][0][2], own[family][-1][2]) for m, own in lines.items() if family in own}
        closer = list(dict.fromkeys(f"`{m.against}`" for m, (a, b) in ends.items() if b < a / NOTABLE))
        further = list(dict.fromkeys(f"`{m.against}`" for m, (a, b) in ends.items() if b > a * NOTABLE))
        if closer and further and not set(closer) & set(further):
            said.setdefault((join_names(closer), join_names(further)), []).append(family)
    found = [
        f"Under refinement, {_families_with_verb(families)} closer to {to} and farther from {away}."
        for (to, away), families in said.items()
    ]
    return tag("p", prose(" ".join(found)), class_="callout warn") if found else ""


def _families_with_verb(families: list[str]) -> str:
    """Return families as a list with a verb, such as `tet4 and hex8 come`, with semicolons if a name has a comma."""
    several = len(families) > 1
    names = "; ".join(families) if any("," in f for f in families) else join_names(families)
    return f"{names} {'come' if several else 'comes'}"


@dataclass(frozen=True)
class _ErrorChart:
    """Chart of one error metric for all families; subclasses define the quantity on the abscissa."""

    findings: ReportSummary
    number: int
    metric: MetricColumn
    families: Families

    kind = ""
    symbol = ""

    def at(self, value: float) -> float:
        """Return the position of a value on the abscissa."""
        return value

    def format_abscissa(self, value: float) -> str:
        """Return a value of the abscissa as text."""
        raise TypeError(f"a {type(self).__name__} has no values of its own")

    @property
    def across(self) -> Axis:
        """Horizontal axis of the chart."""
        raise TypeError(f"a {type(self).__name__} has no axis of its own")

    @cached_property
    def lines(self) -> dict[str, list[tuple[str, float, float]]]:
        """Points (model, value of the abscissa, error) by family, for families with at least two positive errors."""
        found = {}
        for family, members in self.families.items():
            models = self.findings.report.models
            pairs = [(n, v, value_of(models[n], self.metric.name)) for n, v in members.items()]
            line = [(n, v, abs(e)) for n, v, e in pairs if e]
            if len(line) > 1:
                found[family] = line
        return dict(zip(_short_family_names(list(found)), found.values(), strict=True))

    def render_figure(self) -> str:
        """Return the HTML of the figure; empty if no family has two members with an error."""
        if not self.lines:
            return ""
        errors = [e for line in self.lines.values() for _, _, e in line]
        name = f"{self.metric.name}, against {self.metric.against}"
        chart = Chart(
            f"{self.kind}-{self.number}", f"{self.metric.name} by {self.symbol}", self._description(), self.across,
            _error_axis(errors, name, self.metric.unit), WIDTH, HEIGHT, tuple(self._curves()), left=84.0,
        )  # fmt: skip
        return figure_block(chart, prose(self._caption()), self._columns(), self._csv_link())

    def _curves(self) -> Iterator[Curve]:
        for i, (family, line) in enumerate(self.lines.items()):
            points: tuple[Point | None, ...] = tuple((self.at(v), e) for _, v, e in line)
            yield Curve(family, model_look(i), points, 1 + 3 * i, 3, every=1, named=False)

    def _format_error(self, error: float) -> str:
        return format_quantity(error, self.metric.unit, 3, percent=True)

    def _description(self) -> str:
        """Return a description of the start and end of every line."""
        return "; ".join(f"{f} {self._describe_line(line)}" for f, line in self.lines.items()) + "."

    def _describe_line(self, line: list[tuple[str, float, float]]) -> str:
        """Return the course of a line in words, `falls from 5.1 mm at 0.3 to 1.4 mm at 0.499, then rises ...`."""
        inner = min(line, key=lambda point: point[2])
        turns = inner[2] < 0.8 * min(line[0][2], line[-1][2])
        stops = [line[0], inner, line[-1]] if turns else [line[0], line[-1]]
        said = [f"{self._format_error(e)} at {self.format_abscissa(v)}" for _, v, e in stops]
        verb = "falls" if stops[1][2] < stops[0][2] else "rises"
        return f"{verb} from {said[0]} to {said[1]}" + (f", then rises to {said[2]}" if turns else "")

    def _caption(self) -> str:
        uncertain = self.findings.uncertainty(self.metric)
        bound = f" Uncertainty of the reference: ± {self._format_error(uncertain)}." if uncertain else ""
        pair = f"`{self.metric.name}` against `{self.metric.against}`"
        return f"{pair}: {self._description()}{self._ranking_sentence()}{bound}"

    def _ranking_sentence(self) -> str:
        """Return a sentence on whether the ranking of families is the same at both ends."""
        if len(self.lines) < 2:
            return ""
        first, last = (min(self.lines, key=lambda f: self.lines[f][end][2]) for end in (0, -1))
        low, high = self.ends
        if first == last:
            return f" {first[:1].upper()}{first[1:]} is closest {low} and {high}."
        return f" The ranking changes: {low} {first} is closest; {high} {last} is closest."

    ends = ("", "")

    def _columns(self) -> list[ColumnGroup]:
        errors = [e for line in self.lines.values() for _, _, e in line]
        scale = choose_scale(errors, self.metric.unit, True)
        longest = max(len(line) for line in self.lines.values())
        found = [ColumnGroup("member", ("member",), [(str(i + 1),) for i in range(longest)])]
        heads = ("model", self.symbol, scale.heading(self.metric.name))
        for family, line in self.lines.items():
            cells = [(n, self.format_abscissa(v), typeset_number(f"{e / scale.factor:.4g}")) for n, v, e in line]
            found.append(ColumnGroup(family, heads, cells))
        return found

    def _csv_link(self) -> str:
        rows: list[list[Cell]] = [[f, n, v, e] for f, line in self.lines.items() for n, v, e in line]
        header = ["family", "model", self.symbol, f"{self.metric.name} [{self.metric.unit}]"]
        return csv_link(f"{self.metric.name}-{self.kind}", header, rows)


def _short_family_names(families: list[str]) -> list[str]:
    """Return family names without their common parts: `tet4`, `hex8, selectively integrated`."""
    parts = [family.split(", ") for family in families]
    shared = set.intersection(*map(set, parts)) if len(parts) > 1 else set()
    short = [", ".join(p for p in own if p not in shared) for own in parts]
    return short if all(short) and len(set(short)) == len(short) else families


def _error_axis(errors: list[float], name: str, unit: str) -> Axis:
    """Return a logarithmic axis of errors with ticks at powers of ten, and at 2 and 5 in between if there are few."""
    axis = logarithmic(min(errors) / 1.05, max(errors) * 1.05, name, unit)
    decades = math.log10(axis.high / axis.low)
    low, high = (math.floor(math.log10(v)) for v in (axis.low, axis.high))
    between = (1, 2, 5) if decades < 3 else (1,)
    values = [m * 10.0**k for k in range(low, high + 1) for m in between]
    within = [v for v in values if axis.low * 0.999 <= v <= axis.high * 1.001]
    return replace(axis, ticks=tuple((v, format_quantity(v, unit, 3, percent=True)) for v in within))


class _UnknownsErrorChart(_ErrorChart):
    """Chart of error against the number of unknowns."""

    kind, symbol = "refinement", "unknowns"
    ends = ("on the coarsest meshes", "on the finest")

    def format_abscissa(self, value: float) -> str:
        return group_digits(int(value))

    @property
    def across(self) -> Axis:
        values = [v for line in self.lines.values() for _, v, _ in line]
        low, high = min(values) / 1.15, max(values) * 1.15
        steps = [m * 10**k for k in range(12) for m in ((1, 2, 3, 5, 7) if high < 12 * low else (1, 2, 5))]
        ticks = tuple((float(n), group_digits(n)) for n in steps if low <= n <= high)
        return Axis(low, high, "unknowns", ticks, log=True)


class _PoissonErrorChart(_ErrorChart):
    """Chart of error against Poisson's ratio.

    The scale is log(1 - 2 nu), which spreads nearly incompressible values.
    """

    kind, symbol = "poisson", "nu"
    ends = ("at the smallest ratio", "at the largest")

    def at(self, value: float) -> float:
        return -math.log10(1.0 - 2.0 * value)

    def format_abscissa(self, value: float) -> str:
        return f"{value:.6g}"

    @property
    def across(self) -> Axis:
        values = sorted({v for line in self.lines.values() for _, v, _ in line})
        low, high = self.at(values[0]), self.at(values[-1])
        edge = 0.05 * (high - low) or 0.5
        ticks = tuple((self.at(v), typeset_number(self.format_abscissa(v))) for v in values)
        return Axis(low - edge, high + edge, "Poisson's ratio (spread as log of 1 − 2ν)", ticks)
