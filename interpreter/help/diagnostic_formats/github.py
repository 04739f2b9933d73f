"""Diagnostics as commands of a workflow of GitHub, which shows them beside the lines of a pull request.

`::error file=F,line=L,endLine=M,col=C,endColumn=D,title=E204::message`: GitHub takes columns within one line alone.
It shows ten errors and ten warnings of a step; the others stand in its log, each with its place.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import all_visible, encodable
from softmark.interpreter.help.diagnostic_formats import Told
from softmark.interpreter.help.diagnostic_formats.repository_locations import located, path_of, unique, words
from softmark.interpreter.language.number_formatting import format_quantity

if TYPE_CHECKING:
    from softmark.interpreter.results.run_report import Report


def render(told: Sequence[Told]) -> str:
    """A line for each."""
    return "".join(_of(t) for t in unique(told))


def _of(told: Told) -> str:
    place, d = located(told), told.diagnostic
    properties: dict[str, str | int] = {"file": place.path} if os.path.isfile(told.file) or place.span else {}
    where = place.path
    if place.span:
        span = place.span
        properties |= {"line": span.line, "endLine": span.end_line}
        if span.line == span.end_line:
            properties |= {"col": span.column, "endColumn": span.end_column}
        where += f":{span.line}:{span.column}"
    return command(d.severity, properties | {"title": d.code}, f"{words(d)}\n{where}")


def of_report(report: Report) -> str:
    """A line for each model and reference that has no answer, and for each expectation that is not met."""
    file = str(report.scene["file"])
    place: dict[str, str | int] = {"file": path_of(file)} if os.path.isfile(file) else {}
    lines = [
        command("error", place | {"title": f"{o.name}: {o.status.replace('_', ' ')}"}, o.message or o.status)
        for o in report.failures
    ]
    for e in report.expectations:
        if e.left_out or e.passed:
            continue
        found = "" if e.value is None else f"found {format_quantity(e.value, e.unit, 4, percent=True)}"
        message = "; ".join(filter(None, (e.text, e.reason, found)))
        title = "expectation not met" if e.passed is False else "expectation not judged"
        lines.append(command("error", place | {"line": e.line, "title": title}, message))
    return "".join(lines)


def command(name: str, properties: Mapping[str, str | int], message: str) -> str:
    """A line with what would end it, or a property, escaped; what steers a terminal is seen and does not."""
    message = encodable(str(all_visible(message)))
    told = ",".join(f"{key}={_property(str(value))}" for key, value in properties.items())
    return f"::{name} {told}::{_data(message)}\n"


def _data(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")
