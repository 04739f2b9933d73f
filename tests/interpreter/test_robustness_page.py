"""The page of `dsl stress`: what it says of a made-up study, whose classes follow a rule that is known."""

from __future__ import annotations

import html
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from softmark.interpreter.planning.varied_quantities import WalkedQuantity
from softmark.interpreter.report.notebook.robustness_box import inline
from softmark.interpreter.report.page.html_document import POLICY
from softmark.interpreter.report.robustness.robustness_page import page, repeat_command
from softmark.interpreter.report.robustness.robustness_view import format_value, point_tooltip, ruler
from softmark.interpreter.study.robustness.robustness_record import Robustness, RobustnessPoint

Json = dict[str, Any]
Parsed = Callable[[str], Any]  # reads a page: conftest.py
HOSTILE = '</script><script>alert(1)</script>"&`<b>`\x00 http://evil.example'
POISSON = {"name": "rubber.poisson", "unit": "1", "nominal": 0.3, "text": "0.3", "kind": "gap", "limits": [0.3, 0.5]}
LOAD = {"name": "tip.total", "unit": "N", "nominal": 1.0, "text": "(0, 0, -1) N", "kind": "factor", "limits": [1, 1e3]}
CHOICE = {"name": "tets.precision", "unit": "1", "nominal": None, "text": "double", "kind": "choice", "limits": []}
RATIOS = (0.3, 0.4, 0.49, 0.499, 0.4999, 0.5)
LOADS = (1.0, 10.0, 100.0, 1000.0)


def point(model: str, name: str, error: float | None, **values: Any) -> RobustnessPoint:
    said = {n.replace("_", ".", 1): v for n, v in values.items()}
    stated = {"value": 0.02, "parts": {}, "doubts": [], "reason": None} if error is not None else None
    return RobustnessPoint.from_json({
        "key": f"{model}{values}", "model": model, "values": said, "texts": {n: str(v) for n, v in said.items()},
        "class": name, "error": error, "stated": stated, "uncertainty": 1e-4, "code": None, "warnings": [],
        "message": "no equilibrium" if error is None else None, "cpu_s": 0.1,
    })  # fmt: skip


def made_of(silent: bool = False, hostile: str = "") -> Robustness:
    """Tetrahedra lock above 0.499, both fail at 1000 N, and the pair fails sooner."""
    points = []
    for model in ("tets", "mixed"):
        for nu in RATIOS:
            locks = model == "tets" and nu > 0.499
            points.append(point(model, "inaccurate" if locks else "right", 0.4 if locks else 0.01, rubber_poisson=nu))
        for load in LOADS[1:]:
            ends = load > 100
            points.append(point(model, "not_converged" if ends else "right", None if ends else 0.02, tip_total=load))
    if silent:
        points.append(point("tets", "silent", 0.3, tip_total=500.0))
    classes = [["right" if nu < 0.5 and f < 1000 else "not_converged" for nu in RATIOS] for f in LOADS]
    edges = [
        {"model": "tets", "quantity": "rubber.poisson", "direction": "up", "last_right": 0.499, "first_wrong": 0.4999,
         "class": "inaccurate", "last_answer": 0.5, "reason": "linear tetrahedra lock" + hostile,
         "remedy": "use `formulation = mixed`", "reached": 0.5, "here": "right", "first_right": 0.3, "judged": 6,
         "blind": 0, "first_unjudged": None},
        {"model": "mixed", "quantity": "rubber.poisson", "direction": "up", "last_right": 0.5, "first_wrong": None,
         "class": None, "last_answer": 0.5, "reason": None, "remedy": None, "reached": 0.5, "here": "right",
         "first_right": 0.3, "judged": 6, "blind": 0, "first_unjudged": None},
        {"model": "tets", "quantity": "tets.precision", "direction": "up", "last_right": None, "first_wrong": None,
         "class": None, "last_answer": None, "reason": None, "remedy": None, "reached": None,
         "right": ["double", "single"], "wrong": []},
    ]  # fmt: skip
    counts = Counter(p.found.word for p in points)
    study = {
        "name": "edges", "metric": "sag_error", "against": "theory", "within": 0.05, "until": "failure",
        "models": ["tets", "mixed"], "outlines": {}, "quantities": [POISSON, LOAD, CHOICE],
        "points": [p.to_json() for p in points],
        "edges": edges,
        "maps": [{"model": "tets", "x": "rubber.poisson", "y": "tip.total", "xs": list(RATIOS), "ys": list(LOADS),
                  "classes": classes, "errors": [[0.01 if c == "right" else None for c in row] for row in classes]}],
    }  # fmt: skip
    return Robustness.from_json({
        "schema": "softmark-stress/1", "created": "2026-01-02T03:04:05+00:00", "environment": {"softmark": "1"},
        "command": "dsl stress beam.scene", "studies": [study],
        "scene": {"title": "A beam" + hostile, "file": "beam.scene", "sha256": "0", "text": "scene 'x'" + hostile},
        "summary": {"points": len(points), "classes": dict(counts), "silent": counts["silent"]},
    })  # fmt: skip


