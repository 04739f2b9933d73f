"""The HTML report in a browser: its script runs, its boxes hide curves, and its console stays silent.

Chromium is needed; where it is not on the PATH these tests are skipped, with that reason.
"""

from __future__ import annotations

import html
import json
import re
import shutil
import struct
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import softmark
from softmark.interpreter.report.html import render
from softmark.interpreter.results import Report


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


CHROMIUM = shutil.which("chromium")
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="chromium is not on the PATH")
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--hide-scrollbars",
    "--enable-logging=stderr", "--v=0", "--virtual-time-budget=2000",
)  # fmt: skip
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
const said = [tip.hidden, [...tip.children].map((c) => c.textContent).join("|"), before, after, wide];
document.documentElement.dataset.said = JSON.stringify(said);
</script></body>"""


def browse(page: Path, profile: Path, *flags: str) -> subprocess.CompletedProcess[str]:
    """Chromium on a page, with nothing on its console."""
    command_line = [str(CHROMIUM), *FLAGS, f"--user-data-dir={profile}", *flags, page.as_uri()]
    done = subprocess.run(command_line, capture_output=True, text=True, timeout=120, check=True)
    assert "CONSOLE" not in done.stderr, done.stderr
    return done


@needs_chromium
@pytest.mark.parametrize("width", [1280, 500])
def test_in_chromium(silicone: Report, tmp_path: Path, width: int) -> None:
    page = tmp_path / "report.html"
    page.write_text(render(silicone).replace("</body>", PROBE), encoding="utf-8")
    dom = browse(page, tmp_path / "profile", f"--window-size={width},900", "--dump-dom").stdout
    hidden, tip, before, after, wide = noted(dom)
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


def noted(dom: str) -> Any:
    """What the probe of the page noted."""
    found = re.search(r'data-said="([^"]*)"', dom)
    assert found is not None, "the script of the page did not run"
    return json.loads(html.unescape(found[1]))


@needs_chromium
@pytest.mark.parametrize("case", ["hostile", "nothing"])
def test_odd_reports_in_chromium(silicone: Report, case: str, tmp_path: Path) -> None:
    page, picture = tmp_path / "report.html", tmp_path / "picture.png"
    page.write_text(render(odd(silicone, case)), encoding="utf-8")
    browse(page, tmp_path / "profile", "--window-size=1280,1600", f"--screenshot={picture}")
    head = picture.read_bytes()[:24]
    assert head[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">II", head[16:24]) == (1280, 1600)
