"""What a comparison concludes from its points: the front, the effort to an error, frames, advice, distances, changes.

Points are made up by hand, so that every expected number follows from the rules by a line of arithmetic beside it.
"""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softmark.interpreter.study.analysis import comparison_point as values
from softmark.interpreter.study.analysis import configuration_pairs, refinement_lines
from softmark.interpreter.study.analysis import pareto_front as fronts
from softmark.interpreter.study.analysis.comparison_analysis import ComparisonTerms
from softmark.interpreter.study.analysis.comparison_record import ComparisonRecord
from softmark.interpreter.study.analysis.pareto_front import (
    EffortEstimate,
    JudgedPoints,
    best_within,
    effort_to_reach,
    error_levels,
    find_pareto_front,
    nearest_round_number,
)
from softmark.interpreter.study.analysis.refinement_lines import RefinementLine
from softmark.interpreter.study.configurations.task_outcome import SolvedReference

Point = dict[str, Any]


def read(points: list[Point]) -> list[values.ComparedPoint]:
    return [values.ComparedPoint.from_json(p) for p in points]


def judge(points: list[Point], metric: str, clock: str, allow_contaminated: bool = False) -> JudgedPoints:
    return fronts.judge_points(read(points), metric, clock, allow_contaminated)


def lines_of(points: list[Point]) -> list[RefinementLine]:
    return refinement_lines.lines_of(read(points))


def distances(points: list[Point], references: dict[str, Any]) -> dict[str, Any]:
    known = {n: SolvedReference.from_json(r) for n, r in references.items()}
    return configuration_pairs.compute_distances(read(points), known).to_json()


def levers(points: list[Point], metrics: list[str], clock: str) -> list[dict[str, Any]]:
    return [lever.to_json() for lever in configuration_pairs.find_change_effects(read(points), metrics, clock)]


def analyse(points: list[Point], references: dict[str, Any], options: dict[str, Any] | None = None) -> dict[str, Any]:
    saved = {"points": points, "references": references}
    return ComparisonRecord.from_json(saved, ComparisonTerms.from_json(options)).analysis.to_json()


def point(model: str, time: float | None, error: float | None, h: float | None = None, **changes: Any) -> Point:
    """A point of a static scene that took `time` s, with quartiles 10 % about it; `h` puts it into a study."""
    spread = {
        "median": time,
        "q1": 0.9 * (time or 0),
        "q3": 1.1 * (time or 0),
        "min": time,
        "max": time,
        "runs": 5,
    }
    cost = None if time is None else {"cpu_s": spread, "wall_s": spread, "frame_s": time, "contaminated": False}
    label = model if h is None else f"{model}, h = {h:g}"
    made = {
        "key": label, "scene": "s", "model": model, "label": label, "study": None if h is None else "refine",
        "variation": {} if h is None else {"h": f"{h:g}"}, "numbers": {} if h is None else {"h": h},
        "status": "converged", "message": None, "outline": "", "solve": {},
        "size": {"dofs": 3 if h is None else round(1 / h**3)},
        "errors": {"e": {"value": error, "unit": "1", "against": "truth"}}, "probes": {}, "cost": cost, "warnings": [],
        "resolution": resolved(h),
    }  # fmt: skip
    return {**made, **changes}


def resolved(h: float | None, target: str = "size", formal: int | None = 2, **changes: Any) -> dict[str, Any]:
    """What decides how finely a point is solved: cells of about h, of linear elements."""
    known = {} if formal is None else {target: formal}
    own = {"of": {} if h is None else {target: h}, "formal": known, "problem": "one", "meshed": False, "counts": None}
    return {**own, **changes}


def uncertain(points: list[Point], by: float) -> list[Point]:
    """The same with a reference that is known to ± by."""
    return [{**p, "errors": {"e": {**p["errors"]["e"], "uncertainty": by}}} for p in points]


def front(points: list[Point]) -> list[str]:
    return [c.key for c in find_pareto_front(judge(points, "e", "cpu_s").candidates.values())]


