"""Shapes, published values, distributions, real time and histories in the report; and the files for ParaView."""

from __future__ import annotations

import base64
import csv
import html
import json
import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.parse import unquote
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from scene_names import names_in
from tubes import tube

from softmark.interpreter.report.charts.viridis import VIRIDIS, viridis
from softmark.interpreter.report.files import report_files as disk
from softmark.interpreter.report.notebook.report_box import SHAPES, inline
from softmark.interpreter.report.page.html_document import load_asset
from softmark.interpreter.report.run.report_page import render
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.run.report_terminal import table
from softmark.interpreter.report.run.tables.metric_details import unit_of
from softmark.interpreter.report.view3d import compact_surfaces
from softmark.interpreter.report.view3d.shapes_section import PANELS
from softmark.interpreter.results import vtk_writer
from softmark.interpreter.results.error_statements import StatedError
from softmark.interpreter.results.run_report import (
    DrawnSurface,
    ExpectationResult,
    MetricResult,
    ModelResult,
    ProbeResult,
    ReferenceResult,
    Report,
)
from softmark.solvers.elements import ELEMENTS

SCENE = """softmark 1
scene "Shapes"
probe tip = point(beam, at = (100 mm, 0 mm, 0 mm))
metric gap = mean_error(tip, against = scan)
metric frame = realtime_factor(rate = 25 Hz)
"""


def model(name: str, bend: float, frames: int = 0, along: int = 40) -> ModelResult:
    """A model with a shape, a distance, frames of a clock and, with `frames`, a history."""
    X, triangles = tube(bend, along)
    error = np.linalg.norm(X - tube(0.02, along)[0], axis=1)
    times = np.linspace(0.0, 0.5, frames) if frames else None
    course = None if times is None else np.array([tube(bend * t / 0.5, along)[0] for t in times])
    late = tuple(float(v) for v in np.linspace(0.4, 1.2, 60))
    clock = {
        "verdict": False, "verdict_reason": "99 % of the frames take at most 0.048 s of 0.04 s", "margin": -0.2,
        "limit_s": 0.04, "median_s": 0.032, "p95_s": 0.046, "p99_s": 0.048, "worst_s": 0.048, "worst_frame": 60,
        "missed": 15, "frames": 60, "cpu_median_s": None, "rate_Hz": 25.0,
    }  # fmt: skip
    spread = {
        "mean_m": float(error.mean()),
        "sd_m": float(error.std()),
        "relative_mean": 0.1,
        "relative_points": 5,
    }
    metrics = {
        "gap": MetricResult(float(error.mean()), "m", None, spread, tuple(error.tolist()), 5e-4, 0.0045),
        "frame": MetricResult(1.2, "1", None, clock, late),
    }
    solve: dict[str, Any] = {"iterations": 60}
    u = np.array([[0.0, 0.0, -bend]])
    tip = ProbeResult(np.array([[0.1, 0.0, 0.0]]), u)
    if times is not None:
        moments = np.linspace(0.0, 0.5, 500)
        tip = replace(tip, times=moments, course=np.sin(20 * moments)[:, None, None] * u[None])
        kinetic, potential = np.sin(20 * moments) ** 2, np.cos(20 * moments) ** 2
        energies = {
            "kinetic": kinetic.tolist(),
            "potential": potential.tolist(),
            "total": (kinetic + potential).tolist(),
        }
        events = [{"time": 0.25, "what": "step halved to 5 ms"}]
        solve |= {"times": moments.tolist(), "energies": energies, "events": events}
    shape = DrawnSurface(X, triangles, times, course, error, "scan")
    return ModelResult(name, "converged", None, "a tube", {"dofs": 9}, solve, {}, {"tip": tip}, metrics, shape)


def report(*models: ModelResult) -> Report:
    scan = ReferenceResult("scan", "converged", None, "measured surface", "us", 5e-4, shape=DrawnSurface(*tube(0.02)))
    source = {"metric": "gap", "source": "A. Author (2008), Table 1", "note": "Mean (mm)."}
    scene = {"title": "Shapes", "file": "s.scene", "text": SCENE, "published": [source]}
    return Report(scene, {}, {m.name: m for m in models}, {"scan": scan}, (), (), names=names_in(SCENE))


