"""The HTML report: laws that hold for every report, however odd; what it says; and how a browser takes it."""

from __future__ import annotations

import csv
import html
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from importlib.resources import files
from typing import Any
from urllib.parse import unquote

import numpy as np
import pytest
from scene_names import names_in

from softmark.interpreter.report.notebook.box_frame import LARGEST
from softmark.interpreter.report.notebook.report_box import inline
from softmark.interpreter.report.page.html_document import POLICY
from softmark.interpreter.report.run.report_page import render
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.run.tables.provenance_table import command
from softmark.interpreter.results.run_report import (
    ExpectationResult,
    MetricResult,
    ModelResult,
    ProbeResult,
    ReferenceResult,
    Report,
    ReportWarning,
    Timing,
)

Parsed = Callable[[str], Any]  # reads a page: conftest.py

# ------------------------------------------------------------------ reports of every kind

SCENE = """softmark 1
scene "Odd"
reference known = elastica(beam)
probe  axis = line(beam, from = (0, 0, 0) mm, to = (100 mm, 0 mm, 0 mm))
metric eta = relative_l2_error(axis, against = known)
metric drop = displacement(axis, along = -z)
model a = beam6dof(segments = 4)
expect a.eta < 5 %
"""
HOSTILE = "</script><script>alert(1)</script><img src=x onerror='alert(2)'>\"&`<b>`\x00\x07 http://evil.example"


def line(bend: float, n: int = 41) -> ProbeResult:
    """A line of 100 mm along x whose end sinks by `bend` metres, as a parabola."""
    X = np.zeros((n, 3))
    X[:, 0] = np.linspace(0.0, 0.1, n)
    u = np.zeros((n, 3))
    u[:, 2] = -bend * (X[:, 0] / 0.1) ** 2
    return ProbeResult(X, u)


