"""The library of materials: no constant without a source, a range, a test and a doubt; and a curve in its page."""

from __future__ import annotations

import math
import re
import subprocess
import sys

import pytest
from scipy.optimize import brentq

from softmark.interpreter.cli import library
from softmark.interpreter.cli.commands.explain import page
from softmark.interpreter.cli.main import main

KEPT = library.materials()


@pytest.mark.parametrize("own", KEPT.values(), ids=lambda own: own.name)
def test_every_constant_has_a_source_a_test_a_range_and_a_doubt(own: library.Kept) -> None:
    assert own.what.endswith(".")
    assert set(own.said) == set(library.KEYS)
    assert re.search(r"https?://|\((?:19|20)\d\d\)|scan of the beam", own.said["Source"])
    assert "temperature" in own.said["Test"]
    assert re.search(r"at rest|/s", own.said["Test"]), "how fast"
    low, high = own.stretches or (0.0, 0.0)
    assert 0.0 < low < high
    constants = re.findall(r"(\w+) = [0-9]", own.text.partition("(")[2])
    assert constants
    for name in constants:
        assert re.search(rf"\b{name} [^;]*(?:\d|not given)", own.said["Uncertain"]), name


def test_the_curve_of_its_page_is_that_of_its_law(capsys: pytest.CaptureFixture[str]) -> None:
    """Of logarithmic neo-Hooke in closed form, to the six digits that are shown."""
    own = KEPT["ecoflex_0030_tension"]
    mu, lam = 48.3e3 / 2.98, 48.3e3 * 0.49 / (1.49 * 0.02)
    for l, stress in library.curve(own):
        t = brentq(lambda t, l=l: mu * (t * t - 1) + lam * math.log(l * t * t), 0.3, 2.0, xtol=1e-15)
        assert stress == pytest.approx((mu * (l * l - 1) + lam * math.log(l * t * t)) / l, rel=1e-9)
    text = page("ecoflex_0030_tension") or ""
    assert "28.323 kPa" in text
    assert "Uncertain: young 43 to 52 kPa" in text
    assert main(["list", "materials", "--library"]) == 0
    assert "ecoflex_0030_tension" in capsys.readouterr().out
    assert main(["list", "codes", "--library"]) == 2


def test_the_list_of_the_library_needs_no_arrays() -> None:
    code = ("import sys; from softmark.interpreter.cli.main import main; main(['list', 'materials', '--library']); "
            "assert not {'numpy', 'scipy'} & set(sys.modules)")  # fmt: skip
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
