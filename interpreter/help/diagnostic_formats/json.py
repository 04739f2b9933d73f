"""Diagnostics as JSON: an object a line, in the order in which they were found."""

from __future__ import annotations

import json
from collections.abc import Sequence

from softmark.grammar.diagnostic import to_json
from softmark.interpreter.help.diagnostic_formats import Told


def render(told: Sequence[Told]) -> str:
    """A line for each, with the fields of `to_json`."""
    return "".join(json.dumps(to_json(t.diagnostic), ensure_ascii=False) + "\n" for t in told)
