"""Measured ranges: what of a stability study reaches `dsl explain`."""

from __future__ import annotations

from typing import Any

import pytest

from softmark.interpreter.help import validity_ranges
from softmark.interpreter.help.word_pages import page

EDGES = [
    {"model": "tets", "quantity": "nu", "direction": "up", "last_right": 0.4, "first_wrong": 0.49,
     "class": "inaccurate", "last_answer": 0.5, "reason": None, "remedy": None, "reached": 0.5, "here": "right",
     "first_right": 0.3, "judged": 5, "blind": 0, "first_unjudged": None},
    {"model": "tets", "quantity": "L", "direction": "down", "last_right": None, "first_wrong": 1.0,
     "class": "not_converged", "last_answer": None, "reason": None, "remedy": None, "reached": 0.1,
     "here": "unjudged", "first_right": None, "judged": 2, "blind": 1, "first_unjudged": None},
    {"model": "tets", "quantity": "L", "direction": "up", "last_right": 10.0, "first_wrong": None,
     "class": None, "last_answer": 10.0, "reason": None, "remedy": None, "reached": 10.0,
     "here": "unjudged", "first_right": 10.0, "judged": 1, "blind": 1, "first_unjudged": None},
    {"model": "tets", "quantity": "kind", "direction": "up", "last_right": None, "first_wrong": None,
     "class": "inaccurate", "last_answer": None, "reason": None, "remedy": None, "reached": None,
     "right": ["tet10", "hex8"], "wrong": ["tet4"]},
]  # fmt: skip
STRESS: dict[str, Any] = {
    "scene": {"file": "beam-at-the-extremes", "title": "A beam"}, "environment": {"softmark": "0.1.0"},
    "summary": {"points": 12, "silent": 0},
    "studies": [{
        "within": 0.05, "models": ["tets"], "outlines": {"tets": "tet4 of about 5 mm, small strain"}, "edges": EDGES,
        "quantities": [{"name": "nu", "unit": "1", "nominal": 0.3}, {"name": "L", "unit": "m", "nominal": 1.0},
                       {"name": "kind", "unit": "1", "nominal": None}],
    }],
}  # fmt: skip


def test_ranges_say_where_a_model_is_right_and_what_comes_beyond() -> None:
    found = validity_ranges.ranges_of(STRESS, {"tets": "fem"}, 60.0)
    assert found["models"][0]["ranges"] == [
        {"quantity": "nu", "choice": False, "right": ["0.3", "0.4"],
         "beyond": {"up": "inaccurate (reported) from 0.49"}},
        {"quantity": "L", "choice": False, "right": ["10\u00a0m"], "beyond": {"down": "not converged from 1\u00a0m"}},
        {"quantity": "kind", "choice": True, "right": ["tet10", "hex8"],
         "beyond": {"up": "inaccurate (reported) with tet4"}},
    ]  # fmt: skip
    assert [validity_ranges._range_words(r) for r in found["models"][0]["ranges"]] == [
        "right from 0.3 to 0.4; above: inaccurate (reported) from 0.49",
        "right at 10\u00a0m; below: not converged from 1\u00a0m",
        "right with tet10, hex8; inaccurate (reported) with tet4",
    ]


@pytest.mark.parametrize(
    "model", ["fem", "beam6dof", "mass_spring", "modal", "rigid_contact", "rigid", "pressed_layer"]
)
def test_the_page_of_a_model_shows_its_measured_range(model: str) -> None:
    measured = validity_ranges.lines(model)
    assert measured
    assert "\n".join(measured) in (page(model) or "")
    assert any("right" in line for line in measured)


def test_what_was_not_measured_shows_no_range() -> None:
    assert validity_ranges.lines("gravity") == []


def test_a_study_of_other_words_is_not_on_the_page_of_its_models() -> None:
    assert "layer of gel" in "\n".join(validity_ranges.lines("rigid_contact"))
    assert "layer of gel" not in "\n".join(validity_ranges.lines("fem"))