def reached(level: float, points: list[Point], clock: str = "cpu_s") -> EffortEstimate | str:
    (line,) = lines_of(points)
    return effort_to_reach(level, line, judge(points, "e", clock))


# ------------------------------------------------------------------ the front


def test_the_front_has_what_none_beats() -> None:
    # c takes longer than b and errs more; d ties with b in both; e errs as much as a and takes longer
    points = [
        point("a", 1, 0.5),
        point("b", 2, 0.1),
        point("c", 3, 0.2),
        point("d", 2, 0.1),
        point("e", 4, 0.5),
    ]
    assert front(points) == ["a", "b", "d"]


def test_below_the_uncertainty_nobody_beats_anybody_by_error() -> None:
    # both are better than the reference is known, so the quicker one is as good; without uncertainty both count
    points = [point("a", 1, 0.02), point("b", 2, 0.001)]
    assert front(points) == ["a", "b"]
    assert front(uncertain(points, 0.05)) == ["a"]


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"status": "diverged"}, "it diverged"),
        ({"status": "timed_out"}, "it ran out of time"),
        ({"errors": {"e": {"value": None, "unit": "1", "against": "truth", "reason": "no tip"}}}, "no tip"),
        ({"errors": {}}, "e was not measured"),
        ({"cost": None}, "it was not timed"),
    ],
)
def test_points_that_do_not_count_say_why(changes: dict[str, Any], reason: str) -> None:
    judged = judge([point("a", 1, 0.1), point("b", 1, 0.1, **changes)], "e", "cpu_s")
    assert list(judged.candidates) == ["a"]
    assert judged.left_out == {"b": ("b", reason)}


def test_disturbed_timings_count_if_allowed_and_capped_points_do() -> None:
    bad = point("a", 1, 0.1)
    bad["cost"]["contaminated"] = True
    assert judge([bad], "e", "cpu_s").left_out["a"][1] == "its timing was disturbed"
    assert judge([bad], "e", "cpu_s", allow_contaminated=True).candidates["a"].contaminated
    assert judge([point("a", 1, 0.1, status="capped")], "e", "cpu_s").candidates["a"].capped


# ------------------------------------------------------------------ effort to an error

REFINED = [point("m", 1, 0.1, 0.1), point("m", 10, 0.01, 0.05), point("m", 100, 0.001, 0.025)]


def test_between_neighbours_the_error_is_straight_in_the_logarithms() -> None:
    # the error falls tenfold where the time grows tenfold: 0.03 is reached after 0.1 / 0.03 s
    found = reached(0.03, REFINED)
    assert isinstance(found, EffortEstimate)
    assert found.interpolated
    assert found.between == ("m, h = 0.1", "m, h = 0.05")
    assert found.effort.median == pytest.approx(0.1 / 0.03, rel=1e-12)  # exact but for rounding
    assert found.effort.q3 == pytest.approx(1.1 * 0.1 / 0.03, rel=1e-12)  # as both quartiles are


def test_a_level_that_a_point_meets_or_that_all_are_below_is_not_interpolated() -> None:
    for level, key in ((0.01, "m, h = 0.05"), (0.5, "m, h = 0.1")):
        found = reached(level, REFINED)
        assert isinstance(found, EffortEstimate)
        assert (found.interpolated, found.between) == (False, (key,))


def test_no_interpolation_across_a_failure_or_to_no_error() -> None:
    failed = [REFINED[0], {**REFINED[1], "status": "failed"}, REFINED[2]]
    found = reached(0.03, failed)
    assert isinstance(found, EffortEstimate)
    assert found.between == ("m, h = 0.025",)  # the cheapest that was computed
    exact = [point("m", 1, 0.1, 0.1), point("m", 10, 0.0, 0.05)]  # log 0
    found = reached(0.03, exact)
    assert isinstance(found, EffortEstimate)
    assert found.between == ("m, h = 0.05",)


def test_levels_that_are_never_reached_or_cannot_be_told() -> None:
    assert reached(1e-4, REFINED) == "not reached"
    assert reached(0.01, uncertain(REFINED, 0.02)) == "the uncertainty of the reference is larger"
    assert reached(0.1, [{**p, "status": "diverged"} for p in REFINED]) == "it diverged"


