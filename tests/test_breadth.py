"""The table of quick cases names tests that are there: one that was renamed would be slow, or quick, without a word.

And in four days all slow tests are walked.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass
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
ALONE = [Slow("a.py::test_alone"), Slow("a.py::test_two[0]"), Slow("a.py::test_two[1]")]
LONG = [Slow(f"a.py::test_long_{i}", long=True) for i in range(4)]
REPORTS = [
    Slow(f"b.py::test_it[{scene}]", ("report_of",)) for scene in ("beam", *sorted(set.union(*daily_selection.LONGEST)))
]


def test_in_four_days_all_is_walked_and_what_is_no_sweep_each_day(monkeypatch: pytest.MonkeyPatch) -> None:
    every = {*SWEPT, *ALONE, *LONG, *REPORTS}
    days = []
    for day in range(daily_selection.PARTS):
        monkeypatch.setattr(daily_selection, "TODAY", day)
        tests: Any = list(every)  # pytest's own cannot be made without it
        later = daily_selection.waiting(tests, lambda nodeid: nodeid[nodeid.find("[") + 1 : -1])
        days.append(every - later)
    assert set.union(*days) == every
    assert set.intersection(*days) == {*ALONE, REPORTS[0]}
    assert all(len(day) <= len(every) / 2 for day in days)
