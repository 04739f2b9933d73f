"""Run of robustness studies: first all models along all quantities at once, to keep workers busy, then the maps."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from softmark.interpreter.language.compiled_scene import Declared, Scene, SceneError
from softmark.interpreter.pipeline.run_environment import describe_environment
from softmark.interpreter.planning.declaration_dependencies import with_dependencies
from softmark.interpreter.planning.parameter_walk import PointClass, Walk
from softmark.interpreter.planning.robustness_plan import (
    ResolvedStudy,
    find_judging_metrics,
    no_judge_error,
    resolve_study,
)
from softmark.interpreter.planning.varied_quantities import Value, WalkedQuantity
from softmark.interpreter.study.configurations.configuration_expansion import SceneSubject
from softmark.interpreter.study.robustness import validity_maps
from softmark.interpreter.study.robustness.point_classification import classify
from softmark.interpreter.study.robustness.reference_uncertainty import LeanOutcome, uncertainty_of
from softmark.interpreter.study.robustness.robustness_points import Values, VariedScene
from softmark.interpreter.study.robustness.robustness_record import (
    ClassifiedPoint,
    PairMap,
    Robustness,
    RobustnessPoint,
    RobustnessStudyRecord,
    ValidityEdge,
)
from softmark.interpreter.study.robustness.task_queue import KIND, TaskQueue
from softmark.interpreter.study.robustness.validity_edges import edge_of, make_choice_edge
from softmark.interpreter.study.workers.task_journal import Interrupted, Journal, JournalRefused
from softmark.interpreter.validation.requested_names import at_name, unknown_models
from softmark.interpreter.vocabulary.study_words import RobustnessStudy
from softmark.records import dataclass

TIMEOUT = 60.0  # CPU s for a point
MEMORY = 4.0  # GiB for a worker

Say = Callable[[str, str], None]
Then = Callable[[ClassifiedPoint], None]


@dataclass(frozen=True)
class RobustnessRequest:
    """Settings of robustness studies: `timeout`, s of CPU time per solution, and `memory`, GiB per worker."""

    folder: Path
    models: tuple[str, ...] = ()
    study: str | None = None
    jobs: int = 1
    timeout: float = TIMEOUT
    memory: float = MEMORY
    resume: bool = False
    fresh: bool = False
    command: str = ""
    say: Say = field(default=lambda what, detail: None, repr=False)


def run_robustness_studies(subject: SceneSubject, request: RobustnessRequest) -> Robustness:
    """Run the robustness studies of a scene; if it declares none, run one that varies every number.

    Raises SceneError for an invalid request, JournalRefused for an unusable folder, NoWorkers if no worker starts,
    Interrupted, and OSError.
    """
    started = datetime.now(UTC)
    asked = _requested_studies(subject.scene, request)
    with Journal.open(request.folder, request.fresh) as journal:
        request.say("journal", journal.remark)
        if journal.of_kind(KIND) and not request.resume:
            count = len(journal.of_kind(KIND))
            raise JournalRefused(
                f"{request.folder} contains {count} finished points; continue with `--resume`, or start again with "
                f"`--fresh`"
            )
        desk = TaskQueue(journal, request.jobs, request.timeout, request.memory, lambda n, key: None)
        trials = [StudyTrial(VariedScene(subject, one), desk, request.say) for one in asked]
        try:
            for stage in (StudyTrial.start, StudyTrial.request_map_points):
                for trial in trials:
                    stage(trial)
                desk.work()
        except KeyboardInterrupt as stop:
            kept = f"{len(journal.on_disk(KIND))} points are saved in {journal.path}"
            raise Interrupted(f"{kept}; continue with the same command and `--resume`") from stop
    created, studies = started.isoformat(timespec="seconds"), tuple(t.make_record() for t in trials)
    return Robustness.of(created, describe_environment(started), request.command, subject.scene_entries(), studies)


def _requested_studies(scene: Scene, request: RobustnessRequest) -> list[ResolvedStudy]:
    """Return the requested robustness studies of a scene. Raises SceneError."""
    problems = unknown_models(scene, request.models)
    own = {n: d for n, d in scene.of_kind("study").items() if isinstance(d.thing, RobustnessStudy)}
    if request.study is not None and request.study not in own:
        help = f"studies: {', '.join(own)}" if own else "it declares none; omit `--study` to vary every number"
        message = f"`{request.study}` is not a robustness study of the scene"
        problems.append(at_name("--study", request.study, "E201", message, "not found", help))
    if not own and not list(find_judging_metrics(scene)):
        problems.append(no_judge_error(scene, None, "dsl robustness"))
    if problems:
        raise SceneError(problems)
    wanted: list[Declared | None] = [d for n, d in own.items() if request.study in (None, n)]
    return [resolve_study(scene, study, request.models) for study in wanted or [None]]


# ------------------------------------------------------------------ one study


@dataclass
class StudyTrial:
    """State of one robustness study while it runs: requested and classified solutions, and walks.

    A walk varies one quantity in one direction until the model fails.
    """

    ground: VariedScene
    desk: TaskQueue
    say: Say
    points: dict[tuple[Values, str], RobustnessPoint] = field(default_factory=dict)
    walks: dict[tuple[str, str], list[Walk]] = field(default_factory=dict)  # by model and quantity
    chosen: dict[tuple[str, str], dict[str, ClassifiedPoint]] = field(default_factory=dict)
    outlines: dict[str, str] = field(default_factory=dict)

    @property
    def asked(self) -> ResolvedStudy:
        """Settings of the study: its models, varied quantities and metric."""
        return self.ground.asked

    def start(self) -> None:
        """Request the result of every model in the unchanged scene; each result starts the walks of its model.

        A walk varies one quantity in one direction until the model fails.
        """
        for model in self.asked.models:
            self.look(model, {}, partial(self._start_walks, model))

    def _start_walks(self, model: str, nominal: ClassifiedPoint) -> None:
        for quantity in self.asked.quantities:
            if not self._is_dependent_on(model, quantity):
                continue
            if quantity.options:
                self._request_options(model, quantity, nominal)
            for ladder in quantity.ladders:
                walk = Walk(ladder, self.asked.until, {0.0: PointClass.of(nominal.word, nominal.status)})
                self.walks.setdefault((model, quantity.name), []).append(walk)
                self._continue_walk(model, quantity, walk)

    def _continue_walk(self, model: str, quantity: WalkedQuantity, walk: Walk) -> None:
        """Request the solution at the next position of a walk, and go on after each outcome until it is complete."""
        t = walk.next_position()
        if t is None:
            return

        def told(found: ClassifiedPoint) -> None:
            walk.record_outcome(t, PointClass.of(found.word, found.status))
            self._continue_walk(model, quantity, walk)

        self.look(model, {quantity.name: walk.ladder.at(t)}, told)

    def _request_options(self, model: str, quantity: WalkedQuantity, nominal: ClassifiedPoint) -> None:
        seen = self.chosen.setdefault((model, quantity.name), {str(quantity.nominal): nominal})
        for option in quantity.options:
            if option != quantity.nominal:
                self.look(model, {quantity.name: option}, lambda found, o=option: seen.update({o: found}))  # type: ignore[misc]

    def _is_dependent_on(self, model: str, quantity: WalkedQuantity) -> bool:
        """Return whether the result of a model depends on a quantity.

        It depends on it if the key of the model changes with the quantity, or if this cannot be determined.
        """
        scene = self.ground.subject.scene
        owner = quantity.name.rpartition(".")[0]
        if quantity.name not in scene.parameters and scene.declared[owner].kind == "model":
            return owner in with_dependencies(scene, [model])
        ends: list[Value] = [ladder.at(t) for ladder in quantity.ladders for t in ladder.rungs]
        tried = (self.ground.values({quantity.name: v}) for v in (*ends, *quantity.options))
        sound = next((v for v in tried if v and not self.ground.scene_at(v).errors), None)
        return sound is None or self.ground.task(sound, model).key != self.ground.task((), model).key

    # ------------------------------------------------------------------ one point

    def look(self, model: str, changed: Mapping[str, Value], then: Then) -> None:
        """Request the class of a model with changed values, and call `then` with it when it is available."""
        values = self.ground.values(changed)
        known = self.points.get((values, model))
        refused = self.ground.refusal(values, model) if known is None else None
        if known is not None:
            self.desk.soon(lambda: then(known.found))
        elif refused is not None:
            self.desk.soon(lambda: then(self._record_point(values, model, refused, None)))
        else:
            task = self.ground.task(values, model)
            self.desk.ask(task, lambda outcome: then(self._classify_outcome(values, model, outcome)))

    def _classify_outcome(self, values: Values, model: str, outcome: LeanOutcome) -> ClassifiedPoint:
        asked, site = self.asked, self.ground.scene_at(values)
        numerical = uncertainty_of(outcome, asked.against, asked.probe, asked.metric)
        uncertainty = None if numerical is None and not site.theory else (numerical or 0.0) + site.theory
        found = classify(outcome, asked.metric, asked.within, uncertainty, site.doubt)
        self.outlines.setdefault(model, outcome.point.outline)
        return self._record_point(values, model, found, outcome.cpu_s)

    def _record_point(self, values: Values, model: str, found: ClassifiedPoint, cpu_s: float | None) -> ClassifiedPoint:
        texts, key = self.ground.texts(values), self.ground.task(values, model).key
        self.points.setdefault((values, model), RobustnessPoint(model, dict(values), found, texts, key, cpu_s))
        silent = sum(p.found.word == "silent" for p in self.points.values())
        told = ", ".join((model, *(f"{n} = {t}" for n, t in texts.items())))
        warned = f", {silent} SILENT" if silent else ""
        self.say("stress", f"{self.asked.name}: {len(self.points)} points{warned}; {told}: {found.word}")
        return found

    # ------------------------------------------------------------------ maps

    def request_map_points(self) -> None:
        """Request the solutions at all grid points of all validity maps."""
        for model, x, y, xs, ys in self._map_grids():
            for a in xs:
                for b in ys:
                    self.look(model, {x.name: a, y.name: b}, lambda found: None)

    def _map_grids(self) -> list[tuple[str, WalkedQuantity, WalkedQuantity, list[Value], list[Value]]]:
        if not self.asked.mapped:
            return []
        found = []
        for x, y in validity_maps.quantity_pairs(self.asked.quantities):
            for model in self.asked.models:
                if self._is_dependent_on(model, x) and self._is_dependent_on(model, y):
                    found.append((model, x, y, self._grid_levels(x), self._grid_levels(y)))
        return found

    def _grid_levels(self, quantity: WalkedQuantity) -> list[Value]:
        return validity_maps.grid_levels(
            quantity, [w for (_, name), own in self.walks.items() if name == quantity.name for w in own]
        )

    # ------------------------------------------------------------------ the result

    def _known_class_at(self, model: str, name: str, value: Value) -> ClassifiedPoint | None:
        known = self.points.get((self.ground.values({name: value}), model))
        return known.found if known else None

    def make_record(self) -> RobustnessStudyRecord:
        """Return the results of the study as a record."""
        asked, quantities = self.asked, tuple(replace(q, ladders=()) for q in self.asked.quantities)
        return RobustnessStudyRecord(
            asked.name,
            asked.metric,
            asked.against,
            asked.within,
            asked.until,
            asked.models,
            self.outlines,
            quantities,
            tuple(sorted(self.points.values(), key=self._point_sort_key)),
            tuple(self._validity_edges()),
            tuple(self._validity_maps()),
        )

    def _point_sort_key(self, point: RobustnessPoint) -> tuple[Any, ...]:
        """Return a sort key for solved configurations, which does not depend on the order of computation."""
        names = [q.name for q in self.asked.quantities]
        own = sorted((names.index(n), isinstance(v, str), v) for n, v in point.values.items())
        return self.asked.models.index(point.model), len(own), own

    def _validity_edges(self) -> list[ValidityEdge]:
        found: list[ValidityEdge] = []
        models = self.asked.models
        for model in models:
            for quantity in self.asked.quantities:
                for walk in self.walks.get((model, quantity.name), ()):
                    others = self._walks_of_other_models(model, quantity, walk)
                    found.append(edge_of(model, quantity, walk, self._known_class_at, self.outlines, others))
                if seen := self.chosen.get((model, quantity.name)):
                    found.append(make_choice_edge(model, quantity, seen, self._known_class_at, self.outlines, models))
        return found

    def _walks_of_other_models(self, model: str, quantity: WalkedQuantity, walk: Walk) -> dict[str, Walk]:
        """Return the walks of the other models, by model, along the same quantity in the same direction."""
        return {
            other: own for other in self.asked.models if other != model
            for own in self.walks.get((other, quantity.name), ()) if own.ladder.direction == walk.ladder.direction
        }  # fmt: skip

    def _validity_maps(self) -> list[PairMap]:
        found = []
        for model, x, y, xs, ys in self._map_grids():
            places = {(a, b): (self.ground.values({x.name: a, y.name: b}), model) for a in xs for b in ys}
            known = {at: self.points[place].found for at, place in places.items() if place in self.points}
            found.append(validity_maps.map_of(model, x, y, xs, ys, known))
        return found
