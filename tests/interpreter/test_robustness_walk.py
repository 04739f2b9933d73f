"""Walks of a stability study: where ladders lead, and what bisection finds of an edge that a fake model has."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from softmark.interpreter.planning import parameter_scale
from softmark.interpreter.planning.parameter_scale import ParameterScale
from softmark.interpreter.planning.parameter_walk import Edge, PointClass, Until, Walk

Model = Callable[[float], str]  # a value -> the class of the point there


def walked(way: ParameterScale, model: Model, until: Until = "failure") -> tuple[Walk, list[float]]:
    """The walk of a fake model to its end, and the values that were looked at in order."""
    walk = Walk(way, until, {0.0: PointClass.of(model(way.at(0.0)))})
    looked = []
    while (t := walk.next_position()) is not None:
        assert t not in walk.seen, "no point is computed twice"
        looked.append(way.at(t))
        walk.record_outcome(t, PointClass.of(model(way.at(t))))
        assert len(looked) < 100
    return walk, looked


def up(nominal: float, limit: float) -> ParameterScale:
    found = parameter_scale.logarithmic_ladder(nominal, limit, "up" if abs(limit) > abs(nominal) else "down")
    assert found is not None
    return found


# ------------------------------------------------------------------ ladders


def test_factors_go_by_decades_and_end_at_the_limit() -> None:
    way = up(600e3, 600e9)
    assert [way.at(t) for t in way.rungs] == [6e6, 6e7, 6e8, 6e9, 6e10, 6e11]
    assert [up(60.0, 0.06).at(t) for t in up(60.0, 0.06).rungs] == [6.0, 0.6, 0.06]


def test_a_short_way_has_three_rungs() -> None:
    """1 to 4: by the cube root of 4, 1.5874, to six digits."""
    assert [up(1.0, 4.0).at(t) for t in up(1.0, 4.0).rungs] == [1.5874, 2.51984, 4.0]
    assert parameter_scale.logarithmic_ladder(2.0, 2.0, "up") is None


def test_negative_numbers_stay_negative() -> None:
    assert [up(-2.0, -2e3).at(t) for t in up(-2.0, -2e3).rungs] == [-20.0, -200.0, -2000.0]


def test_poisson_goes_by_decades_of_what_is_missing_and_to_one_half_itself() -> None:
    way = parameter_scale.poisson_ladder(0.3)
    assert way is not None
    values = [way.at(t) for t in way.rungs]
    assert [0.5 - v for v in values[:-1]] == pytest.approx([10.0**-k for k in range(1, 10)], rel=1e-6)
    assert values[-1] == 0.5
    assert way.between(way.rungs[-2], way.rungs[-1]) is None, "between 0.5 - 1e-9 and 0.5 lies nothing"


def test_poisson_in_a_range_ends_at_its_end() -> None:
    way = parameter_scale.poisson_ladder(0.49, 0.49999)
    assert way is not None
    assert [way.at(t) for t in way.rungs] == pytest.approx([0.499, 0.4999, 0.49999], abs=1e-12)
    assert parameter_scale.poisson_ladder(0.49999, 0.49999) is None


def test_from_zero_goes_by_decades_of_the_end() -> None:
    way = parameter_scale.decades_from_zero(1e6, "up")
    assert [way.at(t) for t in (0.0, *way.rungs)] == [0.0, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6]
    assert parameter_scale.decades_from_zero(-3.0, "down").at(7) == -3.0


def test_whole_numbers_double_and_halve() -> None:
    def values(a: int, b: int) -> list[float]:
        way = parameter_scale.doubling_ladder(a, b, "up" if b > a else "down")
        return [] if way is None else [way.at(t) for t in way.rungs]

    assert values(20, 1) == [10.0, 5.0, 2.0, 1.0]
    assert values(20, 100) == [40.0, 80.0, 100.0]
    assert values(1, 2) == [2.0]
    assert values(3, 3) == []


# ------------------------------------------------------------------ edges


@pytest.mark.parametrize("edge", [3.0, 47.0, 999.0])
def test_an_edge_is_found_to_a_ratio_of_1_2(edge: float) -> None:
    """A model that is right up to an edge and wrong beyond: the two sides are neighbours, a ratio of 1.2 apart."""
    way = up(1.0, 1e3)
    walk, looked = walked(way, lambda v: "right" if v <= edge else "inaccurate", "inaccuracy")
    found = walk.edge()
    assert found.last_right is not None
    assert found.first_wrong is not None
    low, high = way.at(found.last_right), way.at(found.first_wrong)
    assert low <= edge < high
    assert high / low <= parameter_scale.RATIO
    assert found.word == "inaccurate"
    assert len(looked) <= 3 + 4, "three rungs, and four halvings of a decade to a ratio of 1.2 (2^4 > 1 / lg 1.2)"


def test_until_failure_goes_on_to_the_last_answer_and_finds_both_edges() -> None:
    def model(v: float) -> str:
        return "right" if v <= 20 else "inaccurate" if v <= 3e3 else "not_converged"

    way = up(1.0, 1e6)
    walk, looked = walked(way, model)
    found = walk.edge()
    assert way.at(found.last_right or 0) <= 20 < way.at(found.first_wrong or 0)
    assert found.last_answer is not None
    assert found.first_silence is not None
    assert way.at(found.last_answer) <= 3e3 < way.at(found.first_silence)
    assert way.at(found.first_silence) / way.at(found.last_answer) <= parameter_scale.RATIO
    assert max(looked) == 1e4, "nothing is asked of a model beyond where it has no answer"


def test_until_inaccuracy_ends_at_the_first_point_that_is_not_right() -> None:
    _, looked = walked(up(1.0, 1e6), lambda v: "right" if v < 5 else "silent", "inaccuracy")
    assert max(looked) == 10.0


def test_a_model_that_is_right_throughout_has_no_edge() -> None:
    walk, looked = walked(up(1.0, 1e3), lambda v: "right")
    assert (looked, walk.edge()) == ([10.0, 100.0, 1e3], Edge(3.0, None, None, 3.0, None, None, 3.0))


def test_a_model_without_an_answer_at_the_start_is_not_walked() -> None:
    walk, looked = walked(up(1.0, 1e3), lambda v: "diverged")
    assert looked == []
    assert walk.edge() == Edge(None, 0.0, "diverged", None, 0.0, None, 0.0)


def test_the_end_of_the_truth_is_no_edge_of_the_model() -> None:
    walk, looked = walked(up(1.0, 1e6), lambda v: "right" if v < 50 else "unjudged")
    assert looked == [10.0 * 10**i for i in range(6)], "walked through, and not bisected"
    assert (walk.edge().last_right, walk.edge().word, walk.edge().first_blind) == (1.0, "unjudged", 2.0)
    _, fewer = walked(up(1.0, 1e6), lambda v: "right" if v < 50 else "unjudged", "inaccuracy")
    assert fewer == [10.0, 100.0, 1e3, 1e4], "three points without a truth are enough"


def test_what_is_out_of_time_is_not_bisected() -> None:
    """Each such point costs all of the time that a point may take."""
    walk, looked = walked(up(1.0, 1e3), lambda v: "right" if v < 50 else "timed_out")
    assert looked == [10.0, 100.0]
    assert walk.edge().word == "timed_out"


def test_whole_numbers_are_bisected_to_neighbours() -> None:
    way = parameter_scale.doubling_ladder(16, 1, "down")
    assert way is not None
    walk, _ = walked(way, lambda v: "right" if v >= 3 else "inaccurate")
    found = walk.edge()
    assert (way.at(found.last_right or 0), way.at(found.first_wrong or 0)) == (3.0, 2.0)
