"""One scene of a comparison as the page and the terminal see it: its points, lines, looks, and words for numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

from softmark.interpreter.language.number_formatting import format_quantity, group_digits, is_negligible
from softmark.interpreter.report.charts.curve_styles import MODEL_DASHES, Look, model_look
from softmark.interpreter.report.page.html_markup import listed
from softmark.interpreter.results.json_records import Json
from softmark.interpreter.study.analysis.comparison_analysis import ErrorAnalysis, References, SceneAnalysis
from softmark.interpreter.study.analysis.comparison_point import UNKNOWNS, ComparedPoint, Spread
from softmark.interpreter.study.analysis.comparison_record import ComparisonRecord
from softmark.interpreter.study.analysis.refinement_lines import RefinementLine
from softmark.records import dataclass

CLOCKS = {"cpu_s": "CPU time", "wall_s": "wall time", UNKNOWNS: "unknowns"}


@dataclass(frozen=True)
class SceneView:
    """A scene with its share of the analysis."""

    number: int
    scene: str
    title: str
    points: Sequence[ComparedPoint]
    references: References
    analysis: SceneAnalysis

    @property
    def at(self) -> str:
        """`E = 30 kPa`: what changes what errors are measured from; empty where a scene is one problem."""
        return ", ".join(f"{name} = {value}" for name, value in self.analysis.problem.items())

    @property
    def heading(self) -> str:
        """Title of the scene, and the problem that it is about."""
        return f"{self.title}, {self.at}" if self.at else self.title

    @property
    def metrics(self) -> Mapping[str, ErrorAnalysis]:
        """Error metrics with what the analysis says of them."""
        return self.analysis.metrics

    @cached_property
    def measurements(self) -> Mapping[str, str]:
        """Metrics that are no error against anything, with their units: they are shown, and rank nothing."""
        entries = ((n, e) for p in self.points for n, e in p.errors.items() if n not in self.metrics)
        return {name: str(found.unit) for name, found in entries}

    @cached_property
    def _moved(self) -> float:
        """The largest metric that is a length, m: the scale of rounding."""
        values = (e.value for p in self.points for e in p.errors.values() if e.unit == "m" and e.value is not None)
        return max(map(abs, values), default=0.0)

    def measured(self, point: ComparedPoint, metric: str) -> str:
        """The value of such a metric in words."""
        value = point.metric(metric).value
        unit = self.measurements[metric]
        if value is None:
            return "–"
        return "0" if is_negligible(value, 0.0, unit, self._moved) else format_quantity(value, unit, 6, percent=True)

    @property
    def without_advice(self) -> str:
        """Why nothing is recommended where no sentence says so."""
        if not self.points:
            return "No configuration was computed."
        return "No error was measured, as no metric is `against` a reference: nothing can be recommended."

    @property
    def lines(self) -> Sequence[RefinementLine]:
        """Lines of models over their refinement."""
        return self.analysis.lines

    @property
    def clock(self) -> str:
        """Which effort configurations are compared by."""
        return self.analysis.clock

    @property
    def effort_name(self) -> str:
        """`CPU time`, as a heading."""
        name = CLOCKS.get(self.clock, self.clock)
        return name[:1].upper() + name[1:]

    @property
    def timed(self) -> bool:
        """Whether anything was timed."""
        return self.clock != UNKNOWNS

    @cached_property
    def by_key(self) -> dict[str, ComparedPoint]:
        """Points by key; of one configuration in several studies, the first."""
        return {p.key: p for p in reversed(self.points)}

    @cached_property
    def once(self) -> list[ComparedPoint]:
        """Its points, each label of a key once."""
        return list({(p.key, p.label): p for p in reversed(self.points)}.values())[::-1]

    @cached_property
    def looks(self) -> list[Look]:
        """A look for each line: colour and marker by its model, dash by its place among the model's lines."""
        models = {model: i for i, model in enumerate(dict.fromkeys(line.model for line in self.lines))}
        seen: dict[str, int] = {}
        found = []
        for line in self.lines:
            place = seen.setdefault(line.model, 0)
            seen[line.model] += 1
            found.append(replace(model_look(models[line.model]), dash=MODEL_DASHES[place % len(MODEL_DASHES)]))
        return found

    def effort(self, point: ComparedPoint) -> Spread | None:
        """What a point took."""
        return point.effort(self.clock)

    def on_fronts(self, point: ComparedPoint) -> list[str]:
        """Errors by which a point is on the front."""
        return [name for name, own in self.metrics.items() if point.key in own.front]

    def disturbed(self, point: ComparedPoint) -> bool:
        """Whether its timing was disturbed, where that matters."""
        return self.timed and point.cost.contaminated

    def amount(self, value: float, metric: str, digits: int = 3) -> str:
        """An error in words."""
        return format_quantity(value, self.metrics[metric].unit, digits, percent=True)

    def said_effort(self, spread: Spread) -> str:
        """`84 ms`, or `4 320`."""
        return group_digits(round(spread.median)) if self.clock == UNKNOWNS else format_quantity(spread.median, "s", 3)


def spread_range(spread: Spread) -> str:
    """`[80–90 ms]`, the unit once if it is the same; empty where there is no spread."""
    low, high = format_quantity(spread.q1, "s", 3), format_quantity(spread.q3, "s", 3)
    if spread.q1 == spread.q3:
        return ""
    if low.split("\u00a0")[1:] == high.split("\u00a0")[1:]:
        low = low.split("\u00a0")[0]
    return f"[{low}–{high}]"


def views(comparison: ComparisonRecord) -> list[SceneView]:
    """The scenes of a comparison."""
    scenes = comparison.analysis.scenes
    titles = scene_titles(comparison.scenes, list(dict.fromkeys(own.scene for own in scenes.values())))
    members: dict[str, list[ComparedPoint]] = {part: [] for part in scenes}
    for p in comparison.points:
        members[p.part].append(p)
    return [
        SceneView(number, part, titles[own.scene], members[part], comparison.references.get(part) or {}, own)
        for number, (part, own) in enumerate(scenes.items())
    ]


def apart(own: Sequence[SceneView]) -> str:
    """That configurations of different problems do not compete; empty where all are of one."""
    names = list(dict.fromkeys(f"`{name}`" for view in own for name in view.analysis.problem))
    if not names:
        return ""
    return f"What errors are measured from changes with {listed(names)}: only configurations of one value compete."


def scene_titles(entries: Sequence[Json], names: Sequence[str]) -> dict[str, str]:
    """Titles by the names that points use, with the file where two are the same; the name where no scene fits."""
    found, files = {}, {}
    for i, name in enumerate(names):
        fitting = [e for e in entries if name in _called(e)]
        entry = fitting[0] if fitting else entries[i] if len(entries) == len(names) else {}
        found[name] = str(entry.get("title") or name)
        files[name] = str(entry.get("file") or name)
    twice = [title for title in found.values() if list(found.values()).count(title) > 1]
    return {n: f"{t} ({files[n]})" if t in twice else t for n, t in found.items()}


def _called(entry: Json) -> set[str]:
    """What a scene may be called."""
    file = str(entry.get("file") or "").replace("\\", "/").rpartition("/")[2]
    return {str(entry.get("name")), str(entry.get("title")), file, file.rpartition(".")[0]}


def status_of(status: str) -> str:
    """In words."""
    return "out of time" if status == "timed_out" else status.replace("_", " ")