def test_levels() -> None:
    assert error_levels("1", 0.1, []) == [0.1, 0.05, 0.01]
    # 10, 5 and 1 % of 128 mm are 12.8, 6.4 and 1.28 mm
    assert error_levels("m", 0.128, []) == [0.01, 0.005, 0.001]
    assert error_levels("J", 0.128, [0.02, 3.0]) == [1.0, 0.1, 0.01]
    assert error_levels("J", None, [0.0]) == []
    # 1.41 and 3.16 divide 1 from 2 and 2 from 5 by ratio: sqrt(2), sqrt(10)
    assert [nearest_round_number(v) for v in (1.4, 1.45, 3.1, 3.2, 8.0)] == [1.0, 2.0, 2.0, 5.0, 10.0]


# ------------------------------------------------------------------ frames


def framed(*points: Point) -> JudgedPoints:
    return judge(list(points), "e", "cpu_s")


def test_the_third_quartile_must_fit_a_frame() -> None:
    # at 25 Hz there are 40 ms: 35 ms with its quartile at 38.5 ms fits, 38 ms with 41.8 ms is not sure
    found = best_within(25.0, framed(point("a", 0.035, 0.2), point("b", 0.038, 0.1), point("c", 0.001, 0.5)))
    assert (found.best and found.best.key, found.runner_up and found.runner_up.key) == ("a", "c")
    assert found.unsure == ("b",)
    none = best_within(1000.0, framed(point("a", 0.035, 0.2)))
    assert none.best is None
    assert none.reason == "the fastest, `a`, takes 38.5 ms"


def test_steps_must_fit_a_frame_in_a_dynamic_analysis() -> None:
    moving = point("a", 2.0, 0.1)
    moving["cost"] |= {"frame_s": 0.01, "step_s": {"median": 0.01, "q1": 0.009, "q3": 0.012, "runs": 200}}
    found = best_within(25.0, framed(moving))
    assert found.best is not None
    assert found.best.frame is not None
    assert found.best.frame.q3 == 0.012


# ------------------------------------------------------------------ laws

positive = st.floats(1e-3, 1e3, allow_nan=False)
clouds = st.lists(st.tuples(positive, st.one_of(st.just(0.0), positive)), min_size=1, max_size=30)


def cloud(pairs: list[tuple[float, float]], h: bool = False) -> list[Point]:
    return [point("m" if h else f"m{i}", t, e, 1 / (i + 2) if h else None) for i, (t, e) in enumerate(pairs)]


@settings(max_examples=60, deadline=None)
@given(clouds)
def test_members_of_the_front_are_beaten_by_nobody_and_all_others_by_a_member(
    pairs: list[tuple[float, float]],
) -> None:
    everyone = judge(cloud(pairs), "e", "cpu_s").candidates
    members = find_pareto_front(everyone.values())
    assert not any(other.beats(c) for c in members for other in everyone.values())
    others = [c for c in everyone.values() if c not in members]
    assert all(any(member.beats(c) for member in members) for c in others)


@settings(max_examples=40, deadline=None)
@given(clouds, st.integers(0, 29))
def test_a_beaten_point_changes_nothing(pairs: list[tuple[float, float]], place: int) -> None:
    before = cloud(pairs)
    time, error = pairs[place % len(pairs)]
    assert front([*before, point("beaten", 1.5 * time, error)]) == front(before)


@settings(max_examples=60, deadline=None)
@given(clouds, positive, positive, st.one_of(st.just(0.0), positive))
def test_a_smaller_error_takes_no_less_time(
    pairs: list[tuple[float, float]], a: float, b: float, uncertainty: float
) -> None:
    points = uncertain(cloud(pairs, h=True), uncertainty)
    strict, loose = (reached(level, points) for level in sorted((a, b)))
    if isinstance(strict, EffortEstimate):
        assert isinstance(loose, EffortEstimate)
        assert loose.effort.median <= strict.effort.median * (1 + 1e-12)


# ------------------------------------------------------------------ lines