def history(n: int, *phases: str) -> list[dict[str, Any]]:
    """Iterations whose residual falls tenfold each time."""
    return [{"phase": phases[i * len(phases) // n], "load": 1.0, "residual": 10.0**-i, "length": 1.0} for i in range(n)]


def model(name: str, bend: float = 0.021, **changes: Any) -> ModelResult:
    metrics = {"eta": MetricResult(abs(bend / 0.02 - 1), "1"), "drop": MetricResult(bend, "m")}
    timing = {"setup_s": Timing((0.1,)), "solve_s": Timing((0.2, 0.25, 0.3)), "step_s": None}
    solve = {"iterations": 6, "steps": 1, "residual": 1e-9, "history": history(6, "free", "careful")}
    own = ModelResult(
        name, "converged", None, "4 segments", {"nodes": 5, "elements": 4, "dofs": 24}, solve, timing,
        {"axis": line(bend)}, metrics,
    )  # fmt: skip
    return replace(own, **changes)


def reference(name: str = "known", bend: float = 0.02, **changes: Any) -> ReferenceResult:
    own = ReferenceResult(
        name, "converged", None, "closed form", "A. Author 1900", 1e-15, {"axis": line(bend)},
        {"drop": MetricResult(bend, "m")},
    )  # fmt: skip
    return replace(own, **changes)


def report(*models: ModelResult, references: tuple[ReferenceResult, ...] = (reference(),), **changes: Any) -> Report:
    scene = {
        "title": "Odd", "file": "odd.scene", "sha256": "0" * 64, "text": SCENE, "overridden": [],
        "parameters": {"h": {"value": 0.005, "unit": "m", "text": "5 mm"}},
    }  # fmt: skip
    environment = {"softmark": "0", "cpu": "a cpu", "threads": 2, "started": "2026-11-21T08:33:30+00:00"}
    met = ExpectationResult("a.eta < 5 %", 8, True, 0.05, "1")
    own = Report(
        scene, environment, {m.name: m for m in models}, {r.name: r for r in references}, (met,), (),
        names=names_in(SCENE),
    )  # fmt: skip
    return replace(own, **changes)


LOST = "no equilibrium was found after 50 iterations; refine the mesh, or give the load in more steps"


def lost(name: str, status: str = "not_converged") -> ModelResult:
    """A model without a solution: metrics are null and have the message as reason."""
    nothing = {k: MetricResult(None, unit, LOST) for k, unit in (("eta", "1"), ("drop", "m"))}
    steps = [*history(9, "free"), {"phase": "careful", "load": 0.5, "residual": None, "length": 0.25}]
    solve = {"iterations": 250, "steps": 0, "residual": None, "history": steps}
    return model(name, status=status, message=LOST, solve=solve, probes={}, metrics=nothing)


def hostile() -> Report:
    """Every text of a report tries to be markup."""
    warned = ReportWarning(HOSTILE, HOSTILE, 3, HOSTILE)
    expectation = ExpectationResult(HOSTILE, 8, None, None, HOSTILE, HOSTILE)
    bad = model(HOSTILE, outline=HOSTILE, message=HOSTILE, status=HOSTILE)
    worse = lost("=cmd|' /C calc'!A0")
    odd = reference(HOSTILE + "r", kind=HOSTILE, source=HOSTILE, message=HOSTILE, status="failed")
    parameters = {HOSTILE: {"value": 1.0, "unit": HOSTILE, "text": HOSTILE}}
    scene = {
        "title": HOSTILE, "file": HOSTILE, "sha256": HOSTILE, "text": f"# {HOSTILE}\nmodel x = {HOSTILE}\n",
        "overridden": [HOSTILE], "parameters": parameters,
    }  # fmt: skip
    environment = {HOSTILE: HOSTILE, "cpu": HOSTILE, "threads": HOSTILE, "started": HOSTILE}
    return report(
        bad, worse, references=(odd,), scene=scene, environment=environment, warnings=(warned,),
        expectations=(expectation,),
    )  # fmt: skip


def many() -> Report:
    """40 models of 41 points, each with 30 iterations."""
    steps = history(30, "corotational start", "free", "careful")
    solve = {"iterations": 30, "steps": 1, "residual": 1e-9, "history": steps}
    return report(*(model(f"model_{i}", 0.015 + 0.0003 * i, solve=solve) for i in range(40)))


def single() -> Report:
    """A point probe and no line."""
    point = ProbeResult(np.array([[0.1, 0, 0]]), np.array([[0, 0, -0.02]]))
    nothing = {"eta": MetricResult(0.0, "1")}
    return report(model("a", probes={"tip": point}, metrics=nothing), references=(reference(probes={"tip": point}),))


def at_rest() -> Report:
    """Nothing moves, so that a plane, a scale and a logarithm have nothing to hold on to."""
    nothing = {"eta": MetricResult(None, "1", "the reference does not move"), "drop": MetricResult(0.0, "m")}
    return report(model("a", 0.0, metrics=nothing), references=(reference(bend=0.0),))


NO_ROOT = reference("r", status="failed", probes={}, message="no root")
NOT_JUDGED = ExpectationResult("a.eta < 5 %", 8, None, None, reason="a.eta has no value")
NOT_MET = ExpectationResult("a.eta < 5 %", 8, False, 0.07, "1")
ONLY_DROP = {"drop": MetricResult(0.02, "m")}
EMPTY: dict[str, Any] = {"probes": {}, "metrics": {}, "solve": {}, "time": {}, "size": {}}
CASES: dict[str, Callable[[], Report]] = {
    "plain": lambda: report(model("a"), model("b", 0.03)),
    "failed": lambda: report(model("a"), lost("b", "failed"), references=(reference(), NO_ROOT)),
    "not_converged": lambda: report(lost("a"), lost("b", "diverged"), expectations=(NOT_JUDGED,)),
    "skipped": lambda: report(model("a"), model("b", status="skipped", message="not asked for", **EMPTY)),
    "partial": lambda: report(model("a"), references=(reference(metrics={}),), expectations=(), partial=True),
    "unmet": lambda: report(model("a"), expectations=(NOT_MET,)),
    "nothing": lambda: report(references=(), expectations=()),
    "only references": lambda: report(),
    "no reference": lambda: report(model("a", metrics=ONLY_DROP), references=()),
    "no probes": lambda: report(model("a", probes={}), references=(reference(probes={}),)),
    "single point": single,
    "at rest": at_rest,
    "exact": lambda: report(model("a", 0.02), model("b", 0.02)),
    "dwarfing": lambda: report(model("a"), model("huge", 500.0)),
    "tiny": lambda: report(model("a", 2.1e-9), references=(reference(bend=2e-9),)),
    "no text": lambda: report(model("a"), scene={"title": "No text"}, environment={}),
    "hostile": hostile,
    "many": many,
}


@pytest.fixture(scope="module")
def silicone(report_of: Callable[[str], Report]) -> Report:
    return report_of("silicone-beam")


@pytest.fixture(scope="module", params=[*CASES, "silicone-beam"])
def page(request: pytest.FixtureRequest) -> str:
    if request.param == "silicone-beam":
        return render(request.getfixturevalue("silicone"))
    return render(CASES[request.param]())


# ------------------------------------------------------------------ laws of every page


def test_structure(page: str, parsed: Parsed) -> None:
    assert page.startswith('<!DOCTYPE html>\n<html lang="en">')
    tree = parsed(page)
    for once in ("html", "head", "body", "h1", "header", "main", "nav", "footer"):
        assert tree.count(once) == 1, once
    assert tree.count("title") == 1 + page.count("<figure")
    for table_head in tree.all("th"):
        assert table_head.get("scope") in ("row", "col", "rowgroup", "colgroup")
    assert tree.count("caption") == tree.count("table")


def test_links_and_labels_lead_somewhere(page: str, parsed: Parsed) -> None:
    tree = parsed(page)
    ids = Counter(attrs["id"] for _, attrs in tree.tags if "id" in attrs)
    assert not [name for name, n in ids.items() if n > 1]
    targets = {a["href"][1:] for a in tree.all("a") if a["href"].startswith("#")}
    labels = {name for _, attrs in tree.tags for name in attrs.get("aria-labelledby", "").split()}
    assert targets | labels <= set(ids)


def test_nothing_is_loaded(page: str, parsed: Parsed) -> None:
    tree = parsed(page)
    assert {"http-equiv": "Content-Security-Policy", "content": POLICY} in tree.all("meta")
    assert "default-src 'none'" in POLICY
    for _, attrs in tree.tags:
        for name in ("src", "href", "xlink:href", "srcset", "action", "data", "poster"):
            assert attrs.get(name, "#").startswith(("#", "data:"))
            assert "http://" not in attrs.get(name, "")
            assert "https://" not in attrs.get(name, "")
        assert not [name for name in attrs if name.startswith("on")]
    assert not {"img", "link", "iframe", "object", "embed", "base", "form"} & {tag for tag, _ in tree.tags}
    assert not re.search(r"@import|url\((?!#)", page)
    # one script runs; a block of data beside it where shapes are drawn
    assert [a.get("type") for a in tree.all("script")] in ([None], ["application/json", None])


def test_figures_say_what_they_show(page: str, parsed: Parsed) -> None:
    tree = parsed(page)
    figures = page.count("<figure")
    drawings = [svg for svg in tree.all("svg") if svg.get("role") == "img"]
    assert len(drawings) == figures == page.count("<figcaption")
    assert page.count("<desc") == figures
    # a data table and a CSV file for each
    assert page.count('class="data"') == figures
    assert all(svg.get("aria-hidden") == "true" for svg in tree.all("svg") if svg.get("role") != "img")


def test_no_value_is_left_blank_or_not_a_number(page: str, parsed: Parsed) -> None:
    assert not re.search(r"<(td|th|dd)[^>]*></", page)
    assert not re.search(r"\b(nan|NaN|inf|Infinity|None)\b", parsed(page).text.replace(HOSTILE, ""))
    assert not re.search(r"(nan|inf)[ ,\"]", " ".join(re.findall(r'(?:points|d|viewBox)="([^"]*)"', page)))


def test_size(page: str, request: pytest.FixtureRequest) -> None:
    # 1 MB for 40 models of 41 points, 200 kB for a scene without shapes, 600 kB with eight of 1570 points each
    limit = 1_000_000 if "model_39" in page else 600_000 if 'class="shapes"' in page else 200_000
    assert len(page.encode()) < limit


@pytest.mark.parametrize(
    ("name", "limit"),
    [("report.js", 6000), ("raster.js", 7000), ("shapes.js", 13000), ("shapes_controls.js", 10000)],
)
def test_scripts_are_small(name: str, limit: int) -> None:
    script = files("softmark.interpreter.report.page").joinpath(name).read_text(encoding="utf-8")
    assert len(script.encode()) < limit


# ------------------------------------------------------------------ within a notebook


@pytest.fixture(scope="module", params=[*CASES, "silicone-beam"])
def shown(request: pytest.FixtureRequest) -> str:
    return inline(request.getfixturevalue("silicone") if request.param == "silicone-beam" else CASES[request.param]())


def test_what_a_notebook_shows_stands_alone_and_is_small(shown: str, parsed: Parsed) -> None:
    tree = parsed(shown)
    assert (tree.count("script"), tree.count("link"), tree.count("img")) == (0, 0, 0)  # but within the frame
    assert not [attrs for _, attrs in tree.tags if "id" in attrs or attrs.get("href", "").startswith("#")]
    assert "http://" not in shown.replace(html.escape(HOSTILE), "").replace("http://evil.example", "")
    assert len(shown) < LARGEST
    assert len(shown) < 700_000
    for frame in tree.all("iframe"):
        assert f'content="{html.escape(POLICY)}"' in frame["srcdoc"]
        assert parsed(frame["srcdoc"]).count("canvas") > 0
    assert not re.search(r"\b(nan|NaN|inf|Infinity|None)\b", tree.text.replace(HOSTILE, ""))


def test_verdicts_come_before_numbers_and_these_before_shapes(silicone: Report) -> None:
    found = inline(silicone)
    assert len(repr(silicone)) < 400
    assert all(len(repr(result)) < 200 for result in silicone.outcomes)
    places = [found.index(mark) for mark in ('class="verdict good"', 'class="verdicts"', 'class="results"', "<iframe")]
    assert places == sorted(places)
    assert "rod" in found
    assert "eta" in found
    assert "<noscript" not in found.split("<iframe")[0]


def test_hostile_text_stays_text_within_a_notebook(parsed: Parsed) -> None:
    found = inline(hostile())
    assert "<script" not in found
    assert "<img" not in found
    assert "alert(1)" in parsed(found).text


def test_of_many_rows_the_first_are_shown_and_what_is_not_met_first() -> None:
    judged = [ExpectationResult(f"a.eta < {n} %", n, n != 90, 0.05, "1") for n in range(1, 101)]
    found = inline(report(*(model(f"m{n}") for n in range(60)), expectations=tuple(judged)))
    assert "a.eta &lt; 90 %" in found
    assert "60 more expectations are in" in found
    assert "21 more rows are in" in found
    assert len(found) < 200_000


# ------------------------------------------------------------------ escaping


def test_hostile_text_stays_text(parsed: Parsed) -> None:
    page = render(hostile())
    tree = parsed(page)
    assert "alert(1)" in tree.text
    assert "<script>alert" not in page
    assert "<img" not in page
    assert "\x00" not in page
    assert "\x07" not in page
    # the payload is there in full, for whoever reads it
    assert tree.text.count("alert(2)") > 10


def test_a_spreadsheet_does_not_run_a_name(parsed: Parsed) -> None:
    rows = saved(parsed, render(hostile()), "comparison.csv")
    assert rows[2][0] == "'=cmd|' /C calc'!A0"


# ------------------------------------------------------------------ what it says


@pytest.mark.parametrize(
    ("case", "said"),
    [
        # eta = |0.021 / 0.02 - 1| = 5 %, |0.03 / 0.02 - 1| = 50 %
        ("plain", "2 models against 1 reference; the closest to known is a: 5 % (eta), the farthest is b: 50 %; 1 "),
        ("failed", "1 of 2 models gave no solution (b); 1 of 2 references gave no solution (r);"),
        ("not_converged", "2 of 2 models gave no solution (a and b); 0 of 1 expectation met, 1 not judged."),
        ("partial", "1 model so far against 1 reference; the closest to known is a: 5 % (eta); expect"),
        ("unmet", "0 of 1 expectation met."),
        ("nothing", "No model was run; no expectations."),
        ("only references", "No model was run, only 1 reference; 1 of 1 expectation met."),
        ("no reference", "1 model, no reference; 1 of 1 expectation met."),
        ("exact", "the closest to known are a and b: 0 % (eta)"),
    ],
)  # fmt: skip
def test_conclusion(case: str, said: str, parsed: Parsed) -> None:
    assert said in parsed(render(CASES[case]())).text


@pytest.mark.parametrize(
    ("case", "said"),
    [
        ("plain", "✓ Finished, everything converged, every expectation met."),
        ("failed", "✗ Finished, without a solution for b and r."),
        ("partial", "… Unfinished: the run is in progress or was interrupted."),
        ("unmet", "✗ Finished, 1 expectation not met."),
        ("nothing", "… Finished, no model was run."),
        ("skipped", "✓ Finished, everything that was run converged"),
    ],
)
def test_status_line(case: str, said: str, parsed: Parsed) -> None:
    assert said in parsed(render(CASES[case]())).text


def test_a_model_without_solution_says_why_in_full(parsed: Parsed) -> None:
    text = parsed(render(CASES["not_converged"]())).text
    assert text.count(LOST) >= 3  # once for each model, and once as the footnote of its empty cells
    assert "✗ not converged" in text
    assert "✗ diverged" in text
    assert "250 iterations; 1 residual not finite, marked at the top; only the last 10 are drawn" in text


def test_missing_values_have_footnotes() -> None:
    page = render(CASES["plain"]())
    assert "–<sup>" in page
    assert "this is the reference of the error" in page


def test_the_best_is_marked_by_words() -> None:
    page = render(CASES["plain"]())
    assert page.count('class="best">best<') == 1
    assert '<strong><data value="0.05' in page


def saved(parsed: Parsed, page: str, name: str) -> list[list[str]]:
    """The rows of a CSV link."""
    links = [a["href"] for a in parsed(page).all("a") if a.get("download") == name]
    assert len(links) == 1
    return list(csv.reader(unquote(links[0].split(",", 1)[1]).splitlines()))


def test_every_number_of_the_table_is_in_its_csv(silicone: Report, parsed: Parsed) -> None:
    page = render(silicone)
    table = page[page.index('<table class="results"') : page.index("</table>", page.index('<table class="results"'))]
    numbers = [float(v) for v in re.findall(r'<data value="([^"]*)">', table)]
    known = {
        float(cell)
        for row in saved(parsed, page, "comparison.csv")[1:]
        for cell in row
        if re.fullmatch(r"-?[\d.]+(e-?\d+)?", cell)
    }
    assert len(numbers) > 40
    assert set(numbers) <= known
    # and every metric of the report is in the table
    everyone = ReportSummary(silicone).all_results.values()
    values = [metric.value for result in everyone for metric in result.metrics.values()]
    assert {v for v in values if v is not None} <= set(numbers)


def test_figure_3_holds_every_centre_line(silicone: Report, parsed: Parsed) -> None:
    page = render(silicone)
    rows = saved(parsed, page, "axis-positions.csv")
    assert len(rows) == 1 + 41
    last = dict(zip(rows[0], rows[-1], strict=True))
    everyone = ReportSummary(silicone).all_results
    for name, result in everyone.items():
        tip = result.probes["axis"].position[-1]
        # the CSV of a figure has nine digits
        np.testing.assert_allclose([float(last[f"{name} {c} [m]"]) for c in "xyz"], tip, rtol=1e-8, atol=1e-15)
        assert f'data-name="{name}"' in page
    # gravity is along -z and the beam along x
    assert "in the x–z plane" in page


def test_curves_differ_without_colour() -> None:
    page = render(many())
    figure = page[page.index("<fieldset") : page.index("</fieldset>")]
    samples = re.findall(r'<g stroke-dasharray="([^"]*)">.*?<path class="mark" d="([^"]*)"', figure)
    assert len(samples) > 30
    assert len(set(samples)) >= 28  # dash and marker alone: 4 dashes (and the full line) by 7 markers


@pytest.mark.slow
@pytest.mark.long
def test_of_many_models_the_best_are_drawn_first(parsed: Parsed) -> None:
    tree = parsed(render(many()))
    boxes = [box for box in tree.all("input") if box["value"] == "k1"]
    assert "checked" in boxes[0]
    checked = sum("checked" in box for box in tree.all("input"))
    assert checked == 12 + 2 + 12  # both figures; in the first also the undeformed line and the reference
    assert "12 models of 40 are shown at first" in tree.text


def test_a_dwarfing_model_leaves_the_figure(parsed: Parsed) -> None:
    text = parsed(render(CASES["dwarfing"]())).text
    assert "Outside the drawing: huge." in text


def test_single_point_has_a_table(parsed: Parsed) -> None:
    page = render(single())
    assert "<figure" not in page[: page.index('id="table"')]
    assert saved(parsed, page, "tip-point.csv")[1] == ["a", "0.1", "0.0", "0.0", "0.0", "0.0", "-0.02"]


def test_repeated_warnings_come_once(parsed: Parsed) -> None:
    same = tuple(ReportWarning("W301", "linear tetrahedra lock", at, "refine") for at in (3, 5))
    text = parsed(render(report(model("a"), warnings=same))).text
    assert text.count("linear tetrahedra lock") == 1
    assert "line 3, line 5" in text


def test_command_repeats_the_run() -> None:
    once = model("a", time={"solve_s": Timing((0.1,))})
    changed = {**report().scene, "file": "my beam.scene", "overridden": ["h"]}
    assert command(ReportSummary(report(once, scene=changed))) == "dsl run 'my beam.scene' -p 'h=5 mm'"
    text = SCENE + "model b = beam6dof(segments = 8)\n"
    some = report(model("a"), scene={**report().scene, "text": text}, names=names_in(text))
    assert command(ReportSummary(some)) == "dsl run odd.scene --model a --repeat 3"
    given = {**report().scene, "file": "<text>", "overrides": ["silicone.young=30kPa"]}
    assert command(ReportSummary(report(once, scene=given))) == "dsl run - -p silicone.young=30kPa"


def test_the_navigation_calls_every_section_by_its_heading(page: str, parsed: Parsed) -> None:
    """It said "Centre lines" and "Table" where the headings are "Points" and "Comparison"."""
    links = re.findall(r'<li><a href="#([\w-]+)">(.*?)</a></li>', page.partition("</nav>")[0])
    headings = dict(re.findall(r'<h2[^>]*id="([\w-]+)-heading"[^>]*>(.*?)</h2>', page, re.DOTALL))
    assert links
    assert links == [(name, headings[name]) for name, _ in links]
