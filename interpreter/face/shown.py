"""What a run, a comparison and a stability study give in Python: their results, and how these are shown and written.

Jupyter shows `_repr_html_`; other prompts a line. Nothing that draws or writes is imported before it is asked for.
"""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from softmark.interpreter.results.prompt import cut
from softmark.interpreter.results.report import Report
from softmark.interpreter.study.compare import Comparison
from softmark.interpreter.study.stability.record import Stress

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame


class RunReport(Report):
    """A report of `run`, with its table for pandas, its plots for matplotlib, and its files."""

    @classmethod
    def showing(cls, report: Report) -> Self:
        """The same report."""
        return cls(**_own(report))

    def _repr_html_(self) -> str:
        from softmark.interpreter.report.inline.run import inline

        return inline(self)

    def frame(self) -> DataFrame:
        """A row for each model, reference, metric and state, in SI: see `frames.COLUMNS`.

        Raises MissingExtra where pandas is not installed.
        """
        from softmark.interpreter.face.frames import frame

        return frame(self)

    def plot(self, name: str | None = None, kind: str | None = None, ax: Axes | None = None) -> Axes:
        """Draw a probe or a metric by its name, or what there is first, into `ax` or a new figure.

        `kind` chooses where a name can be drawn in several ways: `line` (deformed), `history` (over time), `curve` and
        `states`. Raises BadArgument for what cannot be drawn, with what can; MissingExtra where matplotlib is not
        installed.
        """
        from softmark.interpreter.face.plots import plot

        return plot(self, name, kind, ax)

    def write(self, folder: str | Path) -> list[Path]:
        """Write report.json and report.html into a folder, as `dsl run --out` does; their paths.

        Raises BadArgument for what is no folder's name, and OSError.
        """
        from softmark.interpreter.face import arguments
        from softmark.interpreter.report.files.files import write

        return write(self, arguments.place("folder", folder, "a folder"))


class ShownComparison(Comparison):
    """What `compare` found, and its files."""

    @classmethod
    def showing(cls, found: Comparison) -> Self:
        """The same comparison."""
        return cls(**_own(found))

    def __repr__(self) -> str:
        solved = sum(p["status"] in ("converged", "capped") for p in self.points)
        models = len({p["model"] for p in self.points})
        advice = "".join(f"; {cut(a.sentence)}" for a in self.found.analysis.advice[:1])
        return f"<Comparison: {solved} of {len(self.points)} configurations of {models} models solved{advice}>"

    def _repr_html_(self) -> str:
        from softmark.interpreter.report.inline.compare import inline

        return inline(self.found)

    def write(self, folder: str | Path) -> list[Path]:
        """Write compare.json and compare.html into a folder, as `dsl compare --out` does; their paths.

        Raises BadArgument for what is no folder's name, and OSError.
        """
        from softmark.interpreter.report.compare.page import page

        return _written(folder, {"compare.json": self.dumps(), "compare.html": page(self.found)})


class ShownStress(Stress):
    """What `stress` found, and its files."""

    @classmethod
    def showing(cls, found: Stress) -> Self:
        """The same study."""
        return cls(**_own(found))

    def __repr__(self) -> str:
        said = ", ".join(f"{n} {word.replace('_', ' ')}" for word, n in self.summary.classes.items() if n)
        return f"<Stress of {str(self.scene['title'])!r}: {self.summary.points} points: {said or 'none'}>"

    def _repr_html_(self) -> str:
        from softmark.interpreter.report.inline.stability import inline

        return inline(self)

    def write(self, folder: str | Path) -> list[Path]:
        """Write stress.json and stress.html into a folder, as `dsl stress --out` does; their paths.

        Raises BadArgument for what is no folder's name, and OSError.
        """
        from softmark.interpreter.report.stability.page import page

        return _written(folder, {"stress.json": self.dumps(), "stress.html": page(self)})


def _own(found: Any) -> dict[str, Any]:
    """The fields of a result, for one of a class derived from its own."""
    return {f.name: getattr(found, f.name) for f in fields(found)}


def _written(folder: str | Path, texts: dict[str, str]) -> list[Path]:
    from softmark.interpreter.face import arguments
    from softmark.interpreter.results.files import replace

    place = arguments.place("folder", folder, "a folder")
    place.mkdir(parents=True, exist_ok=True)
    return [replace(place / name, text) for name, text in texts.items()]
