"""Where fibres by expressions have no direction: shares of the volume against geometry, bounds against places."""

from __future__ import annotations

import numpy as np
import pytest

from softmark.interpreter.api import python_api
from softmark.interpreter.language.interval_arithmetic import bound_expression
from softmark.interpreter.language.spatial_profiles import DirectionProfile

STRIP = """
material flesh = transversely_isotropic(shear = 10 kPa, k1 = 20 kPa, k2 = 1, density = 1000 kg/m^3, bulk = 100 kPa,
                                        fibres = ({}))
body     strip = solid({}, flesh)
support  wall  = fixed(strip, where = z <= 0 mm)
load     push  = traction(strip, where = z >= 10 mm, vector = (0, 0, 100) Pa)
model    cubes = fem({}, strain = finite, size = {})
metric   down  = force(wall, along = +z)
"""
BOX, ROD = "box(size = (40, 10, 10) mm)", "cylinder(length = 10 mm, radius = 5 mm, axis = +z)"
EXPRESSIONS = (
    "x * y - 3 mm^2, x^2, y * 1 mm", "sqrt(x * y), abs(z), max(x, y, z)", "exp(x / 9 mm), log(y / 2 mm), 1 - x / y",
    "sin(x / 2 mm * 1 rad), cos(y / 1 mm * 1 rad), tan(z / 3 mm * 1 rad)", "(x / 3 mm)^1.5, (y / z)^3, (z / 1 mm)^(-2)",
    "min(x, -y) / 1 mm, -(x / 1 mm)^4, (x / 2 mm)^(y / 3 mm)",
)  # fmt: skip


def rule(text: str) -> DirectionProfile:
    found = python_api.loads(STRIP.format(text, BOX, "hex8", "5 mm")).scene.declared["flesh"].thing.fibres
    assert isinstance(found, DirectionProfile)
    return found


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_all_values_over_a_box_are_within_its_bounds(text: str) -> None:
    """At random places of random boxes: a value is within the bounds, and none where it is said that there is none."""
    rng = np.random.default_rng(7)
    low = rng.uniform(-8e-3, 8e-3, (400, 3))
    high = low + rng.uniform(0.0, 4e-3, (400, 1)) * rng.uniform(0.0, 1.0, (400, 3))
    X = low[:, None] + (high - low)[:, None] * rng.uniform(0.0, 1.0, (400, 50, 3))
    for part in rule(text).components:
        known, seen = bound_expression(part.root, low, high), part.values(X.reshape(-1, 3), None).reshape(400, 50)
        finite = np.isfinite(seen)
        assert np.all(finite[~known.may])
        assert not np.any(finite[known.none])
        slack = 1e-12 * np.abs(seen) + 1e-300
        within = (seen >= known.low[:, None] - slack) & (seen <= known.high[:, None] + slack)
        assert np.all(within | ~finite)


def said(text: str, shape: str = BOX, kind: str = "hex8", size: str = "5 mm") -> tuple[list[str], str]:
    report = python_api.loads(STRIP.format(text, shape, kind, size)).run()
    return [w.code for w in report.warnings], " ".join(w.message for w in report.warnings if w.code == "W389")


@pytest.mark.parametrize(
    ("text", "share"),
    [
        ("max(x - 15 mm, 0 mm), 0 mm, 0 mm", "37.5 %"),  # three of eight cells along it
        ("sqrt(x * 1 mm - 2.6 mm^2), 0 mm, 0 mm", "6.25 %"),  # half a cell, between its points
        ("max(y - 1 mm, 0 mm), 0 mm, max(y - 1 mm, 0 mm)", "9.37 %"),  # 3/16 of a cell of 10 %, beside every point
    ],
)  # fmt: skip
def test_volumes_without_a_direction_are_refused(text: str, share: str) -> None:
    """Sixteenths of a cell count where there is none all over: x <= 15 of 40 mm, 2.5 of 40 (not 2.6), 0.9375 of 10."""
    with pytest.raises(python_api.SceneError) as refused:
        python_api.loads(STRIP.format(text, BOX, "hex8", "5 mm")).run()
    told = refused.value.diagnostics[0]
    assert told.code == "E383"
    assert f"at least {share} of its volume" in told.message


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "shape", "kind"),
    [("-y, x, 0 mm", ROD, "hex8"), ("-y, x, 0 mm", ROD, "tet10"),
     ("-y / sqrt(x^2 + y^2), x / sqrt(x^2 + y^2), 0", ROD, "hex8")],
)  # fmt: skip
def test_an_axis_within_cells_is_said(text: str, shape: str, kind: str) -> None:
    """Around it fibres turn all the way in the cells that touch it, on which no point of integration lies."""
    codes, message = said(text, shape, kind, "2.5 mm")
    assert codes.count("W389") == 1
    assert 2.0 < float(message.split("inside cells that fill ")[1].split(" %")[0]) < 20.0


@pytest.mark.parametrize(
    "text",
    ["x - 20 mm, 0 mm, 0 mm", "x - 21 mm, 0 mm, 0 mm", "0 mm, x, 3 mm", "-y, x, 1 um", "cos(x / 9 mm * 1 rad), 0, 1"],
)  # fmt: skip
def test_directions_that_are_one_line_on_both_sides_are_taken(text: str) -> None:
    """What vanishes on a plane, and turns to its opposite there, is the same fibre; others never vanish."""
    assert "W389" not in said(text)[0]


def test_a_rod_without_expressions_looks_at_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    from softmark.interpreter.models.shared import undefined_fiber_directions

    monkeypatch.setattr(undefined_fiber_directions, "_undefined_volume_by_intervals", None)
    assert "W389" not in said("1, 0, 0")[0]
