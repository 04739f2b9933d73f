"""Stress as the colour of shapes: of pages of scenes that ask for it; every other page stays as it was."""

from __future__ import annotations

import base64
import csv
import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import pytest
from browser import TIMED, browse, needs_chromium, noted
from tubes import tube

import softmark
from softmark.interpreter.pipeline.report_assembly import MOST
from softmark.interpreter.report.page.html_document import load_asset
from softmark.interpreter.report.run.report_page import render
from softmark.interpreter.report.view3d.compact_surfaces import thin_surface
from softmark.interpreter.report.view3d.surface_fields import scale_over
from softmark.interpreter.results.run_report import (
    DrawnSurface,
    ModelResult,
    ReferenceResult,
    Report,
    RequestedSurfaceValues,
)

NONE = "only finite elements and beams have a stress at every point"


def number(values: Any, words: str = "stress xx, cauchy", **more: Any) -> RequestedSurfaceValues:
    return RequestedSurfaceValues(
        words, "Pa", ("most",), None if values is None else np.asarray(values), size=100.0, **more
    )


def coloured(name: str, *numbers: RequestedSurfaceValues, frames: int = 0) -> ModelResult:
    """A model as bent as the scan is, with a history of so many frames."""
    X, triangles = tube(0.02)
    times = np.linspace(0.0, 0.5, frames) if frames else None
    course = None if times is None else np.array([tube(0.02 * t / 0.5)[0] for t in times])
    shape = DrawnSurface(X, triangles, times, course, np.zeros(len(X)), "scan", numbers)
    return ModelResult(name, "converged", None, "a tube", shape=shape)


def report(*models: ModelResult) -> Report:
    scan = ReferenceResult("scan", "converged", None, "measured surface", "us", 5e-4, shape=DrawnSurface(*tube(0.02)))
    return Report({"title": "Shapes", "text": ""}, {}, {m.name: m for m in models}, {"scan": scan}, (), ())


N = len(tube(0.02)[0])
BENT = np.linspace(-300.0, 500.0, N)  # Pa
RICH = report(
    coloured(
        "a", number(BENT, limitless="the edge of the part held by `wall`", apart=0.25), number(0.0 * BENT, "stress zx")
    ),
    coloured("b", number(0.5 * BENT), number(0.0 * BENT, "stress zx"), frames=6),
    coloured("rod", number(None, reason=NONE), number(None, "stress zx", reason=NONE)),
)


@pytest.fixture(scope="module")
def page() -> str:
    return render(RICH)


def data_of(page: str) -> Any:
    found = re.search(r'<script type="application/json">(.*?)</script>', page, re.S)
    assert found is not None
    return json.loads(found[1])


# ------------------------------------------------------------------ what is there, and when


def test_a_page_without_stress_has_nothing_of_it() -> None:
    """Not a line of script nor of style, and what is in both is the same to the byte."""
    plain, rich = (render(report(replace(RICH.models["a"], shape=shape))) for shape in shapes_with_and_without())
    assert "carr" not in plain.replace("carried out", "")
    assert "carried" in rich
    assert "// with" not in plain
    for name in ("raster.js", "shapes_controls.js", "shapes.js"):
        assert load_asset(name) in plain
        assert "carried" not in load_asset(name)
    assert "carried" in load_asset("shapes.js", ("carried.js",))


def shapes_with_and_without() -> Any:
    shape = RICH.models["a"].shape
    assert shape is not None
    return replace(shape, carried=()), shape


SCENE = """softmark 1
material gel   = linear_elastic(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
body     bar   = solid(box(size = (100, 20, 20) mm), gel)
support  wall  = fixed(bar, where = x <= 0 mm)
load     push  = traction(bar, where = x >= 100 mm, vector = (0, 0, -10) Pa)
model    own   = fem(hex20, strain = small, size = 10 mm)
model    rod   = beam6dof(segments = 4)
probe    top   = point(bar, at = (50, 10, 20) mm)
"""


