"""What is not given back on the way back: integrals by another library, works and shares in closed form."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

import softmark
from softmark.interpreter.metrics.curve_geometry import Curve, MetricCurve
from softmark.interpreter.metrics.hysteresis import Hysteresis
from softmark.interpreter.metrics.measurement import Measurement, MetricInput, ReferenceData
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene
from softmark.interpreter.report.run.report_page import render
from softmark.interpreter.report.run.report_terminal import table
from softmark.interpreter.report.run.tables.curve_points import _values_at
from softmark.interpreter.results.run_report import PlottedCurve
from softmark.references.measured_curve import CurveFromFile


def _random(seed: int) -> MetricCurve:
    draw = np.random.default_rng(seed)
    there = np.cumsum(draw.uniform(0.1, 1.0, 6))
    back = there[-1] - np.cumsum(draw.uniform(0.1, 0.8, 5))
    x, y = np.concatenate([there, back]), draw.uniform(1.0, 5.0, 11)
    return MetricCurve(-x if seed % 2 else x, y, ("m", "N"))


def measured(own: MetricCurve, reference: Curve | None = None) -> Measurement:
    none = np.zeros((0, 3))
    known = None if reference is None else ReferenceData("rig", curve=reference)
    metric = Hysteresis("force", "travel", None if reference is None else "rig")
    return metric.measure(MetricInput("m", None, none, none, known=known, curve=own))  # type: ignore[arg-type]


@pytest.mark.parametrize("seed", range(4))
def test_the_share_that_is_lost_is_the_integral_that_it_says(seed: int) -> None:
    """Adaptive quadrature of scipy on both ways, between the bends, to the right and to the left."""
    own = _random(seed)
    ways = [(own.x[:6], own.y[:6]), (own.x[5:], own.y[5:])]
    ways = [(x[np.argsort(x)], y[np.argsort(x)]) for x, y in ways]
    low, high = max(x[0] for x, _ in ways), min(x[-1] for x, _ in ways)
    works = []
    for x, y in ways:
        at = [low, *(v for v in x if low < v < high), high]
        works.append(sum(quad(lambda t, x=x, y=y: float(np.interp(t, x, y)), a, b)[0] for a, b in pairwise(at)))
    found = measured(own)
    assert found.value == pytest.approx(1.0 - works[1] / works[0], rel=1e-12, abs=1e-12)
    assert found.details["loading_Nm"] == pytest.approx(works[0])
    assert found.details["unloading_Nm"] == pytest.approx(works[1])
    assert (found.details["from_m"], found.details["to_m"]) == (pytest.approx(low), pytest.approx(high))
    assert found.details["turns_at_m"] == own.x[5]


def test_whatever_finds_back_its_way_loses_nothing() -> None:
    x = np.array([1.0, 2.0, 4.0, 2.0, 1.0])
    assert measured(MetricCurve(x, x**2, ("m", "N"))).value == 0.0
    assert measured(MetricCurve(-x, -(x**2), ("m", "N"))).value == 0.0


@pytest.mark.parametrize("seed", range(4))
def test_no_loop_moves_more_than_is_stated(seed: int) -> None:
    """What is stated bounds the change of the share, whatever the values are off by, up to that."""
    own, draw = _random(seed), np.random.default_rng(50 + seed)
    metric, none = Hysteresis("force", "travel"), np.zeros(11)
    for size in (1e-3, 0.1, 0.5):
        off = size * draw.uniform(0.5, 1.0, 11)
        bound = metric.stated(own, off, none, None)["force"]
        for _ in range(20):
            other = MetricCurve(own.x, own.y + off * draw.uniform(-1.0, 1.0, 11), own.units)
            assert abs(measured(other).value - measured(own).value) <= bound * (1.0 + 1e-9)


def test_an_error_of_a_state_is_the_same_on_both_ways() -> None:
    """Of an elastic curve that is 10 % too stiff in all states nothing is lost, and nothing is stated but by chords."""
    x = np.array([1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 1.0])
    said = Hysteresis("force", "travel").stated(MetricCurve(x, x**3, ("m", "N")), 0.1 * x**3, 0.01 * x, None)
    assert said == {"states": 0.0, "force": 0.0, "travel": 0.0}
    lossy = np.concatenate([x[:4] ** 3, 0.8 * x[4:] ** 3])  # not the same value in the same state: not the same error
    assert (
        Hysteresis("force", "travel").stated(MetricCurve(x, lossy, ("m", "N")), 0.01 * x, 0.0 * x, None)["force"]
        > 0.002
    )


def test_states_that_are_other_ones_on_the_way_back_are_said_to_matter() -> None:
    """Chords of x^2 of length h lie h^2 / 6 above it in the mean: other states on the way back make a loop."""
    x = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 2.0, 0.0])
    own = MetricCurve(x, x**2, ("m", "N"))
    apparent = abs(measured(own).value)
    assert apparent > 0.02
    said = Hysteresis("force", "travel").stated(own, 0 * x, 0 * x, None)["states"]
    assert apparent < 1.2 * said < 3.0 * apparent


@pytest.mark.parametrize(
    ("x", "y", "why"),
    [
        ([1.0, 2.0, 3.0], [1.0, 2.0, 3.0], "never turns back"),
        ([1.0, 2.0, 3.0, 2.0, 2.5], [1.0] * 5, "turns back more than once"),
        ([1.0, 2.0, 2.0, 3.0, 1.0], [1.0] * 5, "stands still"),
        ([1.0, 2.0, 1.0], [0.0, 0.0, 0.0], "work of loading is zero"),
    ],
)
def test_what_is_no_loop_says_why(x: list[float], y: list[float], why: str) -> None:
    with pytest.raises(Undefined, match=why):
        measured(MetricCurve(np.array(x), np.array(y), ("m", "N")))


def test_a_loop_against_a_measured_one_on_the_range_of_both(tmp_path: Path) -> None:
    """y = x there and y = x^2 / 4 back, from 0 to 4: of a part from a to b with corners at whole x in closed form.

    The uncertainty of 1 % of each value: 0.01 U up and 0.01 W down, (0.01 U + U / W 0.01 W) / W = 0.02 U / W.
    """
    from softmark.interpreter.language import units
    from softmark.interpreter.language.expression_evaluation import Quantity

    rows = [(v, v) for v in range(5)] + [(3, 2.25), (2, 1.0), (1, 0.25), (0, 0.0)]
    (tmp_path / "rig.csv").write_text("x,f\n" + "\n".join(f"{a},{b}" for a, b in rows))
    meter, newton = Quantity(1.0, units.LENGTH), Quantity(1.0, units.parse_unit("N").dimension)
    data = CurveFromFile(
        (str(tmp_path / "rig.csv"),), "x", ("f",), meter, newton, uncertainty=Quantity(0.01, units.NONE)
    ).load()
    reference = Curve(data.x, data.y, data.u, data.lost_between)
    there, back = (3.0**2 - 1.0) / 2.0, 0.5 * (0.25 + 1.0) + 0.5 * (1.0 + 2.25)  # from 1 to 3
    x = np.array([1.0, 2.0, 3.0, 2.0, 1.0])
    found = measured(MetricCurve(x, 2.0 * x, ("m", "N")), reference)
    assert found.value == found.details["measured_share"] == pytest.approx(1.0 - back / there, rel=1e-12)
    assert found.uncertainty == pytest.approx(0.02 * back / there, rel=1e-9)
    assert found.details["covered_share"] == 1.0
    wide = measured(MetricCurve(2.0 * x, 2.0 * x, ("m", "N")), reference)  # from 2 to 6, of which 4 were measured
    assert wide.details["covered_share"] == pytest.approx(0.5)
    far = MetricCurve(x + 4.0, x, ("m", "N"))
    with pytest.raises(Undefined, match="was not measured both loading and unloading from 5 to 7 m"):
        measured(far, reference)


def test_repeats_of_a_loop_deviate(tmp_path: Path) -> None:
    """They lose a half and a quarter: 3/8, which deviate by sqrt(2)/8."""
    from softmark.interpreter.language import units
    from softmark.interpreter.language.expression_evaluation import Quantity

    (tmp_path / "rig.csv").write_text("x,f,g\n0,1,1\n1,1,1\n2,1,1\n1.999,0.5,0.75\n1,0.5,0.75\n0,0.5,0.75\n")
    meter, newton = Quantity(1.0, units.LENGTH), Quantity(1.0, units.parse_unit("N").dimension)
    data = CurveFromFile((str(tmp_path / "rig.csv"),), "x", ("f", "g"), meter, newton).load()
    found = data.lost_between(0.0, 1.5)
    assert found == (pytest.approx(0.375), pytest.approx(np.sqrt(2.0) / 8.0))


def test_a_place_that_comes_back_has_the_value_of_the_way_back() -> None:
    """In the table below a figure both ways had the values of the way there."""
    loop = PlottedCurve(np.array([1.0, 2.0, 1.0]), np.array([5.0, 6.0, 4.0]), ("m", "N"))
    assert _values_at(loop, [1.0, 2.0, 1.0]) == [5.0, 6.0, 4.0]
    assert _values_at(loop, [2.0, 3.0, 2.0]) == [6.0, None, 6.0]


BAR = """
material gel  = linear_elastic(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     bar  = solid(box(size = (20, 10, 10) mm), gel)
support  wall = fixed(bar, where = x <= 0 mm)
support  grip = displaced(bar, where = x >= 20 mm, by = (2, 0, 0) mm, amplitude = per_state)
analysis test = static(states = [25, 50, 100, 50, 25] %)
model    one  = fem(hex8, strain = small, size = 5 mm)
probe    end  = point(bar, at = (20, 0, 0) mm)
metric   travel = displacement(end, along = +x)
metric   pull   = force(grip, along = +x)
metric   lost   = hysteresis(pull, over = travel)
"""


def test_what_is_rounding_has_no_digits_and_no_axis() -> None:
    """Nothing is lost, to 2e-16: the axis had ticks such as 0.00000000000000020, and supports carried 3e-16 N."""
    sides = "support side = symmetric(bar, where = y <= 0 mm)\nsupport back = symmetric(bar, where = z <= 0 mm)\n"
    bar = BAR.replace("fixed(bar,", "symmetric(bar,").replace("(2, 0, 0) mm", "(2, 0, 0) mm, components = x")
    loaded = softmark.loads(bar + sides)
    report = run_scene(loaded.scene, list(loaded.warnings), RunOptions(draw=False))
    assert 0.0 < max(abs(c) for c in report.models["one"].reactions["side"].reaction.force) < 1e-9
    shown, page = table(report, terminal=False), render(report)
    assert "reaction force of side: 0 N in one" in shown
    assert "e-1" not in shown.partition("reaction force")[0].partition("ok")[0]
    assert "0.0000000" not in page


def test_it_is_expected_of_all_states_together() -> None:
    """In the states before it turns it has no value, which is no reason not to judge it."""
    report = softmark.loads(BAR + "expect abs(one.lost) < 1e-9\nexpect one.lost < -1\nexpect one.pull > 0.1 N\n").run()
    met, unmet, force = report.expectations
    assert (met.passed, unmet.passed) == (True, False)
    assert (met.states, unmet.states, force.states) == ((), (), (True,) * 5)
    each = [one.metrics["lost"] for one in report.models["one"].each]
    assert [m.value is None for m in each] == [True, True, True, False, False]
    assert "turns back" in str(each[0].reason)
