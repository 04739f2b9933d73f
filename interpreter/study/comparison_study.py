"""A comparison from scenes to `softmark-compare/1`: expand, compute, time, analyse; every finished task is on disk.

Accuracy comes first and may run in parallel; timing follows, alone on the machine. Both are journalled, so that an
interrupted comparison goes on where it was.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softmark.interpreter.pipeline.run_environment import environment
from softmark.interpreter.results import json_validation
from softmark.interpreter.results.json_records import clean
from softmark.interpreter.results.state_results import SOLVED
from softmark.interpreter.study.analysis.comparison_point import part_of
from softmark.interpreter.study.configurations.configuration_expansion import (
    Additions,
    Configuration,
    SceneSubject,
    TooMany,
    expand,
    read_vary,
)
from softmark.interpreter.study.configurations.configuration_task import FINE, failed
from softmark.interpreter.study.configurations.reference_changes import marked
from softmark.interpreter.study.configurations.task_outcome import PointOutcome, PointTask
from softmark.interpreter.study.workers import worker_pool
from softmark.interpreter.study.workers.task_journal import Interrupted, Journal, JournalRefused
from softmark.interpreter.vocabulary.study_words import Convergence, Pareto, Sweep
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.study.analysis.comparison_record import Compared
    from softmark.interpreter.study.configurations.timing_job import TimingJob

__all__ = ["Comparison", "ComparisonRequest", "Interrupted", "TooMany", "compare"]

SCHEMA = "softmark-compare/1"
ACCURACY, TIMING = "accuracy", "timing"

Json = dict[str, Any]
Say = Callable[[str, str], None]


@dataclass(frozen=True)
class ComparisonRequest:
    """What is to be compared, and how. `timeout` in s for each task, None: no limit; `repeats` 0: no timing."""

    folder: Path
    vary: tuple[str, ...] = ()
    models: tuple[str, ...] = ()
    study: str | None = None
    jobs: int = 1
    cluster: str | None = None
    timeout: float | None = None
    repeats: int = 5
    resume: bool = False
    fresh: bool = False
    allow_contaminated: bool = False
    command: str = ""
    say: Say = field(default=lambda what, detail: None, repr=False)
    # told, once the journal is open, whom to ask what an interrupt would leave
    saying: Callable[[Callable[[], str]], None] = field(default=lambda words: None, repr=False)
    # told what is known of errors before times are measured, which takes longer
    accurate: Callable[[Compared], None] | None = field(default=None, repr=False)
    # scenes as they are declared, without what their studies vary, and without telling where the time goes
    plain: bool = False


@dataclass(frozen=True)
class Comparison:
    """What a comparison found, as JSON: `points`, one for each configuration, and the `analysis` of them.

    `found` has both as values.
    """

    points: list[Json]
    references: Json
    scenes: list[Json]
    studies: Json
    environment: Json
    command: str
    created: str
    found: Compared
    unsound: bool = False  # a reference failed somewhere

    @cached_property
    def analysis(self) -> Json:
        """What the points say."""
        return self.found.analysis.to_json()

    @property
    def exit_status(self) -> int:
        """3 where a model or a reference failed, did not converge or ran out of time, else 0."""
        return 3 if self.unsound or any(p["status"] not in FINE for p in self.points) else 0

    def to_json(self) -> Json:
        """The comparison as `softmark-compare/1`."""
        return {
            "schema": SCHEMA, "created": self.created, "environment": self.environment, "command": self.command,
            "scenes": self.scenes, "studies": self.studies, "points": self.points, "references": self.references,
            "analysis": self.analysis,
        }  # fmt: skip

    def dumps(self) -> str:
        """The JSON text."""
        return json.dumps(self.to_json(), indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def compare(subjects: Sequence[SceneSubject], request: ComparisonRequest) -> Comparison:
    """Carry a comparison out.

    Raises SceneError for names or values of the request that cannot be meant, Refused for a folder that cannot be used,
    pool.Unavailable if nobody can do the work, Interrupted, and OSError.
    """
    started = datetime.now(UTC)
    vary, models = read_vary(request.vary)
    chosen = (*request.models, *(m for m in models if m not in request.models))
    asked = Additions(vary, chosen, request.study, request.plain)
    configurations = expand(subjects, asked)
    with Journal.open(request.folder, request.fresh) as journal:
        tasks = {c.key: c.task for c in configurations if c.reason is None}
        request.say("journal", journal.remark)
        _refuse_mixing(journal, tasks, request)
        done = _Done(journal, frozenset(tasks))
        request.saying(done.words)
        try:
            outcomes = _accuracy(tasks, request, done)
            if request.accurate is not None and request.repeats:
                request.accurate(_comparison(subjects, configurations, outcomes, {}, request, started).found)
            costs = _timing(configurations, outcomes, request, journal)
        except KeyboardInterrupt as stop:
            raise Interrupted(done.words()) from stop
    request.say("analyse", "")
    return _comparison(subjects, configurations, outcomes, costs, request, started)


def _comparison(
    subjects: Sequence[SceneSubject], configurations: Sequence[Configuration], outcomes: Mapping[str, PointOutcome],
    costs: Json, request: ComparisonRequest, started: datetime,
) -> Comparison:  # fmt: skip
    """What is known by now: `costs` by key, empty before they are measured."""
    points = marked([_point(c, outcomes, costs) for c in configurations])
    references, unsound = _references(points, outcomes)
    saved: Json = {
        "points": points, "references": references, "scenes": [s.described() for s in subjects],
        "studies": {s.name: _studies(s) for s in subjects}, "environment": environment(started),
        "command": request.command, "created": started.isoformat(timespec="seconds"),
    }  # fmt: skip
    return Comparison(**saved, found=_analysed(saved, request), unsound=unsound)


def _refuse_mixing(journal: Journal, tasks: Mapping[str, PointTask], request: ComparisonRequest) -> None:
    finished = [key for key in journal.of_kind(ACCURACY) if key in tasks]
    if finished and not request.resume:
        count = f"{len(finished)} finished task" + ("s" if len(finished) > 1 else "")
        raise JournalRefused(
            f"{request.folder} holds {count} of this comparison; `--resume` goes on from there, `--fresh` starts anew"
        )


@dataclass
class _Done:
    """How far a comparison has come."""

    journal: Journal
    keys: frozenset[str]  # of all its tasks

    @property
    def count(self) -> int:
        """Tasks in the journal."""
        return len(self.keys & self.journal.on_disk(ACCURACY))

    def words(self) -> str:
        """For whoever has interrupted it."""
        kept = f"{self.count} of {len(self.keys)} tasks are in {self.journal.path}"
        return f"{kept}; the same command with `--resume` goes on"


# ------------------------------------------------------------------ accuracy


def _accuracy(tasks: Mapping[str, PointTask], request: ComparisonRequest, done: _Done) -> dict[str, PointOutcome]:
    """Outcomes by key: those of the journal, and what is computed now."""
    journal = done.journal
    sound = ({**e["outcome"], "key": k} for k, e in journal.of_kind(ACCURACY).items() if k in tasks and _sound(e))
    outcomes = {o.key: o for o in map(PointOutcome.from_json, sound) if not o.again(request.timeout)}
    labels = {key: f"{task.scene}: {task.model}" for key, task in tasks.items()}
    waiting = [task for key, task in tasks.items() if key not in outcomes]
    for outcome in _computed(waiting, request, lambda key: request.say("compute", labels[key])):
        journal.append(ACCURACY, outcome.key, outcome=outcome.to_json())
        outcomes[outcome.key] = outcome
        request.say("computed", f"{len(outcomes)} of {len(tasks)}: {labels[outcome.key]}")
    return outcomes


def _sound(entry: Json) -> bool:
    """Whether an entry of the journal has what is read from it: one that was damaged is computed or timed anew."""
    if json_validation.misfit(entry, json_validation.ENTRIES[entry["kind"]]) is not None:
        return False
    return entry["kind"] != TIMING or _counts(entry["record"])


def _counts(record: Json) -> bool:
    """Whether a record of a run alone gives a cost, or says that it has none."""
    from softmark.interpreter.study.analysis.timing_quality import cost

    try:
        cost([record])
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        return False
    return True


def _computed(
    waiting: Sequence[PointTask], request: ComparisonRequest, started: Callable[[str], None]
) -> Iterator[PointOutcome]:
    if not waiting:
        return iter(())
    if request.cluster is not None:
        return worker_pool.outcomes_of_cluster(waiting, request.cluster, request.timeout)
    return worker_pool.outcomes(waiting, request.jobs, request.timeout, started)


# ------------------------------------------------------------------ timing


def _timing(
    configurations: Sequence[Configuration],
    outcomes: Mapping[str, PointOutcome],
    request: ComparisonRequest,
    journal: Journal,
) -> Json:
    """Costs by key, of what was solved: measured alone on this machine, each process's record kept at once."""
    if request.repeats == 0:
        return {}
    from softmark.interpreter.study.timing.timing_rounds import timings

    jobs = [_job(c, request) for c in configurations if _solved(c, outcomes)]
    done = [entry["record"] for (kind, _, _), entry in journal.entries.items() if kind == TIMING and _sound(entry)]

    def keep(record: Json) -> None:
        journal.append(TIMING, str(record["key"]), record=clean(record))

    return timings(jobs, request.repeats, keep, done, request.say, phases=not request.plain)