def test_the_page_says_how_many_points_were_what(parsed: Parsed) -> None:
    found = parsed(page(made_of()))
    assert "18 points of 2 models: 14 right, 2 inaccurate (reported) and 2 not converged" in found.text
    assert "None was wrong without a warning." in found.text
    assert not re.search(r"\bnan\b|None,", found.text)


def test_points_that_are_wrong_without_a_word_come_first_with_their_command(parsed: Parsed) -> None:
    found = parsed(page(made_of(silent=True)))
    assert "1 wrong without a warning!" in found.text
    headings = [attrs["id"] for attrs in found.all("section")]
    assert headings[:2] == ["silent", "edges"]
    assert "dsl run beam.scene -p tip.total=500.0 --model tets" in found.text


def test_each_end_of_a_range_says_what_comes_beyond(parsed: Parsed) -> None:
    found = parsed(page(made_of())).text
    assert "above: inaccurate (reported) from 0.4999" in found
    assert "0.3 … 0.499" in found
    assert "double, singleright with all" in found
    assert "above: right up to the last tested value, 0.5" in found
    assert "linear tetrahedra lock; use formulation = mixed" in found


def test_figures_have_a_mark_for_every_point_of_a_walk_and_a_cell_for_every_pair(parsed: Parsed) -> None:
    found = parsed(page(made_of()))
    marks = [attrs for attrs in found.all("g") if attrs.get("class", "").startswith("stress-mark")]
    cells = [attrs for attrs in found.all("rect") if attrs.get("class", "").startswith("cell")]
    nominal = 2  # the nominal point of each model stands on both strips
    assert len(marks) == 18 + nominal + len({p.found.word for p in made_of().points})
    assert len(cells) == len(RATIOS) * len(LOADS)


def test_the_page_runs_nothing_that_a_scene_holds(parsed: Parsed) -> None:
    written = page(made_of(silent=True, hostile=HOSTILE))
    found = parsed(written)
    assert html.escape(POLICY) in written
    assert "alert(1)</script>" not in written
    assert found.count("script") == 1
    assert not any(attrs["href"].startswith("http") for attrs in found.all("a"))


@pytest.mark.parametrize(
    ("asked", "values", "kind"),
    [
        (POISSON, RATIOS, "gap"),
        (LOAD, LOADS, "log"),
        (CHOICE, ("double", "single"), "turn"),
        (LOAD, (0.0, 1.0, 1e6), "turn"),
        (LOAD, (1.0, 1.5, 2.0), "linear"),
    ],
)
def test_values_stand_in_order_on_the_scale_that_parts_them(asked: Json, values: tuple[Any, ...], kind: str) -> None:
    scale = ruler(WalkedQuantity.from_json(asked), values)
    places = [scale.at(v) for v in scale.marks]
    assert scale.kind == kind
    assert places == sorted(places)
    assert (places[0], places[-1]) == (0.0, 1.0)


def test_the_nines_of_a_ratio_are_kept() -> None:
    assert format_value(0.499999999, "1") == "0.499999999"


def test_a_point_says_its_error_and_what_the_model_states() -> None:
    said = point_tooltip(point("tets", "inaccurate", 0.4, rubber_poisson=0.4999))
    assert said == "rubber.poisson = 0.4999: inaccurate (reported), error 40 %, estimated error 2 %"


def test_a_command_is_quoted_for_a_shell() -> None:
    own = replace(point("tets", "silent", 0.4, rubber_poisson=0.4999), texts={"tip.total": "(0, 0, -1) N"})
    assert repeat_command("my beam.scene", own) == "dsl run 'my beam.scene' -p 'tip.total=(0, 0, -1) N' --model tets"


def test_a_notebook_shows_what_is_wrong_first_and_no_markup_of_a_scene(parsed: Parsed) -> None:
    found = inline(made_of(silent=True, hostile=HOSTILE))
    assert found.index("dsl run beam.scene") < found.index('class="edges"') < found.index("<iframe")
    assert "alert(1)</script>" not in found.split("<iframe")[0]
    assert parsed(found).count("script") == 0
    assert "inaccurate (reported) from 0.4999" in parsed(found).text
