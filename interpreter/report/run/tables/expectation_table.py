"""HTML sections of expectations with their outcome, and of warnings about the scene."""

from __future__ import annotations

from collections.abc import Container, Iterable

from softmark.interpreter.language.number_formatting import format_quantity
from softmark.interpreter.report.page.html_markup import count, prose, section, tag, text
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.results.run_report import ExpectationResult, ReportWarning

HEADS = ("Verdict", "Expectation", "Value", "Line")
VERDICTS = {True: ("✓", "good", "met"), False: ("✗", "bad", "not met"), None: ("?", "quiet", "not judged")}


def expectations(findings: ReportSummary) -> str:
    """Return the section of expectations, in the order of the scene."""
    judged = findings.report.expectations
    if not judged:
        later = " yet: the report is unfinished" if findings.report.partial else ""
        return section("expectations", "Expectations", tag("p", f"No expectation was judged{later}.", class_="quiet"))
    return section("expectations", "Expectations", table_of(findings))


def table_of(findings: ReportSummary) -> str:
    """Return the HTML table of evaluated expectations, in a scrolling box."""
    judged = findings.report.expectations
    head = tag(
        "tr",
        *(tag("th", word, scope="col", class_="n" if word in ("Value", "Line") else None) for word in HEADS),
    )
    met = sum(e.passed is True for e in judged)
    caption = tag(
        "caption", f"{met} of {count(len(judged), 'expectation')} met. Value: computed left side of the comparison."
    )
    table = tag(
        "table",
        caption,
        tag("thead", head),
        tag("tbody", *(_row(e, findings) for e in judged)),
        class_="verdicts",
    )
    return tag("div", table, class_="scroll", tabindex=0, role="region", aria_label="Expectations")


def _row(e: ExpectationResult, findings: ReportSummary) -> str:
    symbol, mood, words = VERDICTS[e.passed]
    verdict = tag("span", tag("span", symbol, aria_hidden="true"), f" {words}", class_=f"status {mood}")
    why = tag("small", prose(e.reason)) if e.reason else ""
    said = tag("th", tag("code", text(e.text)), why, scope="row")
    return tag(
        "tr",
        tag("td", verdict),
        said,
        tag("td", _value(e), class_="n"),
        tag("td", _line_number_link(e.line, findings.lines), class_="n"),
    )


def _line_number_link(line: int, lines: Container[int]) -> str:
    """Return a line number as HTML, with a link if the page has that line."""
    return tag("a", str(line), href=f"#L{line}", aria_label=f"line {line}") if line in lines else str(line)


def _value(e: ExpectationResult) -> str:
    if e.value is None:
        return "–"
    return tag("data", text(format_quantity(e.value, e.unit, 4, percent="%" in e.text)), value=repr(float(e.value)))


def warnings(findings: ReportSummary) -> str:
    """Return the section of warnings; empty if there are none."""
    said = warning_list(findings.report.warnings, findings.lines)
    return section("warnings", "Warnings", said) if said else ""


def warning_list(warnings: Iterable[ReportWarning], lines: Container[int] = ()) -> str:
    """Return an HTML list of warnings, equal ones merged, with links to `lines`; empty if there are none."""
    same: dict[tuple[str, str, str], list[ReportWarning]] = {}
    for one in warnings:
        same.setdefault((one.code, one.message, one.help), []).append(one)
    items = [_warning(group, lines) for group in same.values()]
    return tag("ul", *items, class_="warnings") if items else ""


def _warning(group: list[ReportWarning], lines: Container[int]) -> str:
    first = group[0]
    places = ", ".join(f"line {_line_number_link(w.line, lines)}" for w in group if w.line)
    said = [tag("span", text(first.code), class_="code"), " ", prose(first.message)]
    help_ = tag("p", prose(first.help), class_="quiet") if first.help else ""
    return tag("li", tag("p", *said, tag("span", f" ({places})", class_="place") if places else ""), help_)