def test_lines_follow_the_number_that_changes_the_size() -> None:
    # two numbers vary; nu leaves the mesh as it is, so that there is a line over h for each nu
    points = [
        {**point("m", 1, 0.1, h), "variation": {"nu": nu, "h": f"{h:g}"}, "numbers": {"nu": float(nu), "h": h},
         "key": f"{nu} {h}"}
        for nu in ("0.3", "0.49") for h in (0.05, 0.1)
    ]  # fmt: skip
    found = lines_of(points)
    assert [(line.varied, line.label, line.keys) for line in found] == [
        ("h", "m, nu = 0.3", ["0.3 0.1", "0.3 0.05"]),
        ("h", "m, nu = 0.49", ["0.49 0.1", "0.49 0.05"]),
    ]


def test_a_number_of_segments_refines_as_it_grows() -> None:
    made = [
        {**point("rod", 1, 0.1), "key": f"{n}", "variation": {"segments": f"{n}"}, "numbers": {"segments": float(n)},
         "size": {"dofs": 6 * n}}
        for n in (20, 5, 10)
    ]  # fmt: skip
    (line,) = lines_of(made)
    assert line.keys == ["5", "10", "20"]


# ------------------------------------------------------------------ pairs


def probed(*z: float) -> dict[str, Any]:
    points = [[float(i), 0.0, 0.0] for i in range(len(z))]
    return {"line": {"points": points, "displacement": [[0.0, 0.0, v] for v in z]}}


def test_distances_are_relative_to_the_column() -> None:
    # |(3, 4) - (0, 4)| = 3; |(0, 4)| = 4, |(3, 4)| = 5
    a, b = point("a", 1, 0.1, probes=probed(3, 4)), point("b", 1, 0.1, probes=probed(0, 4))
    still, other = point("still", 1, 0.1, probes=probed(0, 0)), point("other", 1, 0.1, probes=probed(1, 2, 3))
    coarse = point("b", 1, 0.1, probes=probed(9, 9), size={"dofs": 1}, key="coarse")
    found = distances([a, coarse, b, still, other], {"truth": {"probes": probed(3, 4)}})
    assert found["names"] == ["truth", "a", "b", "still", "other"]
    assert found["matrix"][0][:4] == [0.0, 0.0, 0.75, None]
    assert found["matrix"][2][:3] == [0.6, 0.6, 0.0]
    reasons = {(r["row"], r["column"]): r["reason"] for r in found["reasons"]}
    assert reasons["a", "still"] == "the configuration to compare with has zero displacement"
    assert reasons["a", "other"] == "they share no points"


def test_levers_are_pairs_that_differ_in_one_thing() -> None:
    fine = {**point("m", 8, 0.02, 0.05), "key": "fine"}
    points = [point("m", 1, 0.1, 0.1), fine, {**point("n", 3, 0.1, 0.1), "key": "n"}]
    (found,) = levers(points, ["e"], "cpu_s")
    assert (found["what"], found["from"], found["to"]) == ("h", "0.1", "0.05")
    assert found["effort_ratio"] == 8.0
    assert found["errors"]["e"]["ratio"] == pytest.approx(0.2)
    assert found["noise"] is False


# ------------------------------------------------------------------ advice


def advice(points: list[Point], **options: Any) -> dict[str, Any]:
    found = analyse(points, {}, options)
    json.dumps(found, allow_nan=False)  # plain, and without NaN
    return dict(found["advice"][0])


def test_advice_is_the_quickest_at_the_smallest_level_that_anybody_reaches() -> None:
    found = advice([point("a", 1, 0.2), point("b", 2, 0.04), point("c", 5, 0.03)])
    assert (found["level"], found["winner"]["key"], found["runner_up"]["key"]) == (0.05, "b", "c")
    assert found["factor"] == 2.5
    assert found["decidable"] is True
    assert "2.5 times the time" in found["text"]


def test_advice_says_what_is_within_the_noise() -> None:
    # 2.0 s with quartiles 1.8 to 2.2, and 2.1 s with 1.89 to 2.31
    found = advice([point("b", 2, 0.04), point("c", 2.1, 0.03)])
    assert found["decidable"] is False
    assert "less than the timing noise" in found["text"]