RICH = report(model("good", 0.0205), model("near", 0.0207), model("poor", 0.03), model("moving", 0.028, 12))


@pytest.fixture(scope="module")
def page() -> str:
    return render(RICH)


def test_a_notebook_draws_the_first_of_many_shapes_and_coarser() -> None:
    found = inline(report(*(model(f"m{i}", 0.02 + 1e-4 * i, along=60) for i in range(26))))
    frame = html.unescape(found.split('srcdoc="')[1].split('" title=')[0])
    shapes = drawn(frame)["shapes"]
    assert len(shapes) == SHAPES
    assert "3 more shapes are on the page" in found
    assert max(s["points"] for s in shapes) < len(tube(0.02, 60)[0])
    assert len(found) < 600_000


def drawn(page: str) -> dict[str, Any]:
    """What the page gives to its script."""
    found = re.search(r'<script type="application/json">(.*?)</script>', page)
    assert found
    data: dict[str, Any] = json.loads(found[1])
    return data


def saved(page: str, name: str) -> list[list[str]]:
    """The rows of a CSV link."""
    links = re.findall(rf'href="data:text/csv;charset=utf-8,([^"]*)" download="{re.escape(name)}"', page)
    assert len(links) == 1
    return list(csv.reader(unquote(links[0].replace("&#x27;", "'")).splitlines()))


def words(page: str) -> str:
    """The page without its tags, with plain spaces."""
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", "", page))


# ------------------------------------------------------------------ shapes


def test_positions_and_errors_survive_the_packing(page: str) -> None:
    data, scale = drawn(page), 65535
    assert [s["name"] for s in data["shapes"]] == ["scan", "good", "near", "poor", "moving"]
    for given in data["shapes"]:
        owner = ReportSummary(RICH).all_results[given["name"]].shape
        assert owner is not None
        low, high = np.array(given["low"]), np.array(given["high"])
        X = low + np.frombuffer(base64.b64decode(given["position"]), "<u2").reshape(-1, 3) / scale * (high - low)
        # half a step of 16 bits over a box of about 100 mm is below 1 µm, far below the 0.1 mm that one can see
        np.testing.assert_allclose(X, owner.position, atol=float((high - low).max()) / scale)
        if owner.error is not None:
            error = np.frombuffer(base64.b64decode(given["error"]), "<u2") / scale * given["most"]
            np.testing.assert_allclose(error, owner.error, atol=given["most"] / scale)
    moving = data["shapes"][-1]
    assert len(moving["times"]) == 12
    assert len(base64.b64decode(moving["frames"])) == 12 * moving["points"] * 3 * 2
    assert len(data["meshes"]) == 1  # all have the same triangles, which travel once


def test_every_figure_has_words_numbers_and_csv(page: str) -> None:
    assert page.count("<figure") == page.count("<figcaption") == page.count('class="data"') == page.count("<desc")
    ids = re.findall(r' id="([^"]*)"', page)
    assert len(ids) == len(set(ids))
    assert not re.search(r"\b(nan|NaN|None|inf)\b", words(re.sub(r"<(script|style).*?</\1>", "", page, flags=re.S)))


def test_large_surfaces_are_thinned_and_the_page_says_so() -> None:
    fine = DrawnSurface(*tube(0.02, along=600))  # 12 000 points
    small = compact_surfaces.reduce_surfaces({"fine": fine})
    own = small.shapes["fine"]
    assert 0.4 * compact_surfaces.POINTS < len(own.position) <= compact_surfaces.POINTS
    assert own.triangles.max() < len(own.position)
    # vertex clustering moves no point further than the diagonal of a cell, here a few mm at most
    np.testing.assert_allclose(
        [own.position.min(0), own.position.max(0)], [fine.position.min(0), fine.position.max(0)], atol=3e-3
    )
    assert f"{len(own.position)} of 12000 points" in small.notes[0]


