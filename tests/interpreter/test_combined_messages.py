"""Words that were made one by one, in one scene: images, parts, states, reactions, wide constants."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

import softmark
from softmark.interpreter.metrics import curve_geometry
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.references.inclusion import BodyWithRoundCore, Hookean

LOADED = """
material gel  = st_venant_kirchhoff(young = 60 kPa, poisson = 0.25, density = 1000 kg/m^3)
material firm = st_venant_kirchhoff(young = 600 kPa, poisson = 0.25, density = 2000 kg/m^3)
body     bar  = solid(box(size = (40, 20, 20) mm), gel)
region   half = part(bar, where = x >= 20 mm, material = firm)
support  wall = fixed(bar, where = x <= 0 mm)
support  grip = displaced(bar, where = half and x >= 40 mm, by = (2, 1, 0) mm, amplitude = per_state)
load     weight = gravity(9.81 m/s^2, amplitude = per_state)
load     push = traction(bar, where = half and z >= 20 mm, vector = (0, 0, -100) Pa)
analysis test = static(states = [20, 100, 60] %)
model    hexes = fem(hex8, strain = finite, size = 10 mm)
model    tets  = fem(tet10, strain = corotational, size = 20 mm)
metric   pulls = force(wall, along = +x)
metric   drawn = force(grip, along = +x)
metric   bears = force(wall, along = +z)
metric   helps = force(grip, along = +z)
"""


@pytest.mark.slow
def test_parts_states_and_reactions_balance_in_every_state() -> None:
    """Half the bar is twice as heavy: 8 cm^3 at 1 and 8 cm^3 at 2 g/cm^3, and 100 Pa on 4 cm^2, which has no course."""
    report = softmark.loads(LOADED).run()
    for model in report.models.values():
        for share, own in zip((0.2, 1.0, 0.6), model.each, strict=True):
            pulls, drawn, bears, helps = (own.metrics[n].value or 0.0 for n in ("pulls", "drawn", "bears", "helps"))
            assert pulls == pytest.approx(-drawn, rel=1e-8)
            assert bears + helps == pytest.approx(0.04 + share * 24e-3 * 9.81, rel=1e-8)


@pytest.mark.slow
def test_an_image_in_states_is_its_expression(tmp_path: Path) -> None:
    """Linear in x, as its voxels are up to the centres of the outermost: the same numbers to rounding in each state."""
    nrrd = pytest.importorskip("nrrd")
    values = np.linspace(20.0, 40.0, 5)[:, None, None] * np.ones((5, 3, 3))
    header = {"space": "left-posterior-superior", "space directions": np.diag([5.0, 10.0, 10.0]),
              "space origin": [0.0] * 3, "space units": ["mm"] * 3}  # fmt: skip
    nrrd.write(str(tmp_path / "f.nrrd"), values, header)
    rest = (
        "body bar = solid(box(size = (20, 10, 10) mm), gel)\nsupport wall = fixed(bar, where = x <= 0 mm)\n"
        "support grip = displaced(bar, where = x >= 20 mm, by = (2, 0, 0) mm, amplitude = per_state)\n"
        "analysis test = static(states = [25, 100, 50] %)\nmodel hexes = fem(hex20, strain = finite, size = 10 mm)\n"
        "probe mid = point(bar, at = (10, 5, 5) mm)\nmetric u = displacement(mid, along = +x)\n"
        "metric pull = force(grip, along = +x)\nmetric sigma = stress(mid, component = xx)\n"
    )
    law = "material gel = neo_hookean(young = {}, poisson = 0.3, density = 1000 kg/m^3)\n"
    found = []
    for young in ("ct", "20 kPa * (1 + x / (20 mm))"):
        (tmp_path / "a.scene").write_text('field ct = field("f.nrrd", unit = 1 kPa)\n' + law.format(young) + rest)
        model = softmark.load(tmp_path / "a.scene").run().models["hexes"]
        found.append([[m.value for m in own.metrics.values()] for own in model.each])
    np.testing.assert_allclose(*found, rtol=1e-9)


def test_an_inclusion_of_any_constants_is_that_of_eshelby() -> None:
    """Stiffnesses over 18 decades, Poisson's ratios from -0.99 to 0.4999, sizes over 12: far smaller than its ball.

    The deviator and the mean of the stress from afar by the factors of Eshelby (1957), the error of a finite ball with
    the cube of the ratio of radii, at 1e3 1e-9, multiplied by up to 600 where the
    matrix hardly resists shape (nu = -0.99); and rounding, 2e-16 times the ratio of the stiffnesses.
    """
    p = np.diag([1.0, 0.0, 0.0])
    mean, deviator = np.eye(3) / 3.0, p - np.eye(3) / 3.0
    for k, nu, own, a in itertools.product(
        (1e-9, 1e-3, 1.0, 1e3, 1e9), (-0.99, -0.5, 0.3, 0.4999), (-0.9, 0.0, 0.4999), (1e-9, 1e-3, 1e3)
    ):
        core, matrix = Hookean(k * 1e4 / (2.0 + 2.0 * own), own), Hookean(1e4 / (2.0 + 2.0 * nu), nu)
        bulks = [m.shear_modulus * (1.0 + m.poisson) / (1.0 - 2.0 * m.poisson) for m in (core, matrix)]
        al, be = (1.0 + nu) / (3.0 - 3.0 * nu), 2.0 * (4.0 - 5.0 * nu) / (15.0 - 15.0 * nu)
        shear, bulk = core.shear_modulus / matrix.shear_modulus, bulks[0] / bulks[1]
        due = mean * bulk / (1.0 + al * (bulk - 1.0)) + deviator * shear / (1.0 + be * (shear - 1.0))
        theory = BodyWithRoundCore(3, core, matrix, a, 1e3 * a, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), None)
        _, sigma = theory.fields(a * np.array([[0.5, 0.1, 0.2], [0.0, 0.0, 0.9]]))
        np.testing.assert_allclose(sigma, [due, due], atol=1e-6 * np.abs(due).max(), err_msg=f"{k, nu, own, a}")


@pytest.mark.parametrize(("x", "how"), [((1.0, 2.0, 2.0, 3.0), "stands still"), ((1.0, 3.0, 2.0), "turns back")])
def test_a_curve_that_is_none_says_how(x: tuple[float, ...], how: str) -> None:
    """Of a state that stands twice it was told that it turned back."""
    reference = curve_geometry.Curve(np.array([0.0, 4.0]), np.array([0.0, 4.0]), np.zeros(2))
    with pytest.raises(Undefined, match=f"x {how} between states"):
        curve_geometry.overlay(np.array(x), np.array(x), reference)
