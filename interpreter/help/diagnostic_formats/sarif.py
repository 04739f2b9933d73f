"""Diagnostics as SARIF 2.1.0 (OASIS, errata 01) for code scanning, with a SARIF rule for each code that occurs.

Columns count code points, as in our diagnostics. Files are named relative to the source root, `%SRCROOT%`.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any
from urllib.parse import quote

from softmark import __version__
from softmark.grammar.diagnostic import Diagnostic, SecondaryPlace, make_encodable
from softmark.grammar.tree import Span
from softmark.interpreter.help.codes import pages
from softmark.interpreter.help.diagnostic_formats import LocatedDiagnostic
from softmark.interpreter.help.diagnostic_formats.repository_locations import (
    RepositoryLocation,
    full_message,
    is_file,
    repository_location,
    repository_path,
    without_duplicates,
)
from softmark.interpreter.help.suggested_fixes import replacement

SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
ROOT = "%SRCROOT%"


def render(told: Sequence[LocatedDiagnostic]) -> str:
    """Return the diagnostics as the text of one SARIF document with one run."""
    found = without_duplicates(told)
    codes = sorted({t.diagnostic.code for t in found})
    run = {
        "tool": {"driver": {"name": "softmark", "version": __version__, "rules": [_rule(code) for code in codes]}},
        "columnKind": "unicodeCodePoints",
        "originalUriBaseIds": {ROOT: {"description": {"text": "The root of the sources."}}},
        "results": [_result(t, codes.index(t.diagnostic.code)) for t in found],
    }
    return json.dumps({"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}, indent=1, ensure_ascii=False) + "\n"


def _rule(code: str) -> dict[str, Any]:
    """Return the SARIF rule of a diagnostic code, from its explanation page."""
    page = pages()[code]
    level = "error" if code.startswith("E") else "warning"
    return {
        "id": code,
        "shortDescription": {"text": f"{page.title[:1].upper()}{page.title[1:]}."},
        "fullDescription": {"text": page.text.split("\n\n")[1].replace("\n", " ")},
        "help": {"text": page.text, "markdown": page.text},
        "defaultConfiguration": {"level": level},
    }


def _result(told: LocatedDiagnostic, rule: int) -> dict[str, Any]:
    d = told.diagnostic
    own: dict[str, Any] = {
        "ruleId": d.code,
        "ruleIndex": rule,
        "level": d.severity,
        "message": {"text": full_message(d)},
        "locations": [{"physicalLocation": _location(repository_location(told))}],
    }
    if related := [_related(i, s) for i, s in enumerate(d.also, 1) if is_file(s.source)]:
        own["relatedLocations"] = related
    if fix := _fix(d):
        own["fixes"] = [fix]
    return own


def _location(place: RepositoryLocation) -> dict[str, Any]:
    own: dict[str, Any] = {"artifactLocation": _artifact(place.path)}
    return own | {"region": _region(place.span) if place.span else {"startLine": 1}}


def _artifact(path: str) -> dict[str, str]:
    if path.startswith("/"):
        return {"uri": f"file://{quote(path)}"}
    drive = ":" in path.split("/", 1)[0]  # `C:/...` of Windows is outside the root as well; a name may have a colon
    return {"uri": f"file:///{quote(path)}"} if drive and path[1:3] == ":/" else {"uri": quote(path), "uriBaseId": ROOT}


def _region(span: Span) -> dict[str, int]:
    return {
        "startLine": span.line,
        "startColumn": span.column,
        "endLine": span.end_line,
        "endColumn": span.end_column,
    }


def _related(i: int, second: SecondaryPlace) -> dict[str, Any]:
    place = _location(RepositoryLocation(repository_path(second.source.name), second.span))
    return {"id": i, "physicalLocation": place, "message": {"text": make_encodable(second.label)}}


def _fix(d: Diagnostic) -> dict[str, Any] | None:
    """Return the suggested replacement of a diagnostic as a SARIF fix, None without a suggestion."""
    found = replacement(d)
    if found is None or d.source is None or not is_file(d.source):
        return None
    span, text = found
    change = {"deletedRegion": _region(span), "insertedContent": {"text": text}}
    file = _artifact(repository_path(d.source.name))
    return {
        "description": {"text": make_encodable(d.help)},
        "artifactChanges": [{"artifactLocation": file, "replacements": [change]}],
    }
