"""The library of materials: no constant without a source, a range, a test and a doubt; and a curve in its page."""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

import softmark
from softmark.interpreter.cli.main import main
from softmark.interpreter.help import material_library
from softmark.interpreter.help.word_pages import page
from softmark.interpreter.models.material_point.material_point_builder import build_material_point
from softmark.interpreter.problem.body_case import case_for
from softmark.solvers.statics.material_point import ImposedDeformation
from tests.benchmarks import fits

Floats = NDArray[np.float64]


@pytest.fixture
def data(_measured_data: None) -> None:
    """Where the measured curves are at hand."""
    if "SOFTMARK_DATA" not in os.environ or not fits.folder().is_dir():
        pytest.skip("needs the measured curves")


KEPT = material_library.materials()


@pytest.mark.parametrize("own", KEPT.values(), ids=lambda own: own.name)
def test_every_constant_has_a_source_a_test_a_range_and_a_doubt(own: material_library.LibraryMaterial) -> None:
    assert own.what.endswith(".")
    assert set(own.said) == set(material_library.KEYS)
    assert re.search(r"https?://|\((?:19|20)\d\d\)|scan of the beam", own.said["Source"])
    assert "temperature" in own.said["Test"]
    assert re.search(r"at rest|/s|\brate (?:and temperature )?not known", own.said["Test"]), "how fast"
    low, high = own.valid_stretch_range or (0.0, 0.0)
    assert 0.0 < low < high
    constants = re.findall(r"(\w+) = [\[0-9-]", own.text.partition("(")[2])
    assert constants
    for name in constants:
        assert re.search(rf"\b{name}\b[^;]*(?:\d|not given|unknown)", own.said["Uncertain"]), name


def test_the_curve_of_its_page_is_that_of_its_law(capsys: pytest.CaptureFixture[str]) -> None:
    """Of logarithmic neo-Hooke in closed form, to the six digits that are shown."""
    own = KEPT["ecoflex_0030_tension"]
    mu, lam = 48.3e3 / 2.98, 48.3e3 * 0.49 / (1.49 * 0.02)
    for l, stress in material_library.tensile_curve(own):
        t = brentq(lambda t, l=l: mu * (t * t - 1) + lam * math.log(l * t * t), 0.3, 2.0, xtol=1e-15)
        assert stress == pytest.approx((mu * (l * l - 1) + lam * math.log(l * t * t)) / l, rel=1e-9)
    text = page("ecoflex_0030_tension") or ""
    assert "28.323 kPa" in text
    assert "Uncertain: young 43 to 52 kPa" in text
    assert main(["list", "materials", "--library"]) == 0
    assert "ecoflex_0030_tension" in capsys.readouterr().out
    assert main(["list", "codes", "--library"]) == 2


@pytest.mark.slow
def test_the_list_of_the_library_needs_no_arrays() -> None:
    code = ("import sys; from softmark.interpreter.cli.main import main; main(['list', 'materials', '--library']); "
            "assert not {'numpy', 'scipy'} & set(sys.modules)")  # fmt: skip
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def nominal(name: str, stretches: Floats) -> Floats:
    """Nominal stresses of a material of the library pulled to stretches (n,), Pa: one material point."""
    own = KEPT[name]
    scene = softmark.loads(f"""softmark 1
use "{own.file}" as kept
body b = solid(box(size = (1, 1, 1) cm), kept.{name})
support s = fixed(b, where = x <= 0 cm, components = x)
support g = displaced(b, where = x >= 1 cm, by = (1, 0, 0) mm, components = x)
model dot = homogeneous(uniaxial)
""").scene
    point = build_material_point(case_for(scene, scene.declared["dot"]), "finite")
    drives = (ImposedDeformation(np.array([l, math.nan, math.nan])) for l in stretches)
    return np.array([point.state(drive).P[0, 0] for drive in drives])


def constants(name: str) -> list[float]:
    """Those of a law, as they are written, in SI."""
    text = KEPT[name].text.partition("(")[2].partition("poisson")[0]
    found = []
    for many, one, unit in re.findall(r"= (?:\[([^\]]*)\]|([-\d.]+))(?: (kPa|Pa))?", text):
        found += [float(x) * {"kPa": 1e3, "Pa": 1.0, "": 1.0}[unit] for x in (many or one).split(",")]
    return found


