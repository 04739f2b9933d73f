"""What `dsl compare old.json new.json` finds: values, statuses and times that changed, and what explains them.

All numbers are made up: relative changes of 1e-7 and 1e-5 lie on either side of what counts as rounding (1e-6), times
of 4 % and of 30 % on either side of what counts as a change (5 %).
"""

from __future__ import annotations

import copy
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from softmark.interpreter.report.comparison import comparison_changes as shown
from softmark.interpreter.study.analysis import result_changes as found_by
from softmark.interpreter.study.analysis.result_changes import NotComparable, read_result

Json = dict[str, Any]


def changes(*files: Any) -> Json:
    return found_by.find_changes(*files).to_json()


def changes_table(old: Json, new: Json, colour: bool) -> str:
    return shown.changes_table(found_by.find_changes(old, new), colour)


def spread(median: float, half: float = 0.02, runs: int = 5) -> Json:
    """A time whose quartiles, and whose least and largest, lie `half` of it to either side."""
    low, high = median * (1 - half), median * (1 + half)
    return {"median": median, "q1": low, "q3": high, "min": low, "max": high, "runs": runs}


def point(model: str, h: str = "5 mm", **changes: Any) -> Json:
    own = {
        "key": f"{model}{h}", "scene": "beam", "model": model, "label": f"{model}, h = {h}", "study": None,
        "variation": {"h": h}, "numbers": {}, "status": "converged", "message": None, "size": {"dofs": 9}, "solve": {},
        "errors": {"eta": {"value": 0.1, "unit": "1", "against": "truth", "uncertainty": 0.01}},
        "probes": {}, "cost": {"cpu_s": spread(1.0), "contaminated": False}, "warnings": [],
    }  # fmt: skip
    return {**own, **changes}


def comparison(*points: Json, **changes: Any) -> Json:
    own = {
        "schema": "softmark-compare/1", "created": "2026-11-21", "environment": {"numpy": "2.4", "cpu": "x"},
        "command": "", "scenes": [{"file": "beam.scene", "sha256": "a" * 64}], "points": list(points),
        "references": {"beam": {"truth": {"status": "converged"}}},
    }  # fmt: skip
    return {**own, **changes}


def report(**models: Json) -> Json:
    return {
        "schema": "softmark-report/1", "environment": {}, "scene": {"sha256": "a" * 64, "parameters": {}},
        "models": models, "references": {}, "expectations": [{"text": "a.eta < 5 %", "passed": True}],
    }  # fmt: skip


def model(eta: float | None = 0.1, time: float = 1.0, **changes: Any) -> Json:
    own = {
        "status": "converged", "metrics": {"eta": {"value": eta, "unit": "1"}},
        "time": {"solve_s": {"median": time, "min": 0.98 * time, "max": 1.02 * time, "runs": 3}, "step_s": None},
    }  # fmt: skip
    return {**own, **changes}


def valued(value: float | None, **more: Any) -> Json:
    return {"eta": {"value": value, "unit": "1", "against": "truth", "uncertainty": 0.01, **more}}


def costing(seconds: Json, contaminated: bool = False) -> Json:
    return {"cpu_s": seconds, "contaminated": contaminated}


SILENT = ("environment", "scenes", "added", "removed", "status", "metrics", "times", "expectations")


def test_the_same_is_the_same_whatever_its_keys_and_dates() -> None:
    old, new = comparison(point("a")), comparison(point("a", key="other"), created="2027-01-01")
    found = changes(old, new)
    assert [found[k] for k in SILENT] == [[]] * len(SILENT)
    assert found["compared"] == 2
    assert "No changes" in changes_table(old, new, False)


@pytest.mark.parametrize(
    ("value", "verdict"),
    [
        (0.1 * (1 + 1e-7), None),  # rounding
        (0.1 * (1 + 1e-5), "changed by less than the uncertainty"),  # by 1e-6; the reference is known to 1e-2
        (0.105, "changed by less than the uncertainty"),
        (0.12, "changed"),  # by 2e-2
        (None, "lost"),
    ],
)
def test_values(value: float | None, verdict: str | None) -> None:
    new = comparison(point("a", errors=valued(value)))
    found = changes(comparison(point("a")), new)["metrics"]
    assert [c["verdict"] for c in found] == ([verdict] if verdict else [])
    if value == 0.12:
        assert found[0]["relative"] == pytest.approx(0.2)  # (0.12 - 0.1) / 0.1


@pytest.mark.parametrize(
    ("old", "new", "verdict"),
    [
        (spread(1.0), spread(1.3), "slower"),
        (spread(1.3), spread(1.0), "quicker"),
        (spread(1.0, 0.001), spread(1.04, 0.001), None),  # quartiles apart, but 4 %
        (spread(1.0, 0.2), spread(1.3, 0.2), None),  # 0.8 to 1.2 meets 1.04 to 1.56
        (spread(1.0, 0.0, 1), spread(1.3, 0.0, 1), "undecided"),  # timed once: the noise is not known
    ],
)
def test_times_change_beyond_noise_only(old: Json, new: Json, verdict: str | None) -> None:
    files = [comparison(point("a", cost=costing(s))) for s in (old, new)]
    assert [c["verdict"] for c in changes(*files)["times"]] == ([verdict] if verdict else [])


