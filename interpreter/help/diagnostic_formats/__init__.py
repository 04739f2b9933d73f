"""Diagnostics as other programs read them: `dsl check --diagnostics NAME`.

To add a format: one module with `render(told)`, a text of all diagnostics, and its line in FORMATS.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING

from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic

FORMATS = {  # name: what it is for
    "json": "one object a line",
    "github": "annotations of a workflow of GitHub",
    "sarif": "SARIF 2.1.0, for code scanning",
}


@dataclass(frozen=True)
class Told:
    """A diagnostic, and the file of the command line that it was found for."""

    file: str
    diagnostic: Diagnostic


def rendered(name: str, told: Sequence[Told]) -> str:
    """All diagnostics in the format of that name, with a line feed at the end of each line."""
    text: str = import_module(f"softmark.interpreter.help.diagnostic_formats.{name}").render(told)
    return text
