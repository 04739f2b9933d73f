"""Queue of tasks for worker processes, with callbacks that receive their outcomes.

Several callers may request one point. It is computed once, and never again while its journal exists.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from softmark.interpreter.results import json_validation
from softmark.interpreter.study.configurations.task_outcome import PointTask
from softmark.interpreter.study.robustness.reference_uncertainty import LeanOutcome, reduce_outcome
from softmark.interpreter.study.workers import worker_pool
from softmark.interpreter.study.workers.task_journal import Journal

Then = Callable[[LeanOutcome], None]
KIND = "stress"  # kind of its entries in the journal
PATIENCE = 10.0  # ratio of the wall time limit to the CPU time limit


@dataclass
class TaskQueue:
    """Queue of tasks for worker processes, with the outcomes so far, by key, and the callbacks that wait for others.

    `memory` is the limit of each worker, GiB, `timeout` the CPU time of each task, s.
    """

    journal: Journal
    jobs: int
    timeout: float
    memory: float
    said: Callable[[int, str], None]  # called with the number of outcomes and the last one
    outcomes: dict[str, LeanOutcome] = field(default_factory=dict)
    _queue: deque[PointTask] = field(default_factory=deque)
    _waiting: dict[str, list[Then]] = field(default_factory=dict)
    _asked: dict[str, PointTask] = field(default_factory=dict)  # description of a key, for readers of the journal
    _ready: deque[Callable[[], None]] = field(default_factory=deque)

    def __post_init__(self) -> None:
        entries = self.journal.of_kind(KIND).items()
        sound = {
            key: entry["outcome"]
            for key, entry in entries
            if json_validation.find_misfit(entry, json_validation.ENTRIES[KIND]) is None
        }
        known = {key: LeanOutcome.from_json({**outcome, "key": key}) for key, outcome in sound.items()}
        self.outcomes = {key: o for key, o in known.items() if not o.is_worth_retrying(self.timeout)}

    def soon(self, action: Callable[[], None]) -> None:
        """Run an action after the current one has finished, so that chains of callbacks do not recurse deeply."""
        self._ready.append(action)

    def ask(self, task: PointTask, then: Then) -> None:
        """Request a task and call `then` with its outcome when it is available."""
        key = task.key
        if key in self.outcomes:
            self.soon(lambda: then(self.outcomes[key]))
        elif key in self._waiting:
            self._waiting[key].append(then)
        else:
            self._waiting[key] = [then]
            self._asked[key] = task
            self._queue.append(task)

    def work(self) -> None:
        """Run all requested tasks, including those that callbacks add. Raises NoWorkers, OSError."""
        self._run_ready_actions()
        command = (*worker_pool.WORKER, f"{self.memory:g}")
        while self._queue:
            for outcome in worker_pool.run_tasks(
                self._queue, self.jobs, self.timeout, command=command, patience=PATIENCE
            ):
                self._save_outcome(reduce_outcome(outcome))
                self._run_ready_actions()

    def _save_outcome(self, outcome: LeanOutcome) -> None:
        key, asked = outcome.key, self._asked.pop(outcome.key)
        self.journal.append(KIND, key, outcome=outcome.to_json(), model=asked.model, overrides=list(asked.overrides))
        self.outcomes[key] = outcome
        for then in self._waiting.pop(key):
            self.soon(lambda then=then: then(outcome))  # type: ignore[misc]
        self.said(len(self.outcomes), key)

    def _run_ready_actions(self) -> None:
        while self._ready:
            self._ready.popleft()()