def test_frames_go_before_points() -> None:
    X, triangles = tube(0.02, along=200)
    frames = np.repeat(X[None], 300, axis=0)
    moving = {f"m{i}": DrawnSurface(X, triangles, np.arange(300.0), frames) for i in range(3)}
    small = compact_surfaces.reduce_surfaces(moving)
    kept = [s.times for s in small.shapes.values() if s.times is not None]
    assert all(len(t) <= compact_surfaces.FRAMES and t[0] == 0.0 and t[-1] == 299.0 for t in kept)
    assert all("of 300 moments" in note for note in small.notes)


@pytest.mark.parametrize("count", [PANELS - 1, PANELS, 60])
def test_of_many_shapes_a_few_are_shown_at_first_and_the_caption_says_how_many(count: int) -> None:
    """300 one over the other are a heap; with the reference, more than PANELS are many."""
    models = [model(f"m{i:02}", 0.021 + 0.001 * i, along=8) for i in range(count)]
    text = render(report(*models))
    section = text[text.index('<section id="shapes"') :]
    section = section[: section.index("</figure>")]
    boxes = re.findall(r'<input type="checkbox" value="([^"]+)"( checked)?', section)
    assert [n for n, _ in boxes] == ["scan", *(m.name for m in models)]
    shown = [n for n, checked in boxes if checked]
    still = section[section.index("<noscript>") : section.index("</noscript>")]
    assert re.findall(r'text-anchor="middle">([^<]+)<', still) == shown
    assert shown[0] == "scan"
    if count < PANELS:
        assert len(shown) == 1 + count
        assert "shown at first" not in section
    else:
        assert shown[1:] == [f"m{i:02}" for i in range(len(shown) - 1)]  # those with the least error
        assert 1 < len(shown) <= 13
        assert f"{len(shown) - 1} models of {count} are shown at first" in section
    assert len(re.findall("<code>", section)) < 16  # of far ones not all names


def test_what_many_models_state_alike_is_one_line() -> None:
    said = {"gap": StatedError(reason="model: too thick", unit="m")}
    models = [replace(model(f"m{i}", 0.02, along=8), stated=said) for i in range(7)]
    own = {"gap": StatedError(1e-3, "m")}
    lines = table(report(*models, replace(model("own", 0.02, along=8), stated=own)), False).splitlines()
    assert [line for line in lines if "estimate" in line] == [
        "7 models have no error estimate for `gap`: model: too thick",
        "own estimates an error of at most 1\N{NO-BREAK SPACE}mm in `gap`",
    ]
    few = table(report(*models[:2]), False)
    assert "m0 has no error estimate for `gap`" in few
    assert "m1 has no error estimate for `gap`" in few


def test_a_page_with_much_to_show_is_below_3_MB() -> None:
    # the bound of the task: eight shapes of 2000 points, two of them with 30 frames
    models = [model(f"m{i}", 0.02 + 0.001 * i, 30 if i < 2 else 0, along=100) for i in range(8)]
    assert len(render(report(*models)).encode()) < 3_000_000


def test_colours_rise_in_lightness_and_the_script_has_the_same() -> None:
    # viridis is perceptually uniform: its lightness rises evenly, here judged by luma of Rec. 709
    def luma(t: float) -> float:
        colour = viridis(t)
        r, g, b = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
        return 0.2126 * r + 0.7152 * g + 0.0722 * b

    levels = [luma(t / 20) for t in range(21)]
    assert all(b > a for a, b in pairwise(levels))
    script = load_asset("raster.js")
    numbers = re.search(r"VIRIDIS = \[(.*?)\];", script, re.S)
    assert numbers
    found = [float(v) for v in re.findall(r"-?\d+\.\d+", numbers[1])]
    assert found == [v for row in VIRIDIS for v in row]


# ------------------------------------------------------------------ uncertainty


def test_differences_below_the_uncertainty_are_not_ranked() -> None:
    findings = ReportSummary(RICH)
    gap = next(m for m in findings.metrics if m.name == "gap")
    # good is off by 0.5 mm and near by 0.7 mm at the tip, less on average: they differ by less than 0.5 mm
    assert findings.best(gap) == ("good", "near")
    assert findings.tied(gap)
    assert "are `good` and `near`: no difference above ±" in findings.conclusion


