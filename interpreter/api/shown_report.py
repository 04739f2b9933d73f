"""What a run gives in Python: its report, and how it is shown, drawn and written.

Jupyter shows `_repr_html_`; other prompts a line. Nothing that draws or writes is imported before it is asked for.
"""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from softmark.interpreter.results.run_report import Report

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame


class RunReport(Report):
    """A report of `run`, with its table for pandas, its plots for matplotlib, and its files."""

    @classmethod
    def showing(cls, report: Report) -> Self:
        """The same report."""
        return cls(**own_fields(report))

    def _repr_html_(self) -> str:
        from softmark.interpreter.report.notebook.report_box import inline

        return inline(self)

    def frame(self) -> DataFrame:
        """A row for each model, reference, metric and state, in SI: see `frames.COLUMNS`.

        Raises MissingExtra where pandas is not installed.
        """
        from softmark.interpreter.api.pandas_tables import frame

        return frame(self)

    def plot(self, name: str | None = None, kind: str | None = None, ax: Axes | None = None) -> Axes:
        """Draw a probe or a metric by its name, or what there is first, into `ax` or a new figure.

        `kind` chooses where a name can be drawn in several ways: `line` (deformed), `history` (over time), `curve` and
        `states`. Raises BadArgument for what cannot be drawn, with what can; MissingExtra where matplotlib is not
        installed.
        """
        from softmark.interpreter.api.matplotlib_plots import plot

        return plot(self, name, kind, ax)

    def write(self, folder: str | Path) -> list[Path]:
        """Write report.json and report.html into a folder, as `dsl run --out` does; their paths.

        Raises BadArgument for what is no folder's name, and OSError.
        """
        from softmark.interpreter.api import api_arguments
        from softmark.interpreter.report.files.report_files import write

        return write(self, api_arguments.place("folder", folder, "a folder"))


def own_fields(found: Any) -> dict[str, Any]:
    """The fields of a result, for one of a class derived from its own."""
    return {f.name: getattr(found, f.name) for f in fields(found)}