@pytest.mark.usefixtures("data")
def test_fits_of_a_pull_are_what_least_squares_find_and_as_near_as_they_say() -> None:
    """Constants to the digits that are written; each curve over every point in its range, as its page states."""
    ogden = constants("ecoflex_0030_pulled")
    for name, given, far, rms in (
        ("gent", constants("ecoflex_0030_chains"), 8.8, 440.0),
        ("ogden", [ogden[0], ogden[2], ogden[1], ogden[3]], 4.8, 290.0),
    ):
        c, l, P, _ = fits.of_pull(name)
        assert given == pytest.approx(c, rel=5e-4)
        own = KEPT["ecoflex_0030_chains" if name == "gent" else "ecoflex_0030_pulled"]
        some = np.flatnonzero(
            (l >= (own.valid_stretch_range or (0, 0))[0]) & (l <= (own.valid_stretch_range or (0, 0))[1])
        )
        Q = nominal(own.name, l[some])
        assert np.abs(Q / P[some] - 1.0).max() < far / 100.0
        assert math.sqrt(((Q - P[some]) ** 2).mean()) < rms


@pytest.mark.usefixtures("data")
def test_fits_of_a_press_are_as_near_as_they_say() -> None:
    c, l, mean, _, deviation = fits.of_press()
    assert constants("ecoflex_0030_pressed") == pytest.approx(c, rel=5e-4)
    assert deviation == pytest.approx([184.0, 265.0, 116.0], rel=0.01)
    some = (l <= 0.92) & (l >= 0.55)
    assert np.abs(nominal("ecoflex_0030_pressed", l[some]) / mean[some] - 1.0).max() < 0.008
    l, P = fits.pressed()
    mean, Q = P.mean(axis=0), nominal("ecoflex_0030_pressed_far", l)
    assert np.abs(Q / mean - 1.0).max() < 0.098
    assert math.sqrt(((Q - mean) ** 2).mean()) < 1.25e3


# Of the published mean curves of Budday et al. (2017), kPa, every fourth point, as LivingMatterLab/CANN gives them
# (ABAQUS/DATA/rawCXdata.dat and rawCRdata.dat): stretch pulled, stress; stretch pressed, stress; shear, stress
BRAIN = {
    "brain_cortex": (0.04, [
        (1.025, 0.0838, 0.975, -0.1479, 0.05, 0.0633), (1.05, 0.1488, 0.95, -0.3504, 0.1, 0.1412),
        (1.075, 0.2366, 0.925, -0.6579, 0.15, 0.2698), (1.1, 0.4151, 0.9, -1.1484, 0.2, 0.5435),
    ]),
    "brain_corona_radiata": (0.03, [
        (1.025, 0.0423, 0.975, -0.0800, 0.05, 0.0318), (1.05, 0.0721, 0.95, -0.2024, 0.1, 0.0681),
        (1.075, 0.1050, 0.925, -0.4127, 0.15, 0.1347), (1.1, 0.1582, 0.9, -0.7591, 0.2, 0.2611),
    ]),
}  # fmt: skip


@pytest.mark.parametrize("name", BRAIN)
def test_brain_is_as_near_to_its_published_curves_as_it_says(name: str) -> None:
    """A sign of alpha that is wrong would be: pressed it is three times as stiff as pulled."""
    rms, rows = BRAIN[name]
    table = np.array(rows)
    (mu, alpha), g = constants(name), table[:, 4]
    t = 0.5 * g + np.sqrt(1.0 + 0.25 * g * g)  # the principal stretch of a shear
    sheared = mu * (t**alpha - t**-alpha) / (t + 1.0 / t)
    ends = [nominal(name, table[:, k]) - 1e3 * table[:, k + 1] for k in (0, 2)]
    off = np.concatenate([*ends, sheared - 1e3 * table[:, 5]])
    assert math.sqrt((off**2).mean()) < 1.5e3 * rms
    assert np.abs(off).max() < 0.1e3


@pytest.mark.slow
def test_what_has_fibres_has_a_curve_of_one_cell() -> None:
    """Along fibres, J = 1: P = a (l - l^-2) exp(b (I1 - 3)) + 2 a_f (l^2 - 1) l exp(b_f (l^2 - 1)^2), lateral alike.

    Sheets are shorter than at rest then and slack; to 1e-6, as far as the solver goes.
    """
    for l, P in material_library.tensile_curve(KEPT["myocardium"]):
        if l > 1.01:
            due = 59.0 * (l - l**-2) * math.exp(8.023 * (l * l + 2.0 / l - 3.0))
            due += 2.0 * 18472.0 * (l * l - 1.0) * l * math.exp(16.026 * (l * l - 1.0) ** 2)
            assert pytest.approx(due, rel=1e-6) == P
