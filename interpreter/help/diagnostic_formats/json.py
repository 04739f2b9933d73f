"""Diagnostics as JSON lines: one object per line, in the order in which they were found."""

from __future__ import annotations

import json
from collections.abc import Sequence

from softmark.grammar.diagnostic import to_json
from softmark.interpreter.help.diagnostic_formats import LocatedDiagnostic


def render(told: Sequence[LocatedDiagnostic]) -> str:
    """Return one line for each diagnostic, with the fields of `to_json`."""
    return "".join(json.dumps(to_json(t.diagnostic), ensure_ascii=False) + "\n" for t in told)
