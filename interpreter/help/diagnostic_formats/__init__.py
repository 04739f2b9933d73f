"""Output formats of diagnostics for other programs: `dsl check --diagnostics NAME`.

To add a format: one module with a function `render(told)`, which returns the text of all diagnostics `told`, and a line
in FORMATS.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING

from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic

FORMATS = {  # name: purpose of the format
    "json": "one object per line",
    "github": "annotations of a GitHub workflow",
    "sarif": "SARIF 2.1.0, for code scanning",
}


@dataclass(frozen=True)
class LocatedDiagnostic:
    """Diagnostic together with `file`, the scene named on the command line in whose check it was found."""

    file: str
    diagnostic: Diagnostic


def format_diagnostics(name: str, told: Sequence[LocatedDiagnostic]) -> str:
    """Return all diagnostics as text in the format `name`; every line ends with a line feed."""
    text: str = import_module(f"softmark.interpreter.help.diagnostic_formats.{name}").render(told)
    return text
