"""Which runs count and what they come to, on records with stated numbers."""

from __future__ import annotations

from typing import Any

import pytest

from softmark.interpreter.study.analysis import timing_quality
from softmark.interpreter.study.timing.processor_choice import choose_processors
from softmark.interpreter.study.timing.timed_process import quantiles, replace_nonfinite


def run(seconds: float = 0.1, **more: Any) -> dict[str, Any]:
    """An undisturbed run of two solutions of equal length; `during` is merged with what is given."""
    during = {
        "wall_s": 2 * seconds, "cpu_s": 2 * seconds, "involuntary": 0, "waited_s": 0.0, "pressure_s": 0.0,
        "steal_s": 0.0, "compiled": 0,
    }  # fmt: skip
    record = {
        "key": "a", "status": "converged", "message": None, "warmed": True, "wall_s": [seconds] * 2,
        "cpu_s": [seconds] * 2, "threads": {"asked": 1}, "pace_s": 1e-3, "steps": None, "cores": [1],
        "setup": {"mesh": [0.01, 0.01], "set-up": [0.02, 0.02]}, "solve": {"iterations": 5, "steps": 1},
        "memory": {"peak": 300, "before": 100},
    }  # fmt: skip
    return record | more | {"during": during | more.get("during", {})}


def test_an_undisturbed_run_has_no_flags_and_what_is_not_known_disturbs_nothing() -> None:
    assert timing_quality.disturbances(run()) == []
    unknown = {"waited_s": None, "pressure_s": None, "steal_s": None, "involuntary": None}
    assert timing_quality.disturbances(run(during=unknown)) == []
    assert timing_quality.disturbances({"status": "failed"}) == []


@pytest.mark.parametrize(
    ("more", "flag"),
    [
        ({"cpu_s": [0.0945, 0.0945]}, "shared"),  # 94.5 % of the wall time
        ({"during": {"waited_s": 0.005}}, "waited"),  # 2.5 % of 0.2 s
        ({"during": {"pressure_s": 0.011}}, "pressure"),  # 5.5 %
        ({"during": {"steal_s": 0.02}}, "stolen"),  # 10 %, two ticks
        ({"during": {"involuntary": 201}}, "switched"),  # 1005 a second
        ({"during": {"compiled": 1}}, "compiled"),
        ({"pace_s": 1.16e-3}, "pace"),  # 16 % slower than the 1 ms of the others
        ({"pace_s": 0.86e-3}, "pace"),
    ],
)
def test_each_disturbance_is_named(more: dict[str, Any], flag: str) -> None:
    assert timing_quality.disturbances(run(**more), pace=1e-3) == [flag]
    assert flag in timing_quality.DISTURBANCES


@pytest.mark.parametrize(
    "more",
    [
        {"cpu_s": [0.0955, 0.0955]},
        {"during": {"waited_s": 0.0039}},
        {"during": {"pressure_s": 0.0099}},
        {"during": {"steal_s": 0.01}},  # one tick of the counter is not evidence
        {"during": {"involuntary": 40}},  # 200 a second, which idle machines show
        {"pace_s": 1.14e-3},
        {"threads": {"asked": 2}, "cpu_s": [0.05, 0.05]},  # CPU and wall time of several threads say nothing
    ],
)
def test_just_inside_the_thresholds_nothing_is_flagged(more: dict[str, Any]) -> None:
    assert timing_quality.disturbances(run(**more), pace=1e-3) == []


def test_the_usual_pace_is_that_of_the_quick_quarter() -> None:
    runs = [run(pace_s=p) for p in (1.0, 1.0, 1.0, 1.6, 1.7)]
    assert timing_quality.usual_pace(runs) == 1.0
    assert [timing_quality.is_undisturbed(r, 1.0) for r in runs] == [True, True, True, False, False]
    assert timing_quality.usual_pace([{"status": "failed"}]) is None


def test_quartiles_are_those_of_the_clean_runs() -> None:
    """Of 1, 2, 3, 4, 5 the quartiles are 2, 3, 4 by linear interpolation between order statistics."""
    disturbed = run(50.0, during={"compiled": 1})
    cost = timing_quality.summarize_cost([*(run(float(s)) for s in (3, 1, 5, 2, 4)), disturbed], asked=5)
    assert cost is not None
    assert cost["wall_s"] == {"median": 3.0, "q1": 2.0, "q3": 4.0, "min": 1.0, "max": 5.0, "runs": 5}
    assert cost["cpu_s"] == cost["wall_s"]
    assert (cost["excluded_runs"], cost["contaminated"], cost["flags"]) == (1, False, [])
    assert (cost["frame_s"], cost["frame_basis"]) == (3.0, "wall")
    assert cost["setup_s"]["median"] == pytest.approx(0.03)
    assert (cost["memory_bytes"], cost["memory_added_bytes"]) == (300, 200)


def test_with_too_few_clean_runs_all_count_and_cpu_time_is_what_fits_a_frame() -> None:
    slow = [run(1.0, wall_s=[2.0, 2.0]) for _ in range(3)]
    cost = timing_quality.summarize_cost([run(1.0), run(1.0), *slow], asked=5)
    assert cost is not None
    assert cost["contaminated"]
    assert cost["wall_s"]["runs"] == 5
    assert cost["wall_s"]["median"] == 2.0
    assert (cost["frame_s"], cost["frame_basis"], cost["excluded_runs"]) == (1.0, "cpu", 0)
    assert cost["flags"] == ["contaminated", "shared"]


