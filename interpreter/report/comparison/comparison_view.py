"""View of one scene of a comparison, for page and terminal: configurations, lines, styles and formatted numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

from softmark.interpreter.language.number_formatting import format_quantity, group_digits, is_negligible
from softmark.interpreter.report.charts.curve_styles import MODEL_DASHES, CurveStyle, model_look
from softmark.interpreter.report.page.html_markup import join_names
from softmark.interpreter.results.json_records import Json
from softmark.interpreter.study.analysis.comparison_analysis import ErrorAnalysis, References, SceneAnalysis
from softmark.interpreter.study.analysis.comparison_point import UNKNOWNS, ComparedPoint, Spread
from softmark.interpreter.study.analysis.comparison_record import ComparisonRecord
from softmark.interpreter.study.analysis.refinement_lines import RefinementLine
from softmark.records import dataclass

CLOCKS = {"cpu_s": "CPU time", "wall_s": "wall time", UNKNOWNS: "unknowns"}


@dataclass(frozen=True)
class SceneView:
    """Data of one scene of a comparison, for the page and the terminal table.

    If a sweep changes the reference, the scene has several problems, and each view has the data of one of them.
    """

    number: int
    scene: str
    title: str
    points: Sequence[ComparedPoint]
    references: References
    analysis: SceneAnalysis

    @property
    def at(self) -> str:
        """Varied value that changes the reference, such as `E = 30 kPa`; empty if the scene has only one problem."""
        return ", ".join(f"{name} = {value}" for name, value in self.analysis.problem.items())

    @property
    def heading(self) -> str:
        """Title of the scene, followed by the value that distinguishes this problem."""
        return f"{self.title}, {self.at}" if self.at else self.title

    @property
    def metrics(self) -> Mapping[str, ErrorAnalysis]:
        """Analysis of each error metric, by name."""
        return self.analysis.metrics

    @cached_property
    def measurements(self) -> Mapping[str, str]:
        """Units of the metrics that have no reference, by name; they are shown but not ranked."""
        entries = ((n, e) for p in self.points for n, e in p.errors.items() if n not in self.metrics)
        return {name: str(found.unit) for name, found in entries}

    @cached_property
    def _largest_length(self) -> float:
        """Largest value of all metrics that are lengths, m, as the scale of rounding errors."""
        values = (e.value for p in self.points for e in p.errors.values() if e.unit == "m" and e.value is not None)
        return max(map(abs, values), default=0.0)

    def format_measurement(self, point: ComparedPoint, metric: str) -> str:
        """Return the value of a metric without reference as text."""
        value = point.metric(metric).value
        unit = self.measurements[metric]
        if value is None:
            return "–"
        return (
            "0"
            if is_negligible(value, 0.0, unit, self._largest_length)
            else format_quantity(value, unit, 6, percent=True)
        )

    @property
    def no_advice_reason(self) -> str:
        """Reason why there is no recommendation, as a sentence."""
        if not self.points:
            return "No configurations were computed."
        return "No metric is `against` a reference, so no error was measured and nothing can be recommended."

    @property
    def lines(self) -> Sequence[RefinementLine]:
        """Refinement lines of all models: configurations that differ in one number only, in its order."""
        return self.analysis.lines

    @property
    def clock(self) -> str:
        """Kind of effort by which configurations are compared, such as CPU time."""
        return self.analysis.clock

    @property
    def effort_name(self) -> str:
        """Name of the effort as a heading, such as `CPU time`."""
        name = CLOCKS.get(self.clock, self.clock)
        return name[:1].upper() + name[1:]

    @property
    def timed(self) -> bool:
        """True if any configuration was timed."""
        return self.clock != UNKNOWNS

    @cached_property
    def by_key(self) -> dict[str, ComparedPoint]:
        """Solved configurations by key; one that is in several studies is taken from the first of them."""
        return {p.key: p for p in reversed(self.points)}

    @cached_property
    def distinct_points(self) -> list[ComparedPoint]:
        """Solved configurations, each once, although it may be in several studies."""
        return list({(p.key, p.label): p for p in reversed(self.points)}.values())[::-1]

    @cached_property
    def line_styles(self) -> list[CurveStyle]:
        """Style of each refinement line: colour and marker of its model, and a dash that differs within a model."""
        models = {model: i for i, model in enumerate(dict.fromkeys(line.model for line in self.lines))}
        seen: dict[str, int] = {}
        found = []
        for line in self.lines:
            place = seen.setdefault(line.model, 0)
            seen[line.model] += 1
            found.append(replace(model_look(models[line.model]), dash=MODEL_DASHES[place % len(MODEL_DASHES)]))
        return found

    def effort(self, point: ComparedPoint) -> Spread | None:
        """Return the effort of a configuration, a time, s, or a number of unknowns; None if unknown."""
        return point.effort(self.clock)

    def pareto_metrics(self, point: ComparedPoint) -> list[str]:
        """Return the names of the error metrics for which a configuration is on the Pareto front."""
        return [name for name, own in self.metrics.items() if point.key in own.front]

    def disturbed(self, point: ComparedPoint) -> bool:
        """Return whether times are compared and the timing of a configuration was disturbed."""
        return self.timed and point.cost.contaminated

    def amount(self, value: float, metric: str, digits: int = 3) -> str:
        """Return a value of an error metric as text with its unit."""
        return format_quantity(value, self.metrics[metric].unit, digits, percent=True)

    def format_effort(self, spread: Spread) -> str:
        """Return an effort as text, such as `84 ms` or `4 320`."""
        return group_digits(round(spread.median)) if self.clock == UNKNOWNS else format_quantity(spread.median, "s", 3)


def spread_range(spread: Spread) -> str:
    """Return both quartiles as text, `[80–90 ms]`, with the unit once if it is the same; empty if they are equal."""
    low, high = format_quantity(spread.q1, "s", 3), format_quantity(spread.q3, "s", 3)
    if spread.q1 == spread.q3:
        return ""
    if low.split("\u00a0")[1:] == high.split("\u00a0")[1:]:
        low = low.split("\u00a0")[0]
    return f"[{low}–{high}]"


def views(comparison: ComparisonRecord) -> list[SceneView]:
    """Return a view for each scene of a comparison, or for each problem of a scene."""
    scenes = comparison.analysis.scenes
    titles = scene_titles(comparison.scenes, list(dict.fromkeys(own.scene for own in scenes.values())))
    members: dict[str, list[ComparedPoint]] = {part: [] for part in scenes}
    for p in comparison.points:
        members[p.part].append(p)
    return [
        SceneView(number, part, titles[own.scene], members[part], comparison.references.get(part) or {}, own)
        for number, (part, own) in enumerate(scenes.items())
    ]


def separate_problems_note(own: Sequence[SceneView]) -> str:
    """Return a note that configurations of different problems are not compared; empty for a single problem."""
    names = list(dict.fromkeys(f"`{name}`" for view in own for name in view.analysis.problem))
    if not names:
        return ""
    return f"The reference changes with {join_names(names)}: only configurations with the same value are compared."


def scene_titles(entries: Sequence[Json], names: Sequence[str]) -> dict[str, str]:
    """Return the title of each scene by its name.

    `entries` are the records of the scenes, and `names` the names by which configurations refer to them. Scenes
    with equal titles get the name of their file in brackets. A name without a record is its own title.
    """
    found, files = {}, {}
    for i, name in enumerate(names):
        fitting = [e for e in entries if name in _scene_names(e)]
        entry = fitting[0] if fitting else entries[i] if len(entries) == len(names) else {}
        found[name] = str(entry.get("title") or name)
        files[name] = str(entry.get("file") or name)
    twice = [title for title in found.values() if list(found.values()).count(title) > 1]
    return {n: f"{t} ({files[n]})" if t in twice else t for n, t in found.items()}


def _scene_names(entry: Json) -> set[str]:
    """Return the names by which configurations may refer to a scene."""
    file = str(entry.get("file") or "").replace("\\", "/").rpartition("/")[2]
    return {str(entry.get("name")), str(entry.get("title")), file, file.rpartition(".")[0]}


def status_of(status: str) -> str:
    """Return the status of a model in words, such as `timed out`."""
    return "timed out" if status == "timed_out" else status.replace("_", " ")
