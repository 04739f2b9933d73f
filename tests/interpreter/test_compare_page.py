"""The page and the table of `dsl compare`: laws that hold for every comparison, however odd, and what they say.

Comparisons are made up: a model's error falls as `size * h^order` and its time grows as h^-2.5, as finite elements do.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest

from softmark.interpreter.report.comparison.comparison_page import page as page_of
from softmark.interpreter.report.comparison.comparison_terminal import error_tables
from softmark.interpreter.report.comparison.comparison_terminal import table as table_of
from softmark.interpreter.report.notebook.box_frame import LARGEST
from softmark.interpreter.report.notebook.comparison_box import inline
from softmark.interpreter.report.page.html_document import POLICY
from softmark.interpreter.study.analysis.comparison_record import ComparisonRecord

Json = dict[str, Any]
Parsed = Callable[[str], Any]  # reads a page: conftest.py
HOSTILE = "</script><script>alert(1)</script><img src=x onerror='alert(2)'>\"&`<b>`\x00 http://evil.example"
LINE = [[0.01 * i, 0.0, 0.0] for i in range(11)]


def page(made: Json) -> str:
    return page_of(ComparisonRecord.from_json(made))


def table(made: Json, colour: bool, path: str | None = None) -> str:
    return table_of(ComparisonRecord.from_json(made), colour, path)


def analysed(made: Json) -> Json:
    """With its analysis."""
    return {**made, "analysis": ComparisonRecord.from_json(made).analysis.to_json()}


def spread(median: float, runs: int = 5) -> Json:
    return {"median": median, "q1": 0.95 * median, "q3": 1.06 * median, "min": 0.9 * median, "max": 1.2 * median,
            "runs": runs}  # fmt: skip


def cost(time: float, **changes: Any) -> Json:
    shares = {
        "mesh": 0.1,
        "set-up": 0.1,
        "assembly": 0.3,
        "factorisation": 0.3,
        "solution": 0.15,
        "other": 0.05,
    }
    own = {
        "cpu_s": spread(time), "wall_s": spread(time), "step_s": None, "setup_s": spread(0.2 * time),
        "phases": {name: share * time for name, share in shares.items()} | {"output": 0.0}, "memory_bytes": 12_300_000,
        "flags": [], "contaminated": False, "excluded_runs": 0, "frame_s": time,
    }  # fmt: skip
    return {**own, **changes}


def point(
    model: str, h: float | None = 0.005, /, scale: float = 300.0, order: float = 2.0, **changes: Any
) -> Json:  # fmt: skip
    """A configuration; `scale` scales its error, and an error of 1 is one that is as large as the displacement."""
    own = 0.005 if h is None else h
    error = scale * own**order
    sag = [[0.0, 0.0, -0.02 * (1 - error) * (x / 0.1) ** 2] for x, _, _ in LINE]
    label = model if h is None else f"{model}, h = {1e3 * own:g} mm"
    made = {
        "key": f"key of {label}", "scene": "beam", "model": model, "label": label, "study": h and "refine",
        "variation": {} if h is None else {"h": f"{1e3 * own:g} mm"}, "numbers": {} if h is None else {"h": own},
        "status": "converged", "message": None, "outline": f"tet4 of about {1e3 * own:g} mm",
        "size": {"nodes": round(1e-5 / own**3), "elements": 4, "dofs": 3 * round(1e-5 / own**3)},
        "solve": {"iterations": 7, "linear_solver": "cholmod"},
        "errors": {
            "eta": {"value": error, "unit": "1", "uncertainty": 0.001, "against": "truth"},
            "tip": {"value": 0.02 * error, "unit": "m", "uncertainty": 2e-5, "against": "truth"},
            "drop": {"value": 0.02, "unit": "m", "against": None},
        },
        "probes": {"axis": {"points": LINE, "displacement": sag}}, "cost": cost(0.05 * (0.005 / own) ** 2.5),
        "warnings": [{"code": "W301", "message": "linear tetrahedra lock"}],
        "resolution": {"of": {"size": own}, "formal": {"size": 2}, "problem": "", "meshed": False, "counts": None},
    }  # fmt: skip
    return {**made, **changes}


def lost(model: str, status: str = "diverged", message: str | None = "no equilibrium was found") -> Json:
    nothing = {"eta": {"value": None, "unit": "1", "reason": message, "against": "truth"}}
    return point(model, None, status=status, message=message, errors=nothing, probes={}, cost=None, size={}, solve={})


def truth(**changes: Any) -> Json:
    sag = [[0.0, 0.0, -0.02 * (x / 0.1) ** 2] for x, _, _ in LINE]
    own = {"kind": "closed form", "source": "A. Author 1900", "status": "converged", "message": None,
           "estimated_error": 1e-6, "probes": {"axis": {"points": LINE, "displacement": sag}}}  # fmt: skip
    return {**own, **changes}


def comparison(*points: Json, references: Json | None = None, **options: Any) -> Json:
    known = {"beam": {"truth": truth()}} if references is None else references
    return analysed({
        "schema": "softmark-compare/1", "created": "2026-11-21T08:33:30+00:00", "command": "dsl compare beam.scene",
        "environment": {"softmark": "0", "cpu": "a cpu", "threads": 1},
        "scenes": [{"name": "beam", "title": "A beam", "file": "beam.scene", "sha256": "0" * 64, "text": "softmark 1"}],
        "points": list(points), "references": known, "analysis": {"options": options},
    })  # fmt: skip


SIZES = (0.02, 0.01, 0.005, 0.0025)


def refined(model: str, **how: Any) -> list[Json]:
    return [point(model, h, **how) for h in SIZES]


def with_errors(value: float | None, uncertainty: float | None) -> list[Json]:
    own = {"eta": {"value": value, "unit": "1", "uncertainty": uncertainty, "against": "truth", "reason": "none"}}
    return [{**p, "errors": own} for p in refined("fem")]


def usual() -> Json:
    capped, disturbed = point("mpm", None, status="capped"), point("sph", None)
    disturbed["cost"] |= {"contaminated": True, "flags": ["shared"], "excluded_runs": 2}
    return comparison(
        *refined("fem"),
        *refined("tet10", scale=2e4, order=3.0),
        point("rod", None, 30.0),
        capped,
        disturbed,
        lost("springs"),
    )


def moving() -> Json:
    steps = {"median": 0.004, "p95": 0.006, "p99": 0.007, "max": 0.02, "steps": 100, "runs": 5}
    return comparison(*({**p, "cost": cost(1.0, step_s=steps, frame_s=0.004)} for p in refined("fem")))


def hostile() -> Json:
    bad = point("x", None, model=HOSTILE, label=HOSTILE, key=HOSTILE, outline=HOSTILE, message=HOSTILE, study=HOSTILE,
                variation={HOSTILE: HOSTILE}, solve={"linear_solver": HOSTILE, "iterations": 1},
                warnings=[{"code": HOSTILE, "message": HOSTILE}])  # fmt: skip
    bad["errors"] = {HOSTILE: {"value": 0.1, "unit": HOSTILE, "against": HOSTILE}}
    worse = {**lost("y"), "label": HOSTILE + "2", "message": HOSTILE, "status": HOSTILE}
    made = comparison(bad, worse, references={"beam": {HOSTILE: truth(source=HOSTILE, kind=HOSTILE)}})
    made["scenes"][0] |= {"title": HOSTILE, "text": HOSTILE, "file": HOSTILE}
    return {**made, "command": HOSTILE, "created": HOSTILE, "environment": {HOSTILE: HOSTILE}}


def two_scenes() -> Json:
    second = [{**p, "scene": "cube", "key": f"cube {p['key']}"} for p in refined("fem")]
    return comparison(*refined("fem"), *second, references={"beam": {"truth": truth()}, "cube": {}})


def many() -> Json:
    return comparison(*(p for i in range(50) for p in refined(f"model_{i}", scale=200.0 + 10 * i)))


def asking() -> Json:
    studies = {
        "refine": {"kind": "sweep", "target": "h", "over": [], "models": None, "with": None},
        "settling": {"kind": "convergence", "metric": "drop", "over": "refine"},
        "worth": {"kind": "pareto", "error": "eta", "cost": None, "over": "refine"},
        "cheap": {"kind": "pareto", "error": "eta", "cost": "drop", "over": None},
    }
    members = refined("fem")
    for p, h in zip(members, SIZES, strict=True):
        p["errors"]["drop"]["value"] = 0.02 - 4.0 * h**2
    return analysed({**comparison(*members, lost("springs")), "studies": {"beam": studies}})


CASES: dict[str, Callable[[], Json]] = {
    "usual": usual,
    "moving": moving,
    "asking": asking,
    "hostile": hostile,
    "two scenes": two_scenes,
    "200 points": many,
    "nothing": lambda: comparison(references={}),
    "one": lambda: comparison(point("fem", None)),
    "no references": lambda: comparison(*({**p, "errors": {}} for p in refined("fem")), references={}),
    "no timings": lambda: comparison(*({**p, "cost": None} for p in refined("fem"))),
    "all failed": lambda: comparison(lost("a"), lost("b", "failed", None), lost("c", "timed_out")),
    "a failed reference": lambda: comparison(
        lost("a"), references={"beam": {"truth": truth(status="failed", probes={})}}
    ),
    "null everywhere": lambda: comparison(*with_errors(None, None)),
    "zero error": lambda: comparison(*with_errors(0.0, None)),
    "zero error, uncertain": lambda: comparison(*with_errors(0.0, 0.01)),
    "far below": lambda: comparison(*with_errors(1e-12, 0.01), *refined("other", scale=1e-9)),
    "all disturbed": lambda: comparison(*({**p, "cost": cost(1.0, contaminated=True)} for p in refined("fem"))),
    "disturbed, allowed": lambda: comparison(
        *({**p, "cost": cost(1.0, contaminated=True)} for p in refined("fem")), allow_contaminated=True
    ),
    "no analysis": lambda: {k: v for k, v in usual().items() if k != "analysis"},
}


@pytest.mark.parametrize("case", CASES)
def test_every_page_is_whole_and_needs_nothing_else(case: str, parsed: Parsed) -> None:
    made = CASES[case]()
    json.dumps(made, allow_nan=False)
    text = page(made)
    whole = parsed(text)
    metas = [a for t, a in whole.tags if t == "meta"]
    assert POLICY in [a.get("content") for a in metas if a.get("http-equiv") == "Content-Security-Policy"]
    for tag, attributes in whole.tags:
        for name in ("src", "href", "srcset", "data", "action", "poster"):
            assert not attributes.get(name, "").lower().startswith(("http", "//", "file")), (tag, attributes)
    style = "".join(re.findall(r"<style>(.*?)</style>", text, re.DOTALL))
    assert "url(" not in style
    assert "@import" not in style
    identities = [a["id"] for _, a in whole.tags if "id" in a]
    assert len(identities) == len(set(identities))
    drawn = [a.get(k, "") for t, a in whole.tags for k in ("d", "points", "x", "y", "cx", "cy", "viewbox", "style")]
    numbers = " ".join(drawn)
    assert not re.search(r"\bnan\b|\binf\b", numbers, re.IGNORECASE)
    assert not re.search(r"\bnan\b|\binfinity\b", whole.text, re.IGNORECASE)
    anchors = [a["href"][1:] for t, a in whole.tags if t == "a" and a.get("href", "").startswith("#")]
    assert set(anchors) <= set(identities)
    scripts = [a for t, a in whole.tags if t == "script"]
    assert scripts == [{}]


@pytest.mark.parametrize("case", [c for c in CASES if c != "hostile"])
def test_every_label_is_on_the_page_and_in_the_terminal(case: str, parsed: Parsed) -> None:
    made = CASES[case]()
    text, shown = parsed(page(made)).text, table(made, False)
    for label in {p["label"] for p in made["points"]}:
        assert label in text
        assert label in shown
    assert not re.search(r"\bnan\b|\binf\b", shown, re.IGNORECASE)
    assert "\x1b" not in shown


@pytest.mark.parametrize("case", ["usual", "moving", "hostile", "two scenes", "nothing", "one"])
def test_a_notebook_shows_the_advice_then_numbers_then_the_figure(case: str, parsed: Parsed) -> None:
    found = inline(ComparisonRecord.from_json(CASES[case]()))
    tree = parsed(found)
    assert (tree.count("script"), tree.count("img"), tree.count("link")) == (0, 0, 0)  # but within the frame
    assert len(found) < LARGEST
    marks = [found.find(mark) for mark in ('class="advice"', 'class="compared', "<iframe")]
    assert [m for m in marks if m >= 0] == sorted(m for m in marks if m >= 0)
    if case == "usual":
        assert min(marks) > 0


def test_a_notebook_shows_the_first_of_many(monkeypatch: pytest.MonkeyPatch, parsed: Parsed) -> None:
    monkeypatch.setattr("softmark.interpreter.report.notebook.comparison_box.ROWS", 2)
    found = parsed(inline(ComparisonRecord.from_json(usual()))).text
    assert f"2 of {len(usual()['points'])} configurations" in found
    assert "more are in comparison.points" in found


def test_the_advice_comes_first_and_failures_say_why(parsed: Parsed) -> None:
    made = usual()
    text = parsed(page(made)).text
    for advice in made["analysis"]["advice"]:
        said = advice["text"].replace("`", "").replace("\u00a0", " ").replace("\u202f", " ")
        assert said.split(" Its ")[0] in text
    assert text.index("is the fastest") < text.index("Lower left is better")
    assert "springs diverged: no equilibrium was found" in text
    assert "a thread had less than 95 % of a processor" in text


def test_a_figure_for_each_error_with_a_curve_for_each_line() -> None:
    made = usual()
    text = page(made)
    lines = [line["label"] for line in made["analysis"]["scenes"]["beam"]["lines"]]
    assert lines == ["fem", "tet10", "rod", "mpm", "sph", "springs"]
    for number, metric in enumerate(("eta", "tip")):  # `drop` is measured from nothing
        figure = re.search(rf'<figure[^>]*id="work-0-{number}">.*?</figure>', text, re.DOTALL)
        assert figure is not None
        names = re.findall(r'class="curve [^"]*" data-name="([^"]*)"', figure[0])
        assert names == lines
        front = made["analysis"]["scenes"]["beam"]["metrics"][metric]["front"]
        assert len(re.findall(r'class="on-front k', figure[0])) == len(front) > 1
        assert figure[0].count('class="capped k') == figure[0].count('class="disturbed k') == 1
        assert 'class="uncertain"' in figure[0]
    assert "work-0-2" not in text


def test_the_pixels_are_those_of_the_numbers() -> None:
    # fem: the error falls fourfold and the time grows 2^2.5-fold with each halving: all steps are equally long
    text = page(comparison(*refined("fem")))
    line = re.search(r'data-name="fem".*?<polyline points="([^"]*)"', text, re.DOTALL)
    assert line is not None
    pixels = [tuple(map(float, p.split(","))) for p in line[1].split()]
    steps = [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(pixels)]
    assert len(steps) == 3
    for dx, dy in steps:  # a tenth of a pixel is what is written
        assert (dx, dy) == pytest.approx(steps[0], abs=0.2)
        assert dx > 0
        assert dy > 0


def test_steps_have_a_figure_of_their_own_with_the_rates() -> None:
    text = page(moving())
    whole, steps = (re.search(rf'id="work-0-0{s}">.*?</figure>', text, re.DOTALL) for s in ("", "-frame"))
    assert whole is not None
    assert steps is not None
    assert 'class="rate"' not in whole[0]  # a frame is no time of the whole
    assert 'class="rate"' in steps[0]


def test_errors_are_told_before_times_are_known() -> None:
    """Of every scene and configuration, and nothing of what to take."""
    made = two_scenes()
    for each in made["points"]:
        each["cost"] = None
    shown = error_tables(ComparisonRecord.from_json(made), colour=False)
    assert shown.count("errors; times are still being measured") == len({p["scene"] for p in made["points"]})
    assert all(p["label"] in shown for p in made["points"])
    assert "->" not in shown
    assert "CPU time" not in shown
    assert "* on the Pareto front: no configuration has fewer unknowns and a smaller error" in shown


def test_without_times_errors_stand_against_unknowns(parsed: Parsed) -> None:
    text = parsed(page(CASES["no timings"]())).text
    assert "No times were measured, so errors are plotted against the number of unknowns" in text
    assert "is the smallest" in text


def test_studies_are_answered(parsed: Parsed) -> None:
    # drop = 20 mm - 4 h^2: second order, and 20 mm in the limit; h from 20 to 2.5 mm, so the finest has 19.975 mm
    text, shown = parsed(page(asking())).text, table(asking(), False)
    assert "settling: convergence of drop over refine" in text
    assert "settling: drop of fem: order 2.00, limit 20 mm" in shown
    assert "19.975 mm" in text
    # time grows as the error falls, so all four are on the front; of drop, the coarsest has least and errs most
    assert "worth: configurations over refine that no other one beats in both error and cost. 4 configurations" in text
    assert "cheap: on the Pareto front of eta and drop: fem, h = 20 mm (18.4 mm), fem, h = 10 mm (19.6 mm)" in shown


def test_the_saved_tables_have_every_point(parsed: Parsed) -> None:
    made = usual()
    links = {a["download"]: unquote(a["href"]) for t, a in parsed(page(made)).tags if t == "a" and "download" in a}
    rows = links["beam-points.csv"].split("\r\n")
    assert rows[0].startswith("data:text/csv;charset=utf-8,configuration,model,study,status")
    assert "eta [1],uncertainty of eta [1]" in rows[0]
    assert len(rows) == len(made["points"]) + 2  # the head, and the end of the last line
    assert {"eta-against-cpu_s.csv", "beam-distances.csv", "beam-costs.csv"} <= set(links)


def test_the_terminal_marks_the_front_and_ends_with_the_advice() -> None:
    made = usual()
    shown = table(made, False, "out/compare.html")
    front = {made_["key"] for made_ in made["points"]} & set(
        made["analysis"]["scenes"]["beam"]["metrics"]["eta"]["front"]
    )
    marked = [line for line in shown.splitlines() if "*" in line and not line.startswith("*")]
    assert len(marked) == len(front)
    assert shown.index("-> For an error of") > shown.index("springs: no equilibrium was found")
    assert shown.endswith("comparison: out/compare.html")
    assert "uncertainty of eta: ±0.1 %" in " ".join(shown.split())
    assert "\x1b[" in table(made, True)


def test_without_an_error_both_say_so(parsed: Parsed) -> None:
    made = comparison(point("rod", errors={"drop": {"value": 0.02, "unit": "m", "against": None}}), references={})
    for shown in (parsed(page(made)).text, table(made, False)):
        assert "No metric is against a reference, so no error was measured" in shown


def test_what_others_wrote_steers_no_terminal() -> None:
    """U+001B begins what a terminal obeys; U+202E turns the direction of what follows."""
    odd = "a\x1b[2J\u202eb"
    bad = point("x", None, label=odd, problem={odd: odd}, errors={"eta": {"value": 0.1, "unit": "1", "against": odd}})
    worse = {**lost("y"), "label": odd + "2", "message": odd, "status": odd}
    made = comparison(bad, worse, references={"beam": {"truth": truth(status="failed", message=odd)}})
    made["scenes"][0]["title"] = odd
    shown = table(made, False)
    assert "a\u241b[2J\ufffdb" in shown
    assert not set("\x1b\u202e") & set(shown)


def test_what_an_older_file_does_not_say_has_a_default() -> None:
    """The least that a `softmark-compare/1` may hold (results/json_validation.py): models and options."""
    found = ComparisonRecord.from_json({"points": [{"model": "rod"}], "references": {"s": {"truth": {}}}})
    (rod,) = found.points
    assert (rod.label, rod.solved, rod.timed) == ("rod", False, False)
    assert (rod.effort("cpu_s"), rod.error("eta"), rod.problem) == (None, None, {})
    assert found.references["s"]["truth"].status == "converged"
    assert "rod" in page_of(found)
    assert "rod" in table_of(found, False)


CHROMIUM = shutil.which("chromium")


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not on the PATH")
@pytest.mark.parametrize(("case", "width"), [("usual", 1280), ("200 points", 500), ("hostile", 1280)])
def test_in_chromium(case: str, width: int, tmp_path: Path) -> None:
    """Its console stays silent, and the page itself never scrolls sideways."""
    probe = (
        "<script>const e = document.documentElement; e.dataset.wide = e.scrollWidth > e.clientWidth;"
        "const box = document.querySelector('.drawing'); if (box) { box.focus(); box.dispatchEvent("
        "new KeyboardEvent('keydown', { key: 'Home', bubbles: true }));"
        "e.dataset.tip = box.querySelector('.tip').textContent; }</script></body>"
    )
    file = tmp_path / "page.html"
    file.write_text(page(CASES[case]()).replace("</body>", probe), encoding="utf-8")
    flags = [
        "--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--enable-logging=stderr",
        "--virtual-time-budget=2000", f"--user-data-dir={tmp_path / 'profile'}", f"--window-size={width},900",
        "--dump-dom",
    ]  # fmt: skip
    done = subprocess.run(
        [str(CHROMIUM), *flags, file.as_uri()], capture_output=True, text=True, timeout=120, check=True
    )
    assert "CONSOLE" not in done.stderr, done.stderr
    assert 'data-wide="false"' in done.stdout
    if case == "usual":
        tip = re.search(r'data-tip="([^"]*)"', done.stdout)
        assert tip is not None
        for words in ("unknowns", "error", "time", "iterations", "cholmod"):
            assert words in tip[1]