def test_disturbed_timings_decide_nothing() -> None:
    files = [comparison(point("a", cost=costing(spread(t), t > 1))) for t in (1.0, 1.3)]
    (found,) = changes(*files)["times"]
    assert (found["verdict"], found["reason"]) == ("undecided", "a timing was disturbed")


def test_reports_are_judged_by_least_and_largest() -> None:
    found = changes(report(a=model(), b=model()), report(a=model(time=1.3), c=model()))
    assert [(c["name"], c["clock"], c["verdict"]) for c in found["times"]] == [("a", "solve_s", "slower")]
    assert (found["added"], found["removed"]) == (["c"], ["b"])


def test_statuses_expectations_and_environments(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    old, new = report(a=model()), report(a=model(None, status="diverged", message="no equilibrium"))
    new["expectations"][0]["passed"] = False
    new["environment"] = {"numpy": "2.5", "started": "now"}
    new["scene"]["parameters"] = {"h": {"text": "5 mm", "value": 0.005}}
    found = changes(old, new)
    assert found["status"] == [{"name": "a", "old": "converged", "new": "diverged", "message": "no equilibrium"}]
    assert found["expectations"] == [{"what": "a.eta < 5 %", "old": "met", "new": "not met"}]
    assert found["environment"] == [{"what": "numpy", "old": None, "new": "2.5"}]
    assert found["scenes"] == [{"what": "parameter h", "old": None, "new": "5 mm"}]
    said = changes_table(old, new, False)
    for words in (
        "converged -> diverged: no equilibrium",
        "met -> not met",
        "nothing -> 2.5",
        "10 % -> none",
    ):
        assert words in said
    assert "\x1b[31m" in changes_table(old, new, True)


def test_configurations_of_several_scenes_and_studies_are_kept_apart() -> None:
    points = [point("a"), point("a", scene="cube"), point("a", study="refine"), point("a")]
    found = changes(comparison(), comparison(*points))
    assert found["added"][:4] == [
        "beam: a, h = 5 mm", "cube: a, h = 5 mm", "beam: a, h = 5 mm (refine)", "beam: a, h = 5 mm #2",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (lambda: comparison(), lambda: report(), "is a softmark-compare/1 and `new.json` a softmark-report/1"),
        (lambda: {"schema": "else"}, lambda: report(), "its schema is `else`"),
        (lambda: [1], lambda: report(), "it has no `schema`"),
        (lambda: {"schema": "softmark-report/1"}, lambda: report(), "`models` is missing"),
    ],
)  # fmt: skip
def test_what_cannot_be_compared_is_refused(old: Callable[[], Any], new: Callable[[], Any], words: str) -> None:
    with pytest.raises(NotComparable, match=re.escape(words)):
        changes(old(), new(), ("old.json", "new.json"))


def test_files(tmp_path: Path) -> None:
    good, bad = tmp_path / "good.json", tmp_path / "bad.json"
    good.write_text(json.dumps(report(a=model())), encoding="utf-8")
    bad.write_text("{", encoding="utf-8")
    assert read_result(good)["models"]["a"]["status"] == "converged"
    with pytest.raises(NotComparable, match="is not JSON"):
        read_result(bad)
    with pytest.raises(NotComparable, match="cannot be read"):
        read_result(tmp_path / "none.json")


def drawn(values: list[float | None], times: list[float]) -> Json:
    pairs = enumerate(zip(values, times, strict=True))
    return comparison(*(point(f"m{i}", errors=valued(v), cost=costing(spread(t))) for i, (v, t) in pairs))


results = st.builds(
    drawn,
    st.lists(st.one_of(st.none(), st.floats(-1, 1)), min_size=3, max_size=3),
    st.lists(st.floats(0.1, 10), min_size=3, max_size=3),
)


@settings(max_examples=50, deadline=None)
@given(results, results, st.integers(0, 3))
@example(drawn([None] * 3, [1.0, 6.4375, 1.0]), drawn([None] * 3, [1.0, 6.765625, 1.0]), 3)  # 5.1 % up, 4.8 % down
def test_the_other_direction_is_the_mirror_image(old: Json, new: Json, kept: int) -> None:
    old = copy.deepcopy(old)
    del old["points"][kept:]
    there, back = changes(old, new), changes(new, old)
    assert (there["added"], there["removed"]) == (back["removed"], back["added"])
    for kind in ("metrics", "times", "status"):
        assert [(c["name"], c["old"], c["new"]) for c in there[kind]] == [
            (c["name"], c["new"], c["old"]) for c in back[kind]
        ]
    assert changes(new, new)["metrics"] == []
    json.dumps(there, allow_nan=False)