def test_cpu_time_is_that_of_the_runs_at_the_usual_pace_even_if_all_had_to_wait() -> None:
    """Three runs waited and computed for 1 s; in two more the processor was 60 % slower."""
    waiting = [run(1.0, wall_s=[2.0, 2.0]) for _ in range(3)]
    slow = [run(1.6, wall_s=[3.2, 3.2], pace_s=1.6e-3) for _ in range(2)]
    cost = timing_quality.summarize_cost([*slow, *waiting], asked=5)
    assert cost is not None
    assert cost["contaminated"]
    assert (cost["cpu_s"]["median"], cost["cpu_s"]["max"], cost["cpu_s"]["runs"]) == (1.0, 1.0, 3)
    assert (cost["wall_s"]["max"], cost["wall_s"]["runs"]) == (3.2, 5)


def test_two_runs_are_enough_where_no_more_were_asked_for() -> None:
    cost = timing_quality.summarize_cost([run(), run()], asked=2)
    assert cost is not None
    assert not cost["contaminated"]
    assert cost["flags"] == []


def test_remarks() -> None:
    cost = timing_quality.summarize_cost(
        [run(warmed=False), run(solve={"iterations": 6, "steps": 1}), run(cores=[0])], asked=5
    )
    assert cost is not None
    assert set(cost["flags"]) == {"few repeats", "not warmed up", "runs differ", "differing processors"}
    assert set(cost["flags"]) <= set(timing_quality.REMARKS)


def test_a_run_counts_by_the_median_of_its_solutions() -> None:
    cost = timing_quality.summarize_cost([run(wall_s=[1.0, 1.0, 9.0], cpu_s=[1.0, 1.0, 9.0])] * 3)
    assert cost is not None
    assert cost["wall_s"]["median"] == 1.0


def test_steps_of_a_dynamic_analysis_are_what_fits_a_frame() -> None:
    steps = {
        "wall_s": {"median": 1e-3, "p95": 2e-3, "p99": 3e-3, "max": 4e-3},
        "cpu_s": {"median": 1e-3, "p95": 1e-3, "p99": 1e-3, "max": 1e-3},
        "steps": 100,
    }
    cost = timing_quality.summarize_cost([run(steps=steps)] * 3)
    assert cost is not None
    assert cost["step_s"] == {
        "median": 1e-3,
        "p95": 2e-3,
        "p99": 3e-3,
        "max": 4e-3,
        "steps": 100,
        "runs": 3,
    }
    assert cost["frame_s"] == 1e-3


def test_phases_share_out_the_median() -> None:
    """Clocks made a solution of 0.1 s take 0.2 s: shares of 50, 25 and 25 % of 0.1 s."""
    clocks = {
        "status": "converged",
        "phases": {"assembly": 0.1, "solution": 0.05, "other": 0.05},
        "output_s": 0.5,
    }
    cost = timing_quality.summarize_cost([run(), run(), run(), clocks])
    assert cost is not None
    assert cost["phases"] == pytest.approx(
        {"mesh": 0.01, "set-up": 0.02, "assembly": 0.05, "factorisation": 0.0, "solution": 0.025, "other": 0.025,
         "output": 0.5}
    )  # fmt: skip


def test_without_a_solution_there_is_no_cost_but_a_reason() -> None:
    failed = {"status": "timed_out", "message": "it did not finish within 1 s"}
    assert timing_quality.summarize_cost([failed]) is None
    assert timing_quality.reason_without_times([failed]) == "it did not finish within 1 s"
    assert timing_quality.reason_without_times([]) == "it was not timed"
    assert timing_quality.reason_without_times([run()]) is None


def test_quantiles_are_values_that_occurred() -> None:
    """Of 1 to 100 the least value not below 95 % of all is 95."""
    assert quantiles([float(i) for i in range(1, 101)]) == {"median": 50, "p95": 95, "p99": 99, "max": 100}
    assert quantiles([2.0]) == {"median": 2.0, "p95": 2.0, "p99": 2.0, "max": 2.0}
    assert quantiles([]) is None


def test_records_hold_numbers_that_json_has() -> None:
    assert replace_nonfinite({"a": float("nan"), "b": [float("inf"), 1], "c": None, "d": True}) == {
        "a": None,
        "b": [None, 1],
        "c": None,
        "d": True,
    }


def test_the_idle_processor_is_chosen_and_of_equals_the_last() -> None:
    """Busy seconds of two processors over one second; 3 % of a processor is no difference."""
    assert choose_processors({0, 1}, [0.0, 0.0], [0.1, 0.9], 1) == [0]
    assert choose_processors({0, 1}, [0.0, 0.0], [0.9, 0.03], 1) == [1]
    assert choose_processors({0, 1}, [5.0, 5.0], [5.0, 5.0], 1) == [1]
    assert choose_processors({0, 1}, [], [], 2) == [0, 1]
