"""Budget of nominal CPU time for error estimates, relative to that of the solution.

Nominal time is counted by `solvers/runtime/work_count.py`: what can be stated does not depend on how busy a machine is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from softmark.interpreter.verification.probe_errors import NoErrorEstimate
from softmark.solvers.runtime.work_count import counted, seconds_since

SOLUTIONS = 2.0  # total budget relative to the cost of the solution
LEAST = 5.0  # s, least budget
SLIGHT = 0.25  # s, largest cost of a solution that nobody requested
NOT_ASKED = "not computed by default; `--stated` does this"


class BudgetExceeded(NoErrorEstimate):
    """Exception for an estimate that exceeds its budget, or would exceed it."""


@dataclass
class Budget:
    """Nominal CPU time that error estimates of one solution may spend, s, counted within a `with` block.

    `asked` is true if the result was requested; otherwise only slight costs are allowed.
    """

    limit: float
    solution: float  # s, nominal CPU time of the solution
    asked: bool = True
    spent: float = 0.0
    _depth: int = 0
    _since: int = 0  # ns

    @classmethod
    def of(cls, facts: Mapping[str, Any], asked: bool) -> Budget:
        """Return the budget of a model from the facts of its solution, which have its `nominal_cpu_s`."""
        took = sum((facts.get("nominal_cpu_s") or {}).values())
        return cls(max(SOLUTIONS * took, LEAST), took, asked)

    def __enter__(self) -> None:
        self._depth += 1
        if self._depth == 1:
            self._since = counted()

    def __exit__(self, *failure: object) -> None:
        self._depth -= 1
        if self._depth == 0:
            self.spent += seconds_since(self._since)

    @property
    def words(self) -> str:
        """Largest allowed cost as text, such as `2 times the time of the solution`."""
        return f"{LEAST:g} s" if SOLUTIONS * self.solution <= LEAST else f"{SOLUTIONS:g} times the time of the solution"

    @contextmanager
    def reserving(self, solutions: float) -> Iterator[None]:
        """Reserve time for `solutions` further solutions while the block runs, so that it is left afterwards."""
        kept = solutions * self.solution
        self.limit -= kept
        try:
            yield
        finally:
            self.limit += kept

    @property
    def left(self) -> float:
        """Nominal CPU time that error estimates may still use, s."""
        return self.limit - self.spent - (seconds_since(self._since) if self._depth else 0.0)

    def add_solution_time(self, took: float) -> None:
        """Increase the budget for `took` seconds of solution time that its clock missed, such as modal analysis."""
        self.limit += SOLUTIONS * took

    def must_hold(self, solutions: float, slight: bool = False) -> None:
        """Raise BudgetExceeded if work that costs as much as `solutions` solutions exceeds the remaining budget.

        It is also raised if nobody requested the result, unless the cost is `slight` compared with starting a program,
        as for a beam with fewer segments.
        """
        if not self.asked and not (slight and solutions * self.solution <= SLIGHT):
            raise BudgetExceeded(NOT_ASKED)
        if solutions * self.solution > self.left:
            raise BudgetExceeded(f"computing it would take more than {self.words}")

    def check(self, *_: object) -> None:
        """Raise BudgetExceeded if the budget is spent; usable as a callback with any arguments."""
        if self.left < 0.0:
            raise BudgetExceeded(f"computing it takes more than {self.words}")
