"""Diagnostics as JSON lines: one object per line, in the order in which the diagnostics were found."""

from __future__ import annotations

import json
from collections.abc import Sequence

from softmark.grammar.diagnostic import to_json
from softmark.interpreter.help.diagnostic_formats import LocatedDiagnostic


def render(told: Sequence[LocatedDiagnostic]) -> str:
    """Return the diagnostics as text, one JSON object per line, with the entries of `Diagnostic.to_json`."""
    return "".join(json.dumps(to_json(t.diagnostic), ensure_ascii=False) + "\n" for t in told)
