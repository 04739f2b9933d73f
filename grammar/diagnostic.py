"""Diagnostics: what is wrong with a text, where, and how to mend it; and how a terminal shows them.

A diagnostic is a value. Whoever finds something wrong appends one to a list and goes on, so that one pass
reports everything. Codes are stable: E1xx syntax, E2xx names, kinds and units, E3xx physics, E4xx files,
E5xx what a model or a reference cannot represent, E6xx running; W as E, for what is allowed but doubtful.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from softmark.grammar.tree import Span


@dataclass(frozen=True, slots=True)
class Source:
    """A text and the name that messages give it: a path, `<stdin>`, or `-p L=12` for an override."""

    name: str
    text: str


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One message. `message` says what is wrong, `label` what stands at the span, `help` how to mend it."""

    code: str
    message: str
    source: Source | None
    span: Span | None
    label: str = ""
    help: str = ""
    notes: tuple[str, ...] = ()

    @property
    def severity(self) -> Literal["error", "warning"]:
        """`error` for codes that start with E, `warning` for W."""
        return "error" if self.code.startswith("E") else "warning"
