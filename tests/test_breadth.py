"""The table of quick cases names existing tests, so that a renamed test keeps its speed; all slow tests have a day."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

import daily_selection
import pytest
from quick_cases import QUICK

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("file", QUICK)
def test_what_it_names_is_there(file: str) -> None:
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    assert set(QUICK[file]) <= {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


@dataclass(frozen=True)
class Slow:
    """What the walk asks of a test."""

    nodeid: str
    fixturenames: tuple[str, ...] = ()
    long: bool = False

    def get_closest_marker(self, name: str) -> bool:
        return name == "long" and self.long


SWEPT = [Slow(f"a.py::test_law[{i}]") for i in range(8)]
BROAD = [Slow(f"a.py::test_broad[{i}]") for i in range(daily_selection.LARGE + 1)]
ALONE = [Slow("a.py::test_alone"), Slow("a.py::test_two[0]"), Slow("a.py::test_two[1]")]
LONG = [Slow(f"a.py::test_long_{i}", long=True) for i in range(4)]
REPORTS = [
    Slow(f"b.py::test_it[{scene}]", ("report_of",)) for scene in ("beam", *sorted(set.union(*daily_selection.LONGEST)))
]


def test_all_slow_tests_run_within_two_weeks_and_single_ones_every_day(monkeypatch: pytest.MonkeyPatch) -> None:
    every = {*SWEPT, *BROAD, *ALONE, *LONG, *REPORTS}
    days = []
    for day in range(2 * daily_selection.PARTS):
        monkeypatch.setattr(daily_selection, "DAY", date.fromordinal(735_000 + day))
        tests: Any = list(every)  # pytest's own cannot be made without it
        later = daily_selection.tests_not_run_today(tests, lambda nodeid: nodeid[nodeid.find("[") + 1 : -1])
        days.append(every - later)
    assert set.union(*days) == every
    assert set.union(*days[: daily_selection.PARTS]) >= every - {*BROAD}
    assert set.intersection(*days) == {*ALONE, REPORTS[0]}
    assert all(len(day) <= len(every) / 2 for day in days)
