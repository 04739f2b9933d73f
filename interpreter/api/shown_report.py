"""Report of a run in Python, which can be displayed, plotted and written to files.

Jupyter shows `_repr_html_`; other prompts show one line. Modules for plots and files are imported on demand.
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
    """Report that `run` returns, with a pandas table, matplotlib plots and files."""

    @classmethod
    def from_report(cls, report: Report) -> Self:
        """Return a report as a RunReport."""
        return cls(**values_of_fields(report))

    def _repr_html_(self) -> str:
        from softmark.interpreter.report.notebook.report_box import inline

        return inline(self)

    def frame(self) -> DataFrame:
        """Return the results as a DataFrame in SI, with a row for each model or reference, metric and state.

        The columns are `pandas_tables.COLUMNS`. Raises MissingExtra if pandas is not installed.
        """
        from softmark.interpreter.api.pandas_tables import frame

        return frame(self)

    def plot(self, name: str | None = None, kind: str | None = None, ax: Axes | None = None) -> Axes:
        """Draw a probe or a metric by its name, by default the first one, into `ax` or a new figure.

        `kind` selects the plot if a name has several: `line` (deformed), `history` (over time), `curve` and `states`.
        Raises BadArgument, with the possible names, for a name or kind that cannot be drawn, and MissingExtra if
        matplotlib is not installed.
        """
        from softmark.interpreter.api.matplotlib_plots import plot

        return plot(self, name, kind, ax)

    def write(self, folder: str | Path) -> list[Path]:
        """Write report.json and report.html into a folder, as `dsl run --out` does, and return their paths.

        Raises BadArgument for an invalid folder name, and OSError.
        """
        from softmark.interpreter.api import api_arguments
        from softmark.interpreter.report.files.report_files import write

        return write(self, api_arguments.check_path("folder", folder, "a folder"))


def values_of_fields(found: Any) -> dict[str, Any]:
    """Return the field values of a result by name, to construct an object of a derived class."""
    return {f.name: getattr(found, f.name) for f in fields(found)}
