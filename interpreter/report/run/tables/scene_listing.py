"""Listing of the scene: its text with line numbers, and its parameters."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from softmark.interpreter.language.number_formatting import format_quantity
from softmark.interpreter.report.page.html_markup import section, tag, text
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.validation.constructor_registry import CATALOGUE

# comment | string | quantity | word before an opening bracket | any other word | the rest
_PIECE = re.compile(
    r"(?P<c>#.*)"
    r'|(?P<s>"(?:[^"\\]|\\.)*"?)'
    r"|(?P<q>(?<![\w.])(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?(?:[ \t]?(?:%|[^\W\d_][\w/*^°·-]*))?)"
    r"|(?P<f>[A-Za-z_][\w.]*(?=\s*\())"
    r"|(?P<w>[A-Za-z_][\w.]*)"
    r"|[^\w#\".]+|."
)
KINDS = frozenset(
    (
        "softmark",
        "scene",
        "use",
        "as",
        "param",
        "in",
        "expect",
        "and",
        "or",
        "not",
        *CATALOGUE,
    )  # reserved words, and all kinds of declarations
)
_UNIT_WORDS = re.compile(r"^(.*\d\.?)([ \t])(in|and|or|not|as)$")


def section_of(findings: ReportSummary) -> str:
    """Return the HTML section with text and parameters."""
    scene = findings.report.scene
    parameters = scene.get("parameters") or {}
    table = _parameters(parameters, set(scene.get("overridden") or ())) if parameters else ""
    source = str(scene.get("text", ""))
    if not source:
        return section("scene", "Scene", tag("p", "The text of the scene is not available.", class_="quiet"), table)
    marked = {e.line for e in findings.report.expectations if e.passed is False}
    rows = [_line(i, line, i in marked) for i, line in enumerate(source.splitlines(), start=1)]
    listing = tag("pre", tag("code", *rows), class_="scene", tabindex=0, role="region", aria_label="Text of the scene")
    return section("scene", "Scene", listing, table)


def _line(number: int, line: str, marked: bool) -> str:
    return tag("span", colour_line(line), "\n", id=f"L{number}", class_="line missed" if marked else "line")


def colour_line(line: str) -> str:
    """Return one line of a scene as HTML, with a span for each token that names its kind."""
    return "".join(_colour_token(match) for match in _PIECE.finditer(line))


def _colour_token(match: re.Match[str]) -> str:
    kind, piece = match.lastgroup, match[0]
    if kind == "w" and piece in KINDS:
        return tag("span", text(piece), class_="k")
    if kind == "q" and (split := _UNIT_WORDS.match(piece)):
        return tag("span", text(split[1]), class_="q") + split[2] + tag("span", text(split[3]), class_="k")
    return tag("span", text(piece), class_=kind) if kind in ("c", "s", "q", "f") else text(piece)


def _parameters(parameters: Mapping[str, Any], overridden: set[str]) -> str:
    head = tag("tr", *(tag("th", word, scope="col") for word in ("Parameter", "Value", "As given", "From")))
    rows = [_parameter(name, known, name in overridden) for name, known in parameters.items()]
    table = tag("table", tag("caption", "Parameters"), tag("thead", head), tag("tbody", *rows))
    return tag("div", table, class_="scroll", tabindex=0, role="region", aria_label="Parameters")


def _parameter(name: str, known: Mapping[str, Any], overridden: bool) -> str:
    origin = tag("strong", "command line") if overridden else "scene"
    value = tag("td", text(value_shown(known)), class_="n")
    return tag(
        "tr",
        tag("th", tag("code", text(name)), scope="row"),
        value,
        tag("td", tag("code", text(known.get("text", "")))),
        tag("td", origin),
    )


def value_shown(known: Mapping[str, Any]) -> str:
    """Return the value of a parameter with its unit as text."""
    return _format_value(known.get("value"), str(known.get("unit", "1")))


def _format_value(value: Any, unit: str) -> str:
    if isinstance(value, (list, tuple)):
        return "(" + ", ".join(_format_value(v, unit) for v in value) + ")"
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return str(value)
    return format_quantity(float(value), unit)