def test_values_within_the_uncertainty_are_marked(page: str) -> None:
    assert 'class="within"' in page
    assert page.count('class="best">tied<') == 2
    assert "within the uncertainty of the reference (± 500 µm for gap)" in words(page).replace("\u00a0", " ")
    shown = table(RICH, terminal=False)
    assert "† within the uncertainty of the reference (± 500 um for gap)" in shown or "† within" in shown
    assert shown.count(" †") == 2


@pytest.mark.parametrize(
    ("limit", "uncertainty", "said"),
    [
        (0.02, 1e-4, ""),
        (0.02, 5e-3, "; uncertainty of the reference \u00b1 5 mm"),
        (0.02, 0.015, "; uncertainty of the reference \u00b1 15 mm, which may change this result"),
    ],
)
def test_a_verdict_says_what_its_reference_leaves_open(limit: float, uncertainty: float, said: str) -> None:
    """Where that is over 2 % of the limit; a value of 10 mm and one of 20 mm are apart by less than 15 mm."""
    own = model("m1", 0.02)
    metric = MetricResult(0.01, "m", uncertainty=uncertainty)
    judged = ExpectationResult("m1.gap < 2 cm", 9, True, 0.01, "m", about=(("m1", "gap"),), limits=(limit,))
    shown = table(replace(report(replace(own, metrics={"gap": metric})), expectations=(judged,)), terminal=False)
    assert shown.splitlines()[-1] == f"  met         line 9: m1.gap < 2 cm{said}"


def test_a_verdict_between_two_models_says_what_their_reference_leaves_open() -> None:
    """10 mm and 12 mm against what is known to 3 mm: which of them is closer cannot be told."""
    known = {n: MetricResult(v, "m", uncertainty=0.003) for n, v in (("m1", 0.010), ("m2", 0.012))}
    models = (replace(model(n, 0.02), metrics={"gap": m}) for n, m in known.items())
    about = (("m1", "gap"), ("m2", "gap"))
    judged = ExpectationResult("m1.gap < m2.gap", 9, True, 0.010, "m", about=about, limits=(0.012,))
    shown = table(replace(report(*models), expectations=(judged,)), terminal=False)
    assert shown.splitlines()[-1].endswith("m2.gap; uncertainty of the reference ± 3 mm, which may change this result")


@pytest.mark.parametrize(
    ("known", "said"),
    [
        ({"estimated_error": 5e-4}, ", ± 500 µm"),
        ({"estimated_error": 5e-10}, ""),  # below what anybody needs to know
        ({"shape": None, "facts": {"uncertainty": 0.01, "unit": "N"}}, ", ± 10 mN at most"),
        ({"shape": None, "estimated_error": 5e-4}, ""),  # of forces alone: an error of displacements says nothing
    ],
)
def test_the_row_of_a_reference_says_its_own_error(known: dict[str, Any], said: str) -> None:
    own = replace(RICH.references["scan"], **{"estimated_error": None} | known)
    lines = table(replace(RICH, references={"scan": own}), terminal=False, width=200).splitlines()
    row = next(line for line in lines if line.startswith("(scan)"))
    assert row.endswith(f"reference: measured surface{said}")


# ------------------------------------------------------------------ published, details, time


def test_published_values_stand_beside_ours(page: str) -> None:
    rows = saved(page, "published.csv")
    named = {row[0]: row for row in rows[1:] if row[1] == "gap"}
    ours = RICH.models["poor"].metrics["gap"].value
    assert ours is not None
    # the published value is 4.5 mm for all
    np.testing.assert_allclose([float(v) for v in named["poor"][3:7]], [ours, 0.0045, ours - 0.0045, ours / 0.0045 - 1])
    assert "A. Author (2008), Table 1" in page


@pytest.mark.parametrize(
    ("key", "unit"),
    [
        ("p95_m", "m"),
        ("limit_s", "s"),
        ("rate_Hz", "Hz"),
        ("relative_mean", "1"),
        ("relative_points", ""),
        ("frames", ""),
    ],
)
def test_units_of_details(key: str, unit: str) -> None:
    assert unit_of(key) == unit


def test_every_detail_is_in_the_csv(page: str) -> None:
    rows = {(r[0], r[1], r[2]): r[3] for r in saved(page, "details.csv")[1:]}
    for name, m in RICH.models.items():
        for metric, result in m.metrics.items():
            for key, value in result.details.items():
                assert rows[name, metric, key] == ("" if value is None else str(value))