@pytest.mark.slow
def test_nothing_is_imported_that_no_metric_asks_for() -> None:
    text = SCENE + "metric sag = displacement(top, along = -z)\n"
    program = f"""
import sys, softmark
from softmark.interpreter.report.run.report_page import render
report = softmark.loads({text!r}).run()
render(report)
assert all(m.shape is not None and m.shape.carried == () for m in report.models.values())
print([m for m in sys.modules if "surface_fields" in m or "solvers.stress_recovery" in m])
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout.strip() == "[]"


@pytest.mark.slow
@pytest.mark.long
def test_surfaces_carry_what_metrics_ask_for() -> None:
    """On top of a bar that bends sigma_xx = F (L - x) c / I, 300 Pa at the clamp (I = a^4 / 12, F = 4 mN, L = 0.1 m).

    Seven numbers are asked: the page has room for six, and says so of the last; two metrics share the first.
    """
    components = ("yy", "zz", "xy", "yz", "zx", "von_mises")
    more = "".join(f"metric m{i} = stress(top, component = {c})\n" for i, c in enumerate(components))
    text = SCENE + "metric most = stress(top, component = xx)\nmetric again = stress(top, component = xx)\n" + more
    found = softmark.loads(text).run()
    own, rod = (found.models[name].shape for name in ("own", "rod"))
    assert own is not None
    assert rod is not None
    first, *_, last = own.carried
    assert (first.words, first.unit, first.metrics) == ("stress xx, cauchy", "Pa", ("most", "again"))
    place = own.position
    top = (np.abs(place[:, 2] - 0.02) < 2e-4) & (place[:, 0] > 0.03) & (place[:, 0] < 0.07)
    assert np.count_nonzero(top) > 10
    assert first.values is not None
    np.testing.assert_allclose(first.values[top], 3000.0 * (0.1 - place[top, 0]), rtol=0.02)
    assert first.limitless == "the edge of the part held by `wall`"
    assert len(own.carried) == MOST + 1
    assert last.values is None
    assert "at most 6 surface fields" in str(last.reason)
    sections = rod.carried[0]
    assert sections.values is not None  # at points of its surface, which its sections end at
    top = (np.abs(rod.position[:, 2] - 0.02) < 2e-4) & (rod.position[:, 0] > 0.03) & (rod.position[:, 0] < 0.07)
    np.testing.assert_allclose(sections.values[top], 3000.0 * (0.1 - rod.position[top, 0]), rtol=0.02)
    said = render(found)
    assert "stress von_mises, cauchy: the report page shows at most 6 surface fields" in re.sub(r"<[^>]*>", "", said)


# ------------------------------------------------------------------ scales


def test_one_scale_holds_95_per_cent_of_each_model() -> None:
    scale = scale_over([number(BENT), number(0.5 * BENT), number(None)])
    assert scale is not None
    assert scale.whole == (-300.0, 500.0)
    assert scale.usual == pytest.approx((-280.0, 480.0))  # 2.5 % of 800 Pa at each end


def test_a_model_that_is_far_off_does_not_set_the_colours() -> None:
    scale = scale_over([number(BENT), number(0.9 * BENT), number(1e3 * BENT)])
    assert scale is not None
    assert scale.whole == (-3e5, 5e5)
    assert scale.usual == pytest.approx((-280.0, 480.0))


def test_rounding_has_one_colour() -> None:
    """A component that is zero, and one that is the same everywhere, but for the last digits."""
    for middle in (0.0, 70.0):
        scale = scale_over([number(middle + 1e-9 * np.sin(np.arange(50)))])
        assert scale is not None
        low, high = scale.usual
        assert low + high == pytest.approx(2 * middle, abs=1e-8)
        assert high - low > 1e-4


def test_nobody_has_it() -> None:
    assert scale_over([number(None), number(np.zeros(0))]) is None
    assert "carried.css" not in render(report(coloured("a", number(None, reason=NONE))))


def test_thinned_shapes_keep_the_mean() -> None:
    shape = RICH.models["a"].shape
    assert shape is not None
    small = thin_surface(shape, 100)
    values = small.carried[0].values
    assert values is not None
    assert len(values) == len(small.position) <= 100
    assert BENT.min() < values.min() < values.max() < BENT.max()


# ------------------------------------------------------------------ the page


def test_what_the_script_reads(page: str) -> None:
    data = data_of(page)
    first, second = data["carried"]
    assert (first["words"], first["unit"], first["symbol"], first["whole"]) == (
        "stress xx, cauchy",
        "Pa",
        "Pa",
        [-300, 500],
    )
    assert second["words"] == "stress zx"
    packed = {s["name"]: s.get("carried") for s in data["shapes"]}
    assert packed["rod"] == [None, None]
    assert packed["scan"] is None
    own = packed["a"][0]
    shares = np.frombuffer(base64.b64decode(own["values"]), "<u2") / 65535
    np.testing.assert_allclose(own["low"] + shares * (own["high"] - own["low"]), BENT, atol=800 / 65535)
    assert own["said"].replace("\u00a0", " ") == "−300 Pa to 500 Pa"


def test_what_is_said(page: str) -> None:
    said = re.sub(r"<[^>]*>", "", page).replace("\u00a0", " ")
    assert "Colour can also be stress xx, cauchy (metric most) and stress zx (metric most), recovered at" in said
    assert "at the last moment, with the same scale for all models: at first it covers 95 % of the points" in said
    assert f"No colours for rod: {NONE}." in said
    assert "At the edge of the part held by wall stress is singular (W388)" in said
    assert "Stresses of adjacent cells of a differ at 25 % of the points (W387)" in said
    assert "Errors and fields are available only at the end" in said


def test_without_a_script_there_is_a_picture_and_its_colours(page: str) -> None:
    stills = re.findall(r"<noscript>(.*?)</noscript>", page, re.S)
    assert len(stills) == 2  # by error, and by stress
    assert "colour-bar" in stills[1]
    assert "−300\u00a0Pa to 500\u00a0Pa" in stills[1]
    panels = stills[1].split("<g ")[1:]
    fills = [set(re.findall(r'fill="(#\w+)"', panel)) for panel in panels]
    assert len(fills) == 3
    assert len(fills[0]) > 20
    assert all(len({c[1:3], c[3:5], c[5:7]}) == 1 for c in fills[2])  # the rod has none: it is grey


def test_the_file_has_the_numbers(page: str) -> None:
    found = re.search(r'href="data:text/csv;charset=utf-8,([^"]*)" download="shapes-errors.csv"', page)
    assert found is not None
    header, *rows = csv.reader(unquote(found[1]).splitlines())
    named = {row[0]: dict(zip(header, row, strict=True)) for row in rows}
    assert float(named["b"]["largest stress xx, cauchy [Pa]"]) == 250.0
    assert float(named["a"]["mean stress xx, cauchy [Pa]"]) == pytest.approx(100.0)
    assert named["rod"]["least stress zx [Pa]"] == named["scan"]["least stress zx [Pa]"] == ""


# ------------------------------------------------------------------ in a browser

# chooses stress, then its second number, then the largest range, looks at a point, and goes back in time
CHOSEN = """<script>
const figure = document.querySelector("figure.shapes"), said = { seen: [], bars: [], small: [] };
const wait = () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
const shown = (e) => e.getClientRects().length > 0;
const look = () => {
  const canvas = figure.querySelectorAll(".panel canvas")[1];
  const pen = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d", { willReadFrequently: true });
  pen.drawImage(canvas, 0, 0);
  const data = new Uint32Array(pen.getImageData(0, 0, canvas.width, canvas.height).data.buffer);
  said.seen.push(new Set(data).size);
  said.bars.push([...figure.querySelectorAll(".colour-bar")].filter(shown).map((b) =>
    [...b.querySelectorAll(".scale p")].filter(shown).map((p) => p.textContent).join()).join());
  said.small.push([...figure.querySelectorAll(".panel small")].map((e) => e.textContent));
};
(async () => {
  await wait();
  look();
  figure.querySelector("input[value=carried]").click();
  await wait();
  look();
  const canvas = figure.querySelectorAll(".panel canvas")[1], box = canvas.getBoundingClientRect();
  const { width, height, owner } = canvas.frame, inside = (o, i) => o && owner[i + 8] && owner[i + 8 * width];
  const at = owner.findIndex(inside) + 4 + 4 * width;
  const x = box.left + (at % width) / width * box.width, y = box.top + Math.floor(at / width) / height * box.height;
  canvas.dispatchEvent(new PointerEvent("pointermove", { clientX: x, clientY: y, bubbles: true }));
  said.tip = figure.querySelector(".tip").textContent;
  const select = figure.querySelector(".number select");
  select.value = "n1";
  select.dispatchEvent(new Event("change", { bubbles: true }));
  figure.querySelector("input[value=whole]").click();
  await wait();
  look();
  said.before = figure.querySelector(".unknown").hidden;
  const slider = figure.querySelector("input[type=range]");
  slider.value = 0;
  slider.dispatchEvent(new Event("input"));
  await wait();
  said.early = figure.querySelector(".unknown").hidden;
  let saved = null;
  URL.createObjectURL = (blob) => { saved = blob; return "#"; };
  figure.querySelector("button.points").click();
  const lines = (await saved.text()).split("\\r\\n");
  said.csv = [lines[0], lines.find((l) => l.startsWith('"a",'))];
  said.wide = document.documentElement.scrollWidth > document.documentElement.clientWidth;
  document.documentElement.dataset.said = JSON.stringify(said);
})();
</script></body>"""


@pytest.mark.slow
@needs_chromium
@pytest.mark.parametrize("width", [1280, 500])
def test_stress_in_chromium(page: str, tmp_path: Path, width: int) -> None:
    file = tmp_path / "report.html"
    file.write_text(page.replace("<body>", TIMED).replace("</body>", CHOSEN), encoding="utf-8")
    patient = "--virtual-time-budget=20000"  # drawing counts as time where there is no graphics card
    dom = browse(file, tmp_path / "profile", f"--window-size={width},900", patient, "--dump-dom").stdout
    said = noted(dom)
    by_error, by_stress, by_zero = said["seen"]
    assert by_stress > by_error  # of shape `a` the error is zero, one colour, and stress is many
    assert by_zero < by_stress / 3
    assert said["bars"][0].startswith("distance from scan")
    assert said["bars"][1] == "stress xx, cauchy / Pa (the end colours include all larger or smaller values)"
    assert said["bars"][2] == "stress zx / Pa"
    assert said["small"][0][1].startswith("mean 0")
    assert said["small"][1][1:] == [
        "−300\u00a0Pa to 500\u00a0Pa",
        "−150\u00a0Pa to 250\u00a0Pa",
        "no stress xx, cauchy",
    ]
    assert "stress xx, cauchy: " in said["tip"]
    assert (said["before"], said["early"]) == (True, False)
    header, row = said["csv"]
    assert header.endswith("error [m],stress xx cauchy [Pa],stress zx [Pa]")
    assert float(row.split(",")[-2]) == pytest.approx(-300.0)
    assert said["wide"] is False
