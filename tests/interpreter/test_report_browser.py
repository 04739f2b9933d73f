"""The HTML report in a browser: its script runs, its boxes hide curves, and its console stays silent.

Chromium is needed; where it is not on the PATH these tests are skipped, with that reason.
"""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import TIMED, browse, needs_chromium, noted

import softmark
from softmark.interpreter.report.run.report_page import render
from softmark.interpreter.results.run_report import DrawnSurface, Report


@pytest.fixture(scope="module")
def silicone() -> Report:
    return softmark.load("silicone-beam").run(models=["rod", "linear_tet"])


def odd(usual: Report, case: str) -> Report:
    """A report without anything, or one whose names and texts try to be markup."""
    if case == "nothing":
        return replace(usual, models={}, references={}, expectations=(), warnings=())
    script = "<script>console.error(1)</script>"
    attack = f"</script>{script}<img src=http://evil.example onerror='console.error(2)'>"
    models = {}
    for n, m in usual.models.items():
        models[attack + n] = replace(m, name=attack + n, outline=attack, message=attack)
    return replace(usual, models=models, scene={**usual.scene, "title": attack, "text": f"# {attack}"})


# walks with the keys to the second point of the last curve, hides the first curve, and reports
PROBE = """<script>
const box = document.querySelector(".drawing");
box.focus();
for (const key of ["Home", "ArrowRight"])
  box.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
const tip = box.querySelector(".tip"), first = document.querySelector("input[value=k0]");
const before = getComputedStyle(document.querySelector("g.k0")).display;
first.click();
const after = getComputedStyle(document.querySelector("g.k0")).display;
const wide = document.documentElement.scrollWidth > document.documentElement.clientWidth;
const bar = document.querySelector("nav"), slides = bar.scrollWidth > bar.clientWidth;
const said = [tip.hidden, [...tip.children].map((c) => c.textContent).join("|"), before, after, wide, slides];
document.documentElement.dataset.said = JSON.stringify(said);
</script></body>"""


@pytest.mark.slow
@pytest.mark.long
@needs_chromium
@pytest.mark.parametrize("width", [1280, 500])
def test_in_chromium(silicone: Report, tmp_path: Path, width: int) -> None:
    page = tmp_path / "report.html"
    page.write_text(render(silicone).replace("</body>", PROBE), encoding="utf-8")
    dom = browse(page, tmp_path / "profile", f"--window-size={width},900", "--dump-dom").stdout
    hidden, tip, before, after, wide, slides = noted(dom)
    assert hidden is False
    # point 1 of 41 on 178 mm is at 4.45 mm
    name, s, *place = tip.replace("\u00a0", " ").split("|")
    last = list(silicone.models)[-1]
    x, _, z = silicone.models[last].probes["axis"].position[1] * 1e3
    assert (name, s) == (last, "s 4.450 mm")
    assert [part[:1] for part in place] == ["x", "z"]
    shown = [float(part.split()[1].replace("−", "-")) for part in place]
    np.testing.assert_allclose(shown, [x, z], atol=5e-4)  # three decimals are shown
    assert (before, after) == ("inline", "none")
    assert wide is False  # the page itself never scrolls sideways
    assert slides is False  # nor does the bar of its sections: it goes on below itself


@pytest.mark.long
@pytest.mark.slow
@needs_chromium
@pytest.mark.parametrize("case", ["hostile", "nothing"])
def test_odd_reports_in_chromium(silicone: Report, case: str, tmp_path: Path) -> None:
    page, picture = tmp_path / "report.html", tmp_path / "picture.png"
    page.write_text(render(odd(silicone, case)), encoding="utf-8")
    browse(page, tmp_path / "profile", "--window-size=1280,1600", f"--screenshot={picture}")
    head = picture.read_bytes()[:24]
    assert head[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">II", head[16:24]) == (1280, 1600)


# ------------------------------------------------------------------ shapes