def test_real_time_is_said_in_words(page: str) -> None:
    said = words(page)
    assert "0 of 4 models in real time" in said
    assert "✗ not real time" in said
    rows = saved(page, "frame-frames.csv")
    # samples are shares of a limit of 40 ms; the last of 60 is 1.2 of it
    assert float(rows[60][2]) == pytest.approx(0.048)


def test_histories_energies_and_events(page: str) -> None:
    said = words(page)
    assert "displacement along z of the point" in said
    assert "step halved to 5 ms" in said
    # sin^2 + cos^2 = 1: the total drifts by rounding only
    assert re.search(r"the total changes by up to \d\.?\d*·10⁻¹[⁵⁶]|the total changes by up to 0", said)
    rows = saved(page, "tip-course.csv")
    assert len(rows) == 1 + 500


def test_histograms_count_every_point(page: str) -> None:
    for name in RICH.models:
        shares = [float(row[2]) for row in saved(page, f"{name}-gap-histogram.csv")[1:]]
        assert sum(shares) == pytest.approx(1.0, abs=1e-8)  # nine digits are kept


# ------------------------------------------------------------------ files for ParaView


def solid(kind: str) -> SimpleNamespace:
    """One cell of a kind, moved along x, with three moments."""
    corners = ELEMENTS[kind].places()
    u = np.zeros_like(corners)
    u[:, 0] = 0.5
    frames = np.array([0 * u, 0.5 * u, u])
    cells = np.arange(len(corners))[None]
    return SimpleNamespace(
        points=corners, cells=cells, kind=kind, displacement=u, times=np.array([0.0, 0.1, 0.2]), frames=frames
    )


@pytest.mark.parametrize("kind", ELEMENTS)
def test_meshes_are_undeformed_with_displacements(kind: str, tmp_path: Path) -> None:
    body = solid(kind)
    still = SimpleNamespace(
        points=body.points, cells=body.cells, kind=kind, displacement=body.displacement, times=None, frames=None
    )
    disk.write_vtu(report(replace(model("a", 0.02), mesh=still)), tmp_path)
    mesh = meshio.read(tmp_path / "vtu" / "a.vtu")
    np.testing.assert_array_equal(mesh.points, body.points)
    np.testing.assert_array_equal(mesh.point_data["displacement"], body.displacement)
    assert mesh.cells[0].type == ELEMENTS[kind].meshio
    np.testing.assert_array_equal(mesh.cells[0].data, body.cells)


def test_a_history_is_a_collection(tmp_path: Path) -> None:
    written = vtk_writer.write_vtu(report(replace(model("a", 0.02, 4), mesh=solid("tet4"))), tmp_path)
    assert all(path.is_file() for path in written)
    sets = ElementTree.parse(tmp_path / "vtu" / "a.pvd").getroot().findall("Collection/DataSet")
    assert [float(s.get("timestep", "")) for s in sets] == [0.0, 0.1, 0.2]
    middle = meshio.read(tmp_path / "vtu" / str(sets[1].get("file")))
    assert middle.point_data["displacement"][0, 0] == 0.25
    surface = meshio.read(tmp_path / "vtu" / "a-surface-end.vtu")
    assert surface.cells[0].type == "triangle"
    assert "error" in surface.point_data


def test_names_of_files_are_tame(tmp_path: Path) -> None:
    odd = report(model("../a b", 0.02), model("..:a?b", 0.02))
    names = [path.name for path in vtk_writer.write_vtu(odd, tmp_path)]
    assert sorted(path.parent for path in tmp_path.rglob("*.vtu")) == [tmp_path / "vtu"] * len(names)
    assert len(set(names)) == 3  # two models and the scan


def test_cells_that_vtk_does_not_have(tmp_path: Path) -> None:
    body = SimpleNamespace(
        points=np.zeros((5, 3)), cells=np.arange(5)[None], kind="pyramid5", displacement=np.zeros((5, 3))
    )
    with pytest.raises(ValueError, match="pyramid5"):
        vtk_writer.write_vtu(report(replace(model("a", 0.02), mesh=body)), tmp_path)
