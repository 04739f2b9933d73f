"""What a stability study says of points that were not judged: nothing about right and wrong."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from softmark.interpreter.help import validity_ranges
from softmark.interpreter.planning import parameter_scale
from softmark.interpreter.planning.parameter_walk import PointClass, Walk
from softmark.interpreter.planning.varied_quantities import WalkedQuantity
from softmark.interpreter.report.robustness.robustness_page import page
from softmark.interpreter.report.robustness.robustness_terminal import table
from softmark.interpreter.study.robustness.robustness_record import ClassifiedPoint, Robustness, ValidityEdge
from softmark.interpreter.study.robustness.validity_edges import edge_of, make_choice_edge

Json = dict[str, Any]
POISSON = WalkedQuantity("gel.poisson", "gap", 0.4, "0.4")
PRECISION = WalkedQuantity("tets.precision", "choice", "double", "double", options=("double", "single"))
NO_TRUTH = "the reference is uncertain by 0.12, more than the 0.05 that counts as right"


def classified(word: str) -> ClassifiedPoint:
    return ClassifiedPoint(word, message=NO_TRUTH if word == "unjudged" else "no equilibrium", status="converged")


def walked(rule: Callable[[float], str]) -> list[ValidityEdge]:
    """The edges of a walk of Poisson's ratio from 0.4 down to 0 and up to 0.499, by the class that each value has."""
    ways, found = (parameter_scale.linear_ladder(0.4, 0.0, "down"), parameter_scale.poisson_ladder(0.4, 0.499)), []
    for way in ways:
        assert way is not None
        walk = Walk(way, "failure", {0.0: PointClass.of(rule(0.4), "converged")})
        while (t := walk.next_position()) is not None:
            walk.record_outcome(t, PointClass.of(rule(way.at(t)), "converged"))
        at = lambda model, name, value: classified(rule(float(value)))  # noqa: E731
        found.append(edge_of("rod", POISSON, walk, at, {}, {}))
    return found


def study(edges: list[ValidityEdge], quantity: WalkedQuantity, classes: dict[str, int]) -> Json:
    """A study of one quantity with nothing but its edges."""
    one = {
        "name": "everything", "metric": "eta", "against": "theory", "within": 0.05, "until": "failure",
        "models": ["rod"], "outlines": {}, "quantities": [quantity.to_json()], "points": [],
        "edges": [e.to_json() for e in edges], "maps": [],
    }  # fmt: skip
    counts = {"points": sum(classes.values()), "classes": classes, "silent": 0}
    return {"scene": {"title": "A beam", "file": "beam.scene", "text": ""}, "studies": [one], "summary": counts}


def said(found: Json) -> str:
    return table(Robustness.from_json(found), "beam.scene", [], False, None)


NOWHERE: dict[str, int] = {"unjudged": 9}


def test_what_was_not_judged_anywhere_is_neither_right_nor_wrong() -> None:
    found = study(walked(lambda nu: "unjudged"), POISSON, NOWHERE)
    for shown in (said(found), page(Robustness.from_json(found))):
        assert "not judged" in shown
        for claim in ("not right", "even at", "right up to", "right 0", "nowhere"):
            assert claim not in shown, claim
    assert said(found).count(NO_TRUTH[:40]) == 1, "both ways have the same reason"
    assert "no point was judged" in said(found)
    assert "None was wrong without a warning" not in page(Robustness.from_json(found))


def test_one_point_that_is_right_is_one_point(parsed: Callable[[str], Any]) -> None:
    """Right at 0 alone, where the scene itself, at 0.4, has no truth: nothing is known of what lies between."""
    found = study(walked(lambda nu: "right" if nu == 0 else "unjudged"), POISSON, {"right": 1, "unjudged": 8})
    assert "rod  right at 0; not judged at the value of the scene" in said(found)
    assert "0 .. 0.4" not in said(found)
    assert "0 … 0.4" not in parsed(page(Robustness.from_json(found))).text
    assert "not judged at the value of the scene" in parsed(page(Robustness.from_json(found))).text


def test_what_is_wrong_here_is_said_to_be() -> None:
    found = study(walked(lambda nu: "inaccurate"), POISSON, {"inaccurate": 9})
    assert "rod  not right, even at the value of the scene" in said(found)
    wrong = study(walked(lambda nu: "unjudged" if nu == 0.4 else "inaccurate"), POISSON, {"inaccurate": 8})
    assert "rod  not right at any judged point; not judged at the value of the scene" in said(wrong)


def test_a_whole_range_is_said_with_what_was_not_judged_in_it() -> None:
    found = study(walked(lambda nu: "right"), POISSON, {"right": 9})
    assert "rod  right 0 .. 0.5 - 0.001" in said(found) or "rod  right 0 .. 0.499\n" in said(found)
    holed = study(walked(lambda nu: "unjudged" if 0.1 < nu < 0.4 else "right"), POISSON, {"right": 7, "unjudged": 2})
    assert "; 2 points in between not judged" in said(holed)


@pytest.mark.parametrize(("here", "other", "expected"), [
    ("unjudged", "unjudged", "no valid reference: double, single"),
    ("right", "unjudged", "right: double; no valid reference: single"),
    ("unjudged", "inaccurate", "no valid reference: double; inaccurate: single"),
])  # fmt: skip
def test_choices_are_listed_under_what_each_came_to(here: str, other: str, expected: str) -> None:
    seen = {"double": classified(here), "single": classified(other)}
    edge = make_choice_edge("rod", PRECISION, seen, lambda m, n, v: seen[str(v)], {}, ["rod"])
    found = study([edge], PRECISION, {here: 1, other: 1})
    assert f"rod  {expected}\n" in said(found)
    assert edge.remedy is None or other == "inaccurate", "a finer mesh does not mend the truth"
    assert "right: none" not in said(found)
    page(Robustness.from_json(found))


def test_the_measured_range_of_a_model_does_not_take_the_scene_for_judged() -> None:
    """Walked up alone from where nothing is known: the scene's own value is no end of what is right."""
    up = walked(lambda nu: "right" if nu > 0.41 else "unjudged")[1:]
    one = {**study(up, POISSON, {"right": 3}), "environment": {}}
    one["studies"][0]["outlines"] = {"rod": "20 segments"}
    entry = validity_ranges.ranges_of(one, {"rod": "beam6dof"}, 60.0)["models"][0]["ranges"][0]
    assert entry["right"] == ["0.499"] or "0.4" not in entry["right"]
    nothing = {**study(walked(lambda nu: "unjudged"), POISSON, NOWHERE), "environment": {}}
    assert "not judged" in validity_ranges._range_words(
        validity_ranges.ranges_of(nothing, {"rod": "beam6dof"}, 60.0)["models"][0]["ranges"][0]
    )