# turns by the keys, zooms, overlays, moves time, and looks at the pixels of the canvas that is left
TURNED = """<script>
const figure = document.querySelector("figure.shapes"), stage = figure.querySelector(".stage");
const pixels = (canvas) => {
  const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d", { willReadFrequently: true });
  copy.drawImage(canvas, 0, 0);
  const data = copy.getImageData(0, 0, canvas.width, canvas.height).data;
  let painted = 0, sum = 0;
  for (let i = 0; i < data.length; i += 4) if (data[i + 3]) { painted++; sum += data[i] * (i % 9973); }
  return [painted, sum];
};
const said = { drawn: figure.dataset.drawn, shapes: figure.dataset.shapes, seen: [], requests: 0 };
const look = (canvas) => said.seen.push(pixels(canvas));
const wait = () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
const press = (key) => stage.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }));
(async () => {
  await wait();
  const first = stage.querySelector(".panel canvas"), all = stage.querySelector(".all");
  look(first);
  for (const key of ["ArrowLeft", "ArrowUp", "+"]) press(key);
  await wait();
  look(first);
  said.spoken = figure.querySelector(".spoken").textContent;
  figure.querySelector("input[value=overlaid]").click();
  await wait();
  look(all);
  const slider = figure.querySelector("input[type=range]");
  slider.value = 0;
  slider.dispatchEvent(new Event("input"));
  await wait();
  look(all);
  said.unknown = !figure.querySelector(".unknown").hidden;
  figure.querySelectorAll(".who input").forEach((box, i) => i && box.click());
  await wait();
  look(all);
  said.left = figure.dataset.shapes;
  said.names = [...figure.querySelectorAll("canvas")].map((c) =>
    c.getAttribute("role") + " " + c.getAttribute("aria-label"));
  said.unnamed = [...figure.querySelectorAll("button, select, input")].filter((e) =>
    !(e.textContent.trim() || e.getAttribute("aria-label") || e.closest("label"))).length;
  said.requests = performance.getEntriesByType("resource").length;
  document.documentElement.dataset.said = JSON.stringify(said);
})();
</script></body>"""


def tube(u: np.ndarray[Any, Any], n: int = 50) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """A tube of 10 mm around a line (41, 3), its points (41 n, 3) and triangles."""
    a = np.linspace(0, 2 * np.pi, n, endpoint=False)
    ring = 0.01 * np.stack([0 * a, np.sin(a), np.cos(a)], axis=1)
    X = (u[:, None] + ring).reshape(-1, 3)
    i, j = (index.ravel() for index in np.meshgrid(np.arange(len(u) - 1), np.arange(n), indexing="ij"))
    k = (j + 1) % n
    A, B, C, D = i * n + j, i * n + k, (i + 1) * n + k, (i + 1) * n + j
    return X, np.concatenate([np.stack([A, B, D], axis=1), np.stack([B, C, D], axis=1)])


def shaped(usual: Report) -> Report:
    """Eight shapes of 2050 points, two of them with 30 frames."""
    axis = next(iter(usual.models.values())).probes["axis"]
    model = next(iter(usual.models.values()))
    models = {}
    for i in range(7):
        u = axis.displacement * (0.7 + 0.1 * i)
        X, triangles = tube(axis.points + u)
        times = np.linspace(0.0, 1.0, 30) if i < 2 else None
        frames = None if times is None else np.array([tube(axis.points + t * u)[0] for t in times])
        error = np.linalg.norm(X - tube(axis.points)[0], axis=1)
        shape = DrawnSurface(X, triangles, times, frames, error, "theory")
        models[f"m{i}"] = replace(model, name=f"m{i}", shape=shape)
    references = {n: replace(r, shape=None) for n, r in usual.references.items()}
    references["theory"] = replace(references["theory"], shape=DrawnSurface(*tube(axis.position)))
    return replace(usual, models=models, references=references)


@pytest.mark.long
@pytest.mark.slow
@needs_chromium
@pytest.mark.parametrize("width", [1280, 500])
def test_shapes_in_chromium(silicone: Report, tmp_path: Path, width: int) -> None:
    page, text = tmp_path / "report.html", render(shaped(silicone))
    assert len(text.encode()) < 3_000_000
    assert text.count("<body>") == 1
    page.write_text(text.replace("<body>", TIMED).replace("</body>", TURNED), encoding="utf-8")
    patient = "--virtual-time-budget=20000"  # drawing counts as time where there is no graphics card
    dom = browse(page, tmp_path / "profile", f"--window-size={width},900", patient, "--dump-dom").stdout
    said = noted(dom)
    assert (said["drawn"], said["shapes"], said["left"]) == ("true", "8", "1")
    painted = [pixels for pixels, _ in said["seen"]]
    # a beam fills some per cent of a panel of at least 200 by 100 points, each of four pixels
    assert all(count > 1000 for count in painted)
    assert len({tuple(seen) for seen in said["seen"]}) == 5  # every step changed the picture
    assert painted[4] < painted[3]  # one shape covers less than eight
    assert said["unknown"] is True  # before the end the error is not known, and the page says so
    assert "turned to" in said["spoken"]
    assert all(name.startswith("img ") and len(name) > 10 for name in said["names"])
    assert said["unnamed"] == 0
    assert said["requests"] == 0
