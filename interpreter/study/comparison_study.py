"""Comparison of configurations: from scenes to the result `softmark-compare/1`.

The steps are: expand scenes to configurations, compute results, measure times, analyse. Results are computed first,
possibly in parallel. Times are measured afterwards, one process at a time. Results and times are saved in a journal on
disk, so that an interrupted comparison continues where it stopped.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softmark.interpreter.pipeline.run_environment import describe_environment
from softmark.interpreter.results import json_validation
from softmark.interpreter.results.json_records import to_plain_json
from softmark.interpreter.results.state_results import SOLVED
from softmark.interpreter.study.analysis.comparison_point import competition_group_name
from softmark.interpreter.study.configurations.configuration_expansion import (
    CommandLineAdditions,
    Configuration,
    SceneSubject,
    TooManyConfigurations,
    expand,
    read_vary,
)
from softmark.interpreter.study.configurations.configuration_task import FINE, failed_outcome
from softmark.interpreter.study.configurations.reference_changes import mark_problems
from softmark.interpreter.study.configurations.task_outcome import PointOutcome, PointTask
from softmark.interpreter.study.workers import worker_pool
from softmark.interpreter.study.workers.task_journal import Interrupted, Journal, JournalRefused
from softmark.interpreter.vocabulary.study_words import Convergence, Pareto, Sweep
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.study.analysis.comparison_record import ComparisonRecord
    from softmark.interpreter.study.configurations.timing_job import TimingJob

__all__ = ["Comparison", "ComparisonRequest", "Interrupted", "TooManyConfigurations", "compare"]

SCHEMA = "softmark-compare/1"
ACCURACY, TIMING = "accuracy", "timing"

Json = dict[str, Any]
Say = Callable[[str, str], None]


@dataclass(frozen=True)
class ComparisonRequest:
    """Settings of a comparison.

    `timeout` is the time limit of each task, s, or None for no limit. With `repeats` 0 nothing is timed.
    """

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
    # called when the journal opens, with a function that describes the progress
    saying: Callable[[Callable[[], str]], None] = field(default=lambda words: None, repr=False)
    # called with the errors before timing, which takes longer
    accurate: Callable[[ComparisonRecord], None] | None = field(default=None, repr=False)
    # scenes as declared, without variations of their studies and without times of phases
    plain: bool = False


@dataclass(frozen=True)
class Comparison:
    """Results of a comparison: one JSON entry in `points` for each configuration, and the analysis.

    `found` has the same results and their analysis as objects.
    """

    points: list[Json]
    references: Json
    scenes: list[Json]
    studies: Json
    environment: Json
    command: str
    created: str
    found: ComparisonRecord
    unsound: bool = False  # a reference failed somewhere

    @cached_property
    def analysis(self) -> Json:
        """Analysis of all configurations as JSON."""
        return self.found.analysis.to_json()

    @property
    def exit_status(self) -> int:
        """Exit status: 3 if a model or a reference failed, did not converge or ran out of time, else 0."""
        return 3 if self.unsound or any(p["status"] not in FINE for p in self.points) else 0

    def to_json(self) -> Json:
        """Return the comparison as JSON of the schema `softmark-compare/1`."""
        return {
            "schema": SCHEMA, "created": self.created, "environment": self.environment, "command": self.command,
            "scenes": self.scenes, "studies": self.studies, "points": self.points, "references": self.references,
            "analysis": self.analysis,
        }  # fmt: skip

    def dumps(self) -> str:
        """Return the comparison as JSON text."""
        return json.dumps(self.to_json(), indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def compare(subjects: Sequence[SceneSubject], request: ComparisonRequest) -> Comparison:
    """Run a comparison: compute and time all configurations, and analyse them.

    Raises SceneError for invalid names or values of the request, JournalRefused for an unusable folder, NoWorkers if no
    worker is available, Interrupted, and OSError.
    """
    started = datetime.now(UTC)
    vary, models = read_vary(request.vary)
    chosen = (*request.models, *(m for m in models if m not in request.models))
    asked = CommandLineAdditions(vary, chosen, request.study, request.plain)
    configurations = expand(subjects, asked)
    with Journal.open(request.folder, request.fresh) as journal:
        tasks = {c.key: c.task for c in configurations if c.reason is None}
        request.say("journal", journal.remark)
        _check_resume_option(journal, tasks, request)
        done = _SavedTasks(journal, frozenset(tasks))
        request.saying(done.words)
        try:
            outcomes = _compute_outcomes(tasks, request, done)
            if request.accurate is not None and request.repeats:
                request.accurate(_comparison(subjects, configurations, outcomes, {}, request, started).found)
            costs = _time_configurations(configurations, outcomes, request, journal)
        except KeyboardInterrupt as stop:
            raise Interrupted(done.words()) from stop
    request.say("analyse", "")
    return _comparison(subjects, configurations, outcomes, costs, request, started)


def _comparison(
    subjects: Sequence[SceneSubject], configurations: Sequence[Configuration], outcomes: Mapping[str, PointOutcome],
    costs: Json, request: ComparisonRequest, started: datetime,
) -> Comparison:  # fmt: skip
    """Return the comparison with the results so far.

    `costs` are the timing results by key; the mapping is empty before anything is timed.
    """
    points = mark_problems([_point_entry(c, outcomes, costs) for c in configurations])
    references, unsound = _references_and_failure(points, outcomes)
    saved: Json = {
        "points": points, "references": references, "scenes": [s.scene_entries() for s in subjects],
        "studies": {s.name: _studies_to_json(s) for s in subjects}, "environment": describe_environment(started),
        "command": request.command, "created": started.isoformat(timespec="seconds"),
    }  # fmt: skip
    return Comparison(**saved, found=_analyse(saved, request), unsound=unsound)


def _check_resume_option(journal: Journal, tasks: Mapping[str, PointTask], request: ComparisonRequest) -> None:
    finished = [key for key in journal.of_kind(ACCURACY) if key in tasks]
    if finished and not request.resume:
        count = f"{len(finished)} finished task" + ("s" if len(finished) > 1 else "")
        raise JournalRefused(
            f"{request.folder} contains {count} of this comparison; continue with `--resume`, or start again with "
            f"`--fresh`"
        )


@dataclass
class _SavedTasks:
    """Tasks of a comparison, by key, and the journal that saves each one when it is finished."""

    journal: Journal
    keys: frozenset[str]  # number of all tasks

    @property
    def count(self) -> int:
        """Number of tasks that are finished and saved in the journal."""
        return len(self.keys & self.journal.on_disk(ACCURACY))

    def words(self) -> str:
        """Return a sentence for an interrupted user: the number of saved tasks, and how to continue with `--resume`."""
        kept = f"{self.count} of {len(self.keys)} tasks are saved in {self.journal.path}"
        return f"{kept}; continue with the same command and `--resume`"


# ------------------------------------------------------------------ accuracy


def _compute_outcomes(
    tasks: Mapping[str, PointTask], request: ComparisonRequest, done: _SavedTasks
) -> dict[str, PointOutcome]:
    """Return the outcomes of all tasks by key, read from the journal or computed now."""
    journal = done.journal
    sound = ({**e["outcome"], "key": k} for k, e in journal.of_kind(ACCURACY).items() if k in tasks and _is_complete(e))
    outcomes = {o.key: o for o in map(PointOutcome.from_json, sound) if not o.is_worth_retrying(request.timeout)}
    labels = {key: f"{task.scene}: {task.model}" for key, task in tasks.items()}
    waiting = [task for key, task in tasks.items() if key not in outcomes]
    for outcome in _run_tasks(waiting, request, lambda key: request.say("compute", labels[key])):
        journal.append(ACCURACY, outcome.key, outcome=outcome.to_json())
        outcomes[outcome.key] = outcome
        request.say("computed", f"{len(outcomes)} of {len(tasks)}: {labels[outcome.key]}")
    return outcomes


def _is_complete(entry: Json) -> bool:
    """Return whether an entry of the journal is complete.

    A damaged entry is ignored, and its task is computed or timed again.
    """
    if json_validation.find_misfit(entry, json_validation.ENTRIES[entry["kind"]]) is not None:
        return False
    return entry["kind"] != TIMING or _is_valid_record(entry["record"])


def _is_valid_record(record: Json) -> bool:
    """Return whether a timing record can be summarized without an error."""
    from softmark.interpreter.study.analysis.timing_quality import summarize_cost

    try:
        summarize_cost([record])
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        return False
    return True


def _run_tasks(
    waiting: Sequence[PointTask], request: ComparisonRequest, started: Callable[[str], None]
) -> Iterator[PointOutcome]:
    if not waiting:
        return iter(())
    if request.cluster is not None:
        return worker_pool.run_tasks_on_cluster(waiting, request.cluster, request.timeout)
    return worker_pool.run_tasks(waiting, request.jobs, request.timeout, started)


# ------------------------------------------------------------------ timing


def _time_configurations(
    configurations: Sequence[Configuration],
    outcomes: Mapping[str, PointOutcome],
    request: ComparisonRequest,
    journal: Journal,
) -> Json:
    """Return the timing results of all solved configurations by key.

    Configurations are timed one at a time on this machine. Each record is saved in the journal at once.
    """
    if request.repeats == 0:
        return {}
    from softmark.interpreter.study.timing.timing_rounds import time_jobs

    jobs = [_timing_job(c, request) for c in configurations if _is_solved(c, outcomes)]
    done = [
        entry["record"] for (kind, _, _), entry in journal.entries.items() if kind == TIMING and _is_complete(entry)
    ]

    def keep(record: Json) -> None:
        journal.append(TIMING, str(record["key"]), record=to_plain_json(record))

    return time_jobs(jobs, request.repeats, keep, done, request.say, phases=not request.plain)


def _is_solved(configuration: Configuration, outcomes: Mapping[str, PointOutcome]) -> bool:
    found = outcomes.get(configuration.key)
    return found is not None and found.status in SOLVED


def _timing_job(configuration: Configuration, request: ComparisonRequest) -> TimingJob:
    from softmark.interpreter.study.configurations.timing_job import TimingJob

    task = configuration.task
    job = TimingJob(
        configuration.key, configuration.model, file=task.shown, text=task.text, folder=task.folder,
        overrides=task.overrides, label=f"{configuration.scene}: {configuration.label}", plugins=task.plugins,
    )  # fmt: skip
    return job if request.timeout is None else replace(job, timeout_s=request.timeout)


# ------------------------------------------------------------------ the result


def _point_entry(configuration: Configuration, outcomes: Mapping[str, PointOutcome], costs: Mapping[str, Json]) -> Json:
    key = configuration.key
    outcome = failed_outcome(configuration.task, configuration.reason) if configuration.reason else outcomes[key]
    return {**configuration.identity_entries(), **outcome.point, "cost": costs.get(key)}


def _references_and_failure(
    points: Sequence[Json], outcomes: Mapping[str, PointOutcome]
) -> tuple[dict[str, Json], bool]:
    """Return the references of each group of configurations, and whether any reference failed.

    A reference is taken from the first configuration of the group that has it, or from one where it failed.
    """
    found: dict[str, Json] = {}
    unsound = False
    for p in points:
        part = competition_group_name(p["scene"], p["problem"])
        for name, reference in (outcomes[p["key"]].references if p["key"] in outcomes else {}).items():
            own, lost = found.setdefault(part, {}), reference.status not in FINE
            if name not in own or (lost and own[name]["status"] in FINE):
                own[name] = reference.to_json()
            unsound |= lost
    return found, unsound


def _analyse(saved: Json, request: ComparisonRequest) -> ComparisonRecord:
    from softmark.interpreter.study.analysis.comparison_analysis import ComparisonTerms
    from softmark.interpreter.study.analysis.comparison_record import ComparisonRecord

    return ComparisonRecord.from_json(saved, ComparisonTerms(request.allow_contaminated))


def _studies_to_json(subject: SceneSubject) -> Json:
    """Return the studies of a scene as JSON for the analysis: sweeps, convergence studies and Pareto studies."""
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
