"""Results of comparisons and robustness studies in Python, with their display and files.

Jupyter shows `_repr_html_`; other prompts show one line. Modules for plots and files are imported on demand.
"""

from __future__ import annotations

from pathlib import Path
from typing import Self

from softmark.interpreter.api.shown_report import values_of_fields
from softmark.interpreter.results.prompt_representation import shorten
from softmark.interpreter.study.comparison_study import Comparison
from softmark.interpreter.study.robustness.robustness_record import Robustness


class ShownComparison(Comparison):
    """Result of `softmark.compare`, which can be displayed and written to files."""

    @classmethod
    def from_comparison(cls, found: Comparison) -> Self:
        """Return a comparison as a ShownComparison."""
        return cls(**values_of_fields(found))

    def __repr__(self) -> str:
        solved = sum(p["status"] in ("converged", "capped") for p in self.points)
        models = len({p["model"] for p in self.points})
        advice = "".join(f"; {shorten(a.sentence)}" for a in self.found.analysis.advice[:1])
        return f"<Comparison: {solved} of {len(self.points)} configurations of {models} models solved{advice}>"

    def _repr_html_(self) -> str:
        from softmark.interpreter.report.notebook.comparison_box import inline

        return inline(self.found)

    def write(self, folder: str | Path) -> list[Path]:
        """Write compare.json and compare.html into a folder, as `dsl compare --out` does, and return their paths.

        Raises BadArgument for an invalid folder name, and OSError.
        """
        from softmark.interpreter.report.comparison.comparison_page import page

        return _write_files(folder, {"compare.json": self.dumps(), "compare.html": page(self.found)})


class ShownRobustness(Robustness):
    """Result of `softmark.robustness`, which can be displayed and written to files."""

    @classmethod
    def showing(cls, found: Robustness) -> Self:
        """Return a robustness study as a ShownRobustness."""
        return cls(**values_of_fields(found))

    def __repr__(self) -> str:
        said = ", ".join(f"{n} {word.replace('_', ' ')}" for word, n in self.summary.classes.items() if n)
        return f"<Robustness of {str(self.scene['title'])!r}: {self.summary.points} points: {said or 'none'}>"

    def _repr_html_(self) -> str:
        from softmark.interpreter.report.notebook.robustness_box import inline

        return inline(self)

    def write(self, folder: str | Path) -> list[Path]:
        """Write stress.json and stress.html into a folder, as `dsl robustness --out` does, and return their paths.

        Raises BadArgument for an invalid folder name, and OSError.
        """
        from softmark.interpreter.report.robustness.robustness_page import page

        return _write_files(folder, {"stress.json": self.dumps(), "stress.html": page(self)})


def _write_files(folder: str | Path, texts: dict[str, str]) -> list[Path]:
    from softmark.interpreter.api import api_arguments
    from softmark.interpreter.results.atomic_files import replace

    place = api_arguments.check_path("folder", folder, "a folder")
    place.mkdir(parents=True, exist_ok=True)
    return [replace(place / name, text) for name, text in texts.items()]