def _solved(configuration: Configuration, outcomes: Mapping[str, PointOutcome]) -> bool:
    found = outcomes.get(configuration.key)
    return found is not None and found.status in SOLVED


def _job(configuration: Configuration, request: ComparisonRequest) -> TimingJob:
    from softmark.interpreter.study.configurations.timing_job import TimingJob

    task = configuration.task
    job = TimingJob(
        configuration.key, configuration.model, file=task.shown, text=task.text, folder=task.folder,
        overrides=task.overrides, label=f"{configuration.scene}: {configuration.label}", plugins=task.plugins,
    )  # fmt: skip
    return job if request.timeout is None else replace(job, timeout_s=request.timeout)


# ------------------------------------------------------------------ the result


def _point(configuration: Configuration, outcomes: Mapping[str, PointOutcome], costs: Mapping[str, Json]) -> Json:
    key = configuration.key
    outcome = failed(configuration.task, configuration.reason) if configuration.reason else outcomes[key]
    return {**configuration.described(), **outcome.point, "cost": costs.get(key)}


def _references(points: Sequence[Json], outcomes: Mapping[str, PointOutcome]) -> tuple[dict[str, Json], bool]:
    """References of each problem as its first configuration has them, or one that failed; and whether one did."""
    found: dict[str, Json] = {}
    unsound = False
    for p in points:
        part = part_of(p["scene"], p["problem"])
        for name, reference in (outcomes[p["key"]].references if p["key"] in outcomes else {}).items():
            own, lost = found.setdefault(part, {}), reference.status not in FINE
            if name not in own or (lost and own[name]["status"] in FINE):
                own[name] = reference.to_json()
            unsound |= lost
    return found, unsound


def _analysed(saved: Json, request: ComparisonRequest) -> Compared:
    from softmark.interpreter.study.analysis.comparison_analysis import Terms
    from softmark.interpreter.study.analysis.comparison_record import Compared

    return Compared.from_json(saved, Terms(request.allow_contaminated))


def _studies(subject: SceneSubject) -> Json:
    """The studies of a scene, for whoever analyses: sweeps, and what is asked of them."""
    found: Json = {}
    for name, declared in subject.scene.of_kind("study").items():
        match declared.thing:
            case Sweep(target=target, over=over, models=models, with_=other):
                found[name] = {
                    "kind": "sweep", "target": target.name, "over": [v.text for v in over],
                    "models": list(models) if models else None, "with": other,
                }  # fmt: skip
            case Convergence(metric=metric, over=sweep):
                found[name] = {"kind": "convergence", "metric": metric, "over": sweep}
            case Pareto(error=error, cost=cost, over=sweep):
                found[name] = {"kind": "pareto", "error": error, "cost": cost, "over": sweep}
    return found
