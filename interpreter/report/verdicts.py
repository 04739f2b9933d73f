"""What was expected and whether it came so; and the doubts about the scene."""

from __future__ import annotations

from softmark.interpreter.report.findings import Findings
from softmark.interpreter.report.markup import count, line_link, prose, section, tag, text
from softmark.interpreter.report.quantities import quantity
from softmark.interpreter.results import ExpectationResult, Warned

VERDICTS = {True: ("✓", "good", "met"), False: ("✗", "bad", "not met"), None: ("?", "quiet", "not judged")}


def expectations(findings: Findings) -> str:
    """A row for each expectation, in the order of the scene."""
    judged = findings.report.expectations
    if not judged:
        later = " yet: the report is unfinished" if findings.report.partial else ""
        return section(
            "expectations", "Expectations", tag("p", f"No expectation was judged{later}.", class_="quiet")
        )
    head = tag("tr", *(tag("th", word, scope="col") for word in ("Verdict", "Expectation", "Value", "Place")))
    met = sum(e.passed is True for e in judged)
    caption = tag(
        "caption", f"{met} of {count(len(judged), 'expectation')} met. The value is that of the left side."
    )
    table = tag(
        "table", caption, tag("thead", head), tag("tbody", *(_row(e) for e in judged)), class_="verdicts"
    )
    return section(
        "expectations",
        "Expectations",
        tag("div", table, class_="scroll", tabindex=0, role="region", aria_label="Expectations"),
    )


def _row(e: ExpectationResult) -> str:
    symbol, mood, words = VERDICTS[e.passed]
    verdict = tag("span", tag("span", symbol, aria_hidden="true"), f" {words}", class_=f"status {mood}")
    why = tag("small", prose(e.reason)) if e.reason else ""
    said = tag("th", tag("code", text(e.text)), why, scope="row")
    return tag("tr", tag("td", verdict), said, tag("td", _value(e), class_="n"), tag("td", line_link(e.line)))


def _value(e: ExpectationResult) -> str:
    if e.value is None:
        return "–"
    return tag("data", text(quantity(e.value, e.unit, 4, percent="%" in e.text)), value=repr(float(e.value)))


def warnings(findings: Findings) -> str:
    """A list of warnings; empty where there are none."""
    doubts = findings.report.warnings
    if not doubts:
        return ""
    return section("warnings", "Warnings", tag("ul", *(_warning(w) for w in doubts), class_="warnings"))


def _warning(w: Warned) -> str:
    help_ = tag("p", prose(w.help), class_="quiet") if w.help else ""
    place = tag("span", line_link(w.line), class_="place") if w.line else ""
    return tag(
        "li", tag("p", tag("span", text(w.code), class_="code"), " ", prose(w.message), " ", place), help_
    )
