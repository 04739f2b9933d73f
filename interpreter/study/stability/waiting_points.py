"""Who wants to know which point: tasks wait here for workers, and those who asked for the outcomes.

Several may ask for one point; it is computed once, and never again while its journal is there.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from softmark.interpreter.study.stability.truth import lean
from softmark.interpreter.study.workers import pool
from softmark.interpreter.study.workers.journal import Journal

Json = dict[str, Any]
Then = Callable[[Json], None]
KIND = "stress"  # of its entries in the journal
PATIENCE = 10.0  # times the CPU time of a point that it may take by the clock


@dataclass
class Desk:
    """Outcomes by key, tasks that wait, who is told. `memory` in GiB and `timeout` in CPU s of each task."""

    journal: Journal
    jobs: int
    timeout: float
    memory: float
    said: Callable[[int, str], None]  # how many outcomes there are, and the last
    outcomes: dict[str, Json] = field(default_factory=dict)
    _queue: deque[Json] = field(default_factory=deque)
    _waiting: dict[str, list[Then]] = field(default_factory=dict)
    _asked: dict[str, Json] = field(default_factory=dict)  # what a key stands for, for who reads the journal
    _ready: deque[Callable[[], None]] = field(default_factory=deque)

    def __post_init__(self) -> None:
        known = {key: entry["outcome"] for key, entry in self.journal.of_kind(KIND).items()}
        self.outcomes = {key: o for key, o in known.items() if not self._again(o)}

    def _again(self, outcome: Json) -> bool:
        """Whether an outcome of the journal is worth another try: it may have more time or memory now."""
        if not outcome.get("unfinished"):
            return False
        timed_out = outcome["point"]["status"] == "timed_out"
        return not timed_out or self.timeout > float(outcome.get("limit_s") or 0.0)

    def soon(self, action: Callable[[], None]) -> None:
        """Do something when whoever is working now has finished, so that no chain of walks is too deep."""
        self._ready.append(action)

    def ask(self, task: Json, then: Then) -> None:
        """Tell `then` the outcome of a task, when it is there."""
        key = str(task["key"])
        if key in self.outcomes:
            self.soon(lambda: then(self.outcomes[key]))
        elif key in self._waiting:
            self._waiting[key].append(then)
        else:
            self._waiting[key] = [then]
            self._asked[key] = {n: task.get(n) for n in ("model", "overrides")}
            self._queue.append(task)

    def work(self) -> None:
        """Until nobody waits for anything. Raises pool.Unavailable, OSError."""
        self._drain()
        command = (*pool.WORKER, f"{self.memory:g}")
        while self._queue:
            for outcome in pool.outcomes(self._queue, self.jobs, self.timeout, command=command, patience=PATIENCE):
                self._keep(lean(outcome))
                self._drain()

    def _keep(self, outcome: Json) -> None:
        key = str(outcome["key"])
        self.journal.append(KIND, key, outcome=outcome, **self._asked.pop(key))
        self.outcomes[key] = outcome
        for then in self._waiting.pop(key):
            self.soon(lambda then=then: then(outcome))  # type: ignore[misc]
        self.said(len(self.outcomes), key)

    def _drain(self) -> None:
        while self._ready:
            self._ready.popleft()()
