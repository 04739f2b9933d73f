"""Picometres in a report: with their digits on the terminal and on the page, and rounding beside them as 0."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from softmark.interpreter.cli.main import main
from softmark.interpreter.language import units
from softmark.interpreter.language.number_formatting import format_quantity
from softmark.interpreter.report.run.tables.error_statement_table import amount, stated_error
from softmark.interpreter.results.run_report import MetricResult

SCENE = """material steel = linear_elastic(young = 210 GPa, poisson = 0.3, density = 7850 kg/m^3)
body bar = solid(box(size = (100, 10, 10) mm), steel)
support wall = fixed(bar, where = x <= 0 mm, components = x)
support front = fixed(bar, where = y <= 0 mm, components = y)
support below = fixed(bar, where = z <= 0 mm, components = z)
load w = traction(bar, where = x >= 100 mm, vector = (PULL, 0, 0) Pa)
model m = fem(hex8, strain = small, size = 10 mm)
probe end = point(bar, at = (100, 5, 0) mm)
metric far = displacement(end, along = +x)
metric aside = displacement(end, along = +z)
metric longer = strain(end, component = xx)
"""


@pytest.mark.parametrize(("pull", "far", "strain"), [("4.2", "2 pm", "2e-09 %"), ("0.0042", "0.002 pm", "2e-12 %")])
def test_picometres_are_shown(
    pull: str,
    far: str,
    strain: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """u = p L / E: 4.2 Pa of 210 GPa over 0.1 m are 2 pm. The lower face is held, and moves by rounding."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bar.scene").write_text(SCENE.replace("PULL", pull))
    assert main(["run", "bar.scene", "--out", "out"]) == 0
    row = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("m "))
    assert re.split(r"  +", row)[1:4] == [far, "0", strain]
    page = (tmp_path / "out" / "report.html").read_text()
    assert re.search(r'<data value="[^"]*e-1[25]">(2(\.0+)?|0\.0020*)<', page)
    value = json.loads((tmp_path / "out" / "report.json").read_text())["models"]["m"]["metrics"]["far"]["value"]
    assert value == pytest.approx(float(pull) * 0.1 / 210e9, rel=1e-9)


def test_lengths_below_a_nanometre() -> None:
    assert units.format_value(1.87402e-12, units.LENGTH) == "1.87402 pm"
    assert units.format_value(-3.5e-11, units.LENGTH) == "-35 pm"
    assert units.format_value(2.1e-9, units.LENGTH) == "2.1 nm"


@pytest.mark.parametrize("unit", ["m", "N", "J", "N*m", "m^2"])
@pytest.mark.parametrize("scale", [1e-21, 1e-12, 1.0, 1e9])
def test_errors_are_shown_in_proportion_at_every_scale(scale: float, unit: str) -> None:
    """Half of a number is shown as half, whatever the size of the body; an error was at least 1e-12 in SI."""
    number, error = 4.0 * scale, 2.0 * scale
    assert amount(error, unit, number) == format_quantity(error, unit, 2)
    shown = stated_error(error, MetricResult(value=number, unit=unit)).removeprefix("± ")
    assert shown == format_quantity(error, unit, 2) or units.format_value(
        error, units.parse_unit(unit).dimension
    ).startswith(f"{shown} ")
    assert amount(0.0, unit, number) == format_quantity(1e-9 * number, unit, 2)  # below the digits of the number
