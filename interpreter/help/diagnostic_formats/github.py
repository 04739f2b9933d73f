"""Diagnostics as GitHub workflow commands, which GitHub shows next to the lines of a pull request.

The form is `::error file=F,line=L,endLine=M,col=C,endColumn=D,title=E204::message`. GitHub accepts columns only if the
range is within one line. It shows ten errors and ten warnings of each step next to the lines; all others appear only in
the log, each with its location.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import make_all_visible, make_encodable
from softmark.interpreter.help.diagnostic_formats import LocatedDiagnostic
from softmark.interpreter.help.diagnostic_formats.repository_locations import (
    full_message,
    repository_location,
    repository_path,
    without_duplicates,
)
from softmark.interpreter.language.number_formatting import format_quantity

if TYPE_CHECKING:
    from softmark.interpreter.results.run_report import Report


def render(told: Sequence[LocatedDiagnostic]) -> str:
    """Return the diagnostics as text, one workflow command for each."""
    return "".join(_annotation(t) for t in without_duplicates(told))


def _annotation(told: LocatedDiagnostic) -> str:
    place, d = repository_location(told), told.diagnostic
    properties: dict[str, str | int] = {"file": place.path} if os.path.isfile(told.file) or place.span else {}
    where = place.path
    if place.span:
        span = place.span
        properties |= {"line": span.line, "endLine": span.end_line}
        if span.line == span.end_line:
            properties |= {"col": span.column, "endColumn": span.end_column}
        where += f":{span.line}:{span.column}"
    return command(d.severity, properties | {"title": d.code}, f"{full_message(d)}\n{where}")


def annotate_report(report: Report) -> str:
    """Return workflow commands for models and references without a result and for expectations that are not met."""
    file = str(report.scene["file"])
    place: dict[str, str | int] = {"file": repository_path(file)} if os.path.isfile(file) else {}
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
    """Return a workflow command, with special characters escaped and control characters made visible."""
    message = make_encodable(str(make_all_visible(message)))
    told = ",".join(f"{key}={_escape_property(str(value))}" for key, value in properties.items())
    return f"::{name} {told}::{_escape_message(message)}\n"


def _escape_message(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _escape_property(text: str) -> str:
    return _escape_message(text).replace(":", "%3A").replace(",", "%2C")
