"""A body that its supports turn almost rigidly: forces of its cells are below their rounding, and balance to it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import softmark

SCENE = """material steel = neo_hookean(young = 210 GPa, poisson = 0.3, density = 7800 kg/m^3)
body bar = solid(box(size = (1, 1, 8) m), steel)
support hinge = fixed(bar, where = y >= 0.5 m and y <= 0.5 m and z <= 0 m)
support lift = displaced(bar, where = (x - 0.5 m)^2 + (y - 0.5 m)^2 + (z - 8 m)^2 <= (1 mm)^2, by = (0, Y, Z) m)
model m = fem(ELEMENT, strain = finite, size = 0.5 m)
probe top = point(bar, at = (1, 1, 8) m)
metric up = displacement(top, along = +y)
metric pull = force(lift, along = +y)
"""


@pytest.mark.parametrize("element", ["hex8", "hex20"])
@pytest.mark.parametrize("angle", [0.3, 2.0])
def test_a_turned_bar_balances(element: str, angle: float, tmp_path: Path) -> None:
    """By degrees about the hinge, with numbers of nine decimals; the top goes along, to within these."""
    a = np.deg2rad(angle)
    text = SCENE.replace("Y", f"{8 * np.sin(a):.9f}").replace("Z", f"{8 * (np.cos(a) - 1):.9f}")
    (tmp_path / "bar.scene").write_text(text.replace("ELEMENT", element))
    model = softmark.load(str(tmp_path / "bar.scene")).run().models["m"]
    assert model.status == "converged", model.message
    assert model.metrics["up"].value == pytest.approx(8 * np.sin(a) - 0.5 * (1 - np.cos(a)), abs=2e-9)
    checks = model.solve["checks"]["reactions"]
    assert checks["force"] < 1e-4  # what rounding leaves of forces of 1e-11 of the stiffness: 1e-5


def test_balance_is_as_strict_as_before_where_cells_are_strained(tmp_path: Path) -> None:
    """The rounding of cells adds 1e-10 of the forces to what may be left, if they are strained by a percent."""
    text = SCENE.replace("Y", "0.0").replace("Z", "0.08").replace("ELEMENT", "hex8")
    (tmp_path / "bar.scene").write_text(text)
    model = softmark.load(str(tmp_path / "bar.scene")).run().models["m"]
    assert model.status == "converged", model.message
    assert model.solve["checks"]["reactions"]["allowed"] < 1e-6