def test_advice_says_what_is_wrong_with_its_winner() -> None:
    bad = point("a", 1, 0.04, status="capped")
    bad["cost"]["contaminated"] = True
    assert advice([bad])["winner"] is None
    found = advice(uncertain([bad], 0.045), allow_contaminated=True)
    assert [c.split(":")[0].split(",")[0] for c in found["caveats"]] == [
        "Its timing was disturbed by other processes",
        "Its solution was stopped by `max_iterations` before convergence",
        "Its error is below the uncertainty of the reference",
    ]


def test_where_the_reference_knows_less_than_the_levels_nobody_is_the_closest() -> None:
    found = advice(uncertain([point("a", 2, 0.03), point("b", 1, 0.1), point("c", 3, 0.3)], 0.137))
    assert "uncertainty of ± 13.7 %, so an error of 10 % cannot be resolved" in found["text"].replace("\u00a0", " ")
    assert "the errors of `b`, `a` are below it and cannot be ranked; `b` is the fastest of them" in found["text"]
    assert "closest" not in found["text"]


def test_advice_names_a_study_outside_the_asymptotic_range() -> None:
    # displacements 1, 2, 4 on ever finer meshes go nowhere; the errors are made up
    z = {0.1: 1.0, 0.05: 2.0, 0.025: 4.0}
    points = [point("m", 1 / h, h, h, probes=probed(v)) for h, v in z.items()]
    found = advice(points)
    assert found["winner"]["key"] == "m, h = 0.05"
    assert "outside the asymptotic range" in found["text"]


def test_without_times_the_smallest_is_recommended() -> None:
    found = analyse([point("a", None, 0.04, size={"dofs": 30}), point("b", None, 0.03, size={"dofs": 60})], {})
    assert found["scenes"]["s"]["clock"] == "unknowns"
    assert found["scenes"]["s"]["metrics"]["e"]["front"] == ["a", "b"]
    assert "`a` is the smallest: 30 unknowns" in found["advice"][0]["text"].replace("\u00a0", " ")


def test_metrics_that_disagree_are_named() -> None:
    def both(model: str, e: float, f: float) -> Point:
        own = point(model, 1, e)
        own["errors"]["f"] = {"value": f, "unit": "1", "against": "truth"}
        return own

    found = analyse([both("a", 0.1, 0.4), both("b", 0.2, 0.3)], {})["scenes"]["s"]["disagreements"]
    assert [(d["metrics"], d["discordant"], d["pairs"]) for d in found] == [(["e", "f"], 1, 1)]
    agreed = analyse([both("a", 0.1, 0.3), both("b", 0.2, 0.4)], {})["scenes"]["s"]["disagreements"]
    assert agreed == []
    points = [both("a", 0.1, 0.4), both("b", 0.2, 0.3)]
    for own in points:
        own["errors"]["e"]["uncertainty"] = 0.5
    assert analyse(points, {})["scenes"]["s"]["disagreements"] == []  # `e` cannot tell them apart


def test_orders_follow_the_line() -> None:
    # u = 1 - h^2 is second order, and its limit is 1; errors h^2 too. To rounding of values of one: 1e-9 is ample
    points = [point("m", 1 / h, h**2, h, probes=probed(1 - h**2)) for h in (0.4, 0.2, 0.1)]
    (found,) = analyse(points, {})["scenes"]["s"]["orders"]
    assert found["limits"][0]["order"] == pytest.approx(2, abs=1e-9)
    assert found["limits"][0]["value"] == pytest.approx(1, abs=1e-9)
    assert found["errors"]["e"]["last"] == pytest.approx(2, abs=1e-9)


def test_nothing_gives_nothing() -> None:
    assert analyse([], {})["scenes"] == {}
    found = analyse([], {"s": {"truth": {"status": "failed", "message": "no file"}}})["scenes"]["s"]
    assert found["failures"][0]["message"] == "no file"
    assert (found["lines"], found["metrics"]) == ([], {})
