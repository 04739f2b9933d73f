"""Curves of metrics against measured ones: integrals by quadrature of another library, courses by closed forms."""

from __future__ import annotations

import math
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

import softmark
from softmark.interpreter.metrics.curve_error import CurveError
from softmark.interpreter.metrics.curve_geometry import Curve, MetricCurve
from softmark.interpreter.metrics.measurement import Measurement, MetricInput, ReferenceData
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene
from softmark.interpreter.report.run.report_page import render
from softmark.interpreter.report.run.report_terminal import table
from softmark.interpreter.vocabulary.amplitude_words import Table

STATISTICS = ("rms", "max", "area", "unexplained", "slope")


def _random(seed: int) -> tuple[MetricCurve, Curve]:
    draw = np.random.default_rng(seed)
    x, r = np.cumsum(draw.uniform(0.1, 1.0, 9)), np.cumsum(draw.uniform(0.1, 1.0, 7))
    own = MetricCurve(x, np.cumsum(draw.normal(size=9)) + 5.0, ("m", "N"))
    return own, Curve(r, np.cumsum(draw.normal(size=7)) + 5.0, draw.uniform(0.1, 1.0, 7))


def value(own: MetricCurve, reference: Curve, statistic: str, initial: float = 0.1) -> Measurement:
    metric = CurveError("a", "b", "c", statistic, initial)  # type: ignore[arg-type]
    none = np.zeros((0, 3))
    return metric.measure(MetricInput("m", None, none, none, known=ReferenceData("b", curve=reference), curve=own))  # type: ignore[arg-type]


@pytest.mark.parametrize("seed", range(6))
def test_every_statistic_is_the_integral_that_it_says(seed: int) -> None:
    """Adaptive quadrature of scipy between the bends; areas and shares, which have kinks, with their zeros as well."""
    own, ref = _random(seed)
    low, high = max(own.x[0], ref.x[0]), min(own.x[-1], ref.x[-1])
    knots = [v for v in (*own.x, *ref.x) if low < v < high]
    y, r, u = (lambda t, c=c, v=v: float(np.interp(t, c, v)) for c, v in
               ((own.x, own.y), (ref.x, ref.y), (ref.x, ref.u)))  # fmt: skip

    def whole(f: object, begin: float = low, end: float = high) -> float:
        ends = sorted({begin, end, *(k for k in knots if begin < k < end)})
        return math.fsum(quad(f, a, b, epsabs=1e-13, limit=400)[0] for a, b in pairwise(ends))

    square, size = whole(lambda t: (y(t) - r(t)) ** 2), whole(lambda t: r(t) ** 2)
    assert value(own, ref, "rms").value == pytest.approx(math.sqrt(square / size), rel=1e-9)
    assert value(own, ref, "rms").uncertainty == pytest.approx(math.sqrt(whole(lambda t: u(t) ** 2) / size), rel=1e-9)
    ends = [low, high, *knots]
    most = max(abs(y(t) - r(t)) for t in ends)
    assert value(own, ref, "max").value == pytest.approx(most / max(abs(r(t)) for t in ends), rel=1e-12)
    areas = whole(lambda t: abs(y(t) - r(t))), whole(lambda t: abs(r(t)))
    assert value(own, ref, "area").value == pytest.approx(areas[0] / areas[1], rel=1e-6)
    mean = whole(r) / (high - low)
    variance = whole(lambda t: (r(t) - mean) ** 2)
    assert value(own, ref, "unexplained").value == pytest.approx(square / variance, rel=1e-9)
    assert value(own, ref, "rms").details["r_squared"] == pytest.approx(1.0 - square / variance, rel=1e-9, abs=1e-9)
    end = low + 0.4 * (high - low)
    middle = 0.5 * (low + end)

    def line(f: object) -> float:
        return whole(lambda t: (t - middle) * f(t), low, end) / ((end - low) ** 3 / 12.0)  # type: ignore[operator]

    steep = abs(line(lambda t: y(t) - r(t))) / abs(line(r))
    assert value(own, ref, "slope", 0.4).value == pytest.approx(steep, rel=1e-8)
    knots.append(middle)
    tilt = whole(lambda t: abs(t - middle) * u(t), low, end) / ((end - low) ** 3 / 12.0)
    assert value(own, ref, "slope", 0.4).uncertainty == pytest.approx(tilt / abs(line(r)), rel=1e-8)
    fine = np.linspace(low, high, 400_001)
    share = float(np.mean(np.abs(np.interp(fine, own.x, own.y) - np.interp(fine, ref.x, ref.y))
                          <= np.interp(fine, ref.x, ref.u)))  # fmt: skip
    assert value(own, ref, "rms").details["inside_share"] == pytest.approx(share, abs=1e-4)
    assert value(own, ref, "rms").details["covered_share"] == pytest.approx((high - low) / (ref.x[-1] - ref.x[0]))


@pytest.mark.parametrize("statistic", STATISTICS)
@pytest.mark.parametrize("seed", range(4))
def test_no_statistic_moves_more_than_is_stated(seed: int, statistic: str) -> None:
    """What `moved` says bounds the change of the value, whatever the curve moves by."""
    own, ref = _random(seed)
    draw = np.random.default_rng(100 + seed)
    for size in (1e-3, 0.1, 3.0):
        off = size * draw.normal(size=len(own.x))
        metric = CurveError("a", "b", "c", statistic)  # type: ignore[arg-type]
        bound = metric.moved(own.x, own.y, off, ref)
        other = MetricCurve(own.x, own.y + off, own.units)
        assert abs(value(other, ref, statistic).value - value(own, ref, statistic).value) <= bound * (1 + 1e-9)


def test_curves_that_agree_are_zero_apart_whatever_their_points() -> None:
    x, fine = np.array([0.0, 1.0, 3.0]), np.linspace(0.0, 3.0, 31)
    y = np.array([0.0, 2.0, 3.0])
    for statistic in STATISTICS:
        found = value(MetricCurve(fine, np.interp(fine, x, y), ("m", "N")), Curve(x, y, 0 * y), statistic, 0.5)
        assert found.value == pytest.approx(0.0, abs=1e-12)
    back = MetricCurve(fine[::-1], np.interp(fine, x, y)[::-1], ("m", "N"))
    assert value(back, Curve(x, y, 0 * y), "rms").value == pytest.approx(0.0, abs=1e-12)


def test_what_has_no_value_says_why() -> None:
    ref = Curve(np.array([0.0, 1.0]), np.array([0.0, 2.0]), np.zeros(2))
    cases = [
        (
            MetricCurve(np.array([2.0, 3.0]), np.ones(2), ("m", "N")),
            "covers 2 to 3 m .* 0 to 1 m: .*do not overlap",
        ),
        (MetricCurve(np.array([0.0, 2.0, 1.0]), np.ones(3), ("m", "N")), "turns back"),
        (MetricCurve(np.array([1.5]), np.ones(1), ("m", "N")), "at 1.5 m, outside .* 0 to 1 m"),
        (MetricCurve(np.array([0.0]), np.ones(1), ("m", "N")), "zero there"),
    ]
    for own, why in cases:
        with pytest.raises(Undefined, match=why):
            value(own, ref, "rms")
    with pytest.raises(Undefined, match="two or more states"):
        value(MetricCurve(np.array([0.5]), np.ones(1), ("m", "N")), ref, "slope")
    with pytest.raises(Undefined, match="constant"):
        value(MetricCurve(np.array([0.0, 1.0]), np.ones(2), ("m", "N")), Curve(ref.x, np.ones(2), ref.u), "unexplained")


# ------------------------------------------------------------------ in a run

BAR = """
material gel  = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     bar  = solid(box(size = (40, 10, 10) mm), gel)
model    one  = fem(hex8, strain = finite, size = 10 mm)
probe    end  = point(bar, at = (40, 0, 0) mm)
"""


def test_a_free_flight_against_its_parabola(tmp_path: Path) -> None:
    """A body that is let go falls by g t^2 / 2. The rule is exact at the ends of steps, and in between the chord of a
    parabola lies g s (h - s) / 2 above it: sqrt(g^2 h^4 / 120) in the mean square. The table's own chords are 1/2500
    of that."""
    g, h, T = 9.81, 0.05, 0.5
    t = np.linspace(0.0, T, 501)
    rows = "\n".join(f"{a!r},{b!r}" for a, b in zip(t.tolist(), (-500.0 * g * t**2).tolist(), strict=True))
    (tmp_path / "fall.csv").write_text("t,z\n" + rows)
    text = (
        BAR
        + """
analysis fly  = dynamic(duration = 0.5 s, step = 50 ms, integrator = trapezoidal)
load     pull = gravity(9.81 m/s^2)
metric   drop = displacement(end, along = +z)
reference film = curve("fall.csv", x = "t", y = "z", x_unit = 1 s, y_unit = 1 mm, uncertainty = 0 mm)
metric   miss = curve_error(drop, against = film)
metric   worst = curve_error(drop, against = film, statistic = max)
"""
    )
    (tmp_path / "a.scene").write_text(text)
    found = softmark.load(str(tmp_path / "a.scene")).run().models["one"].metrics
    assert found["miss"].details["rms_m"] == pytest.approx(g * h**2 / math.sqrt(120.0), rel=1e-3)
    assert found["miss"].value == pytest.approx(
        g * h**2 / math.sqrt(120.0) / (0.5 * g * T**2 / math.sqrt(5.0)), rel=1e-3
    )
    assert found["worst"].details["largest_m"] == pytest.approx(g * h**2 / 8.0, rel=1e-3)
    assert found["miss"].details["covered_share"] == pytest.approx(1.0)


PULL = (
    BAR
    + """
support left   = fixed(bar, where = x <= 0 mm, components = x)
support front  = fixed(bar, where = y <= 0 mm, components = y)
support bottom = fixed(bar, where = z <= 0 mm, components = z)
support grip   = displaced(bar, where = x >= 40 mm, by = (40, 0, 0) mm, components = x, amplitude = per_state)
analysis pull  = static(states = [10, 20, 30, 40, 50] %)
metric  travel = displacement(end, along = +x)
metric  force  = force(grip, along = +x)
"""
)


def _closed(stretch: float) -> float:
    """Force, N, on 100 mm^2 of the logarithmic neo-Hookean solid, its lateral stretch by bisection of that stress."""
    young, nu = 60e3, 0.3
    mu, lam = young / (2 * (1 + nu)), young * nu / ((1 + nu) * (1 - 2 * nu))
    low, high = 0.5, 1.0
    for _ in range(100):
        t = 0.5 * (low + high)
        low, high = (t, high) if mu * (t * t - 1) + lam * math.log(stretch * t * t) < 0.0 else (low, t)
    return 1e-4 * (mu * (stretch - 1 / stretch) + lam * math.log(stretch * t * t) / stretch)


@pytest.fixture(scope="module")
def pulled(tmp_path_factory: pytest.TempPathFactory) -> softmark.Report:
    """Five states against the closed form with a row at each, and against two that are higher by known shares."""
    folder = tmp_path_factory.mktemp("pull")
    rows = [(0.0, 0.0), *((40.0 * s, _closed(1.0 + s)) for s in (0.1, 0.2, 0.3, 0.4, 0.5, 0.6))]
    (folder / "pull.csv").write_text("x,f\n" + "\n".join(f"{a!r},{b!r}" for a, b in rows))
    (folder / "high.csv").write_text("x,f,g\n" + "\n".join(f"{a!r},{1.1 * b!r},{1.3 * b!r}" for a, b in rows))
    text = (
        PULL
        + """
reference form = curve("pull.csv", x = "x", y = "f", x_unit = 1 mm, y_unit = 1 N, uncertainty = 1e-6)
reference high = curve("high.csv", x = "x", y = ["f", "g"], x_unit = 1 mm, y_unit = 1 N)
metric miss = curve_error(force, over = travel, against = form)
metric most = curve_error(force, over = travel, against = form, statistic = max)
metric off  = curve_error(force, over = travel, against = high)
expect one.miss < 1e-6
expect one.off.at(10 %) > 16 % and one.off.at(50 %) < 17 %
"""
    )
    (folder / "a.scene").write_text(text)
    loaded = softmark.load(str(folder / "a.scene"))
    return run_scene(loaded.scene, list(loaded.warnings), RunOptions(draw=False, stated=()))


def test_a_pull_agrees_with_its_closed_form(pulled: softmark.Report) -> None:
    """Rows of the curve lie at the states, so that chords are the same; a homogeneous state is exact to rounding."""
    found = pulled.models["one"].metrics["miss"]
    assert found.value < 1e-7
    assert found.details["covered_share"] == pytest.approx(16.0 / 24.0)
    assert (found.details["from_m"], found.details["to_m"]) == (pytest.approx(4e-3), pytest.approx(20e-3))
    assert all(e.passed for e in pulled.expectations)
    assert pulled.references["form"].facts["unit"] == "N"


def test_repeats_are_the_uncertainty(pulled: softmark.Report) -> None:
    """1.1 and 1.3 f: their mean is 1.2 f, so that f is 1/6 off; they deviate by 0.1 sqrt(2) f, 11.8 % of the mean."""
    found = pulled.models["one"].metrics["off"]
    assert found.value == pytest.approx(1.0 / 6.0, rel=1e-6)
    assert found.uncertainty == pytest.approx(0.1 * math.sqrt(2.0) / 1.2, rel=1e-6)
    assert found.meaningful
    assert pulled.references["high"].facts["repeats"] == 2


def test_what_is_stated_of_a_curve_has_what_lies_between_states(pulled: softmark.Report) -> None:
    """The closed form between states of 10 %: chords are off by up to |f''| h^2 / 8; a third of what those of 20 %
    leave out is stated."""
    said = pulled.models["one"].stated["miss"]
    assert said.value is not None
    fine = np.linspace(1.1, 1.5, 4001)
    f = np.array([_closed(s) for s in fine])
    chord = np.interp(fine, np.linspace(1.1, 1.5, 5), f[::1000])
    true = math.sqrt(float(((chord - f) ** 2).mean() / (f**2).mean()))
    assert true < (said.parts["states"] or 0.0) * 1.2
    assert (said.parts["states"] or 0.0) < 3.0 * true
    assert said.value < 0.01


def test_what_reading_a_table_found_is_said_in_the_terminal(tmp_path: Path) -> None:
    """It stood on the page alone: a row that is taken for units, rows that are left out."""
    (tmp_path / "rig.csv").write_text("x,f\n(mm),(N)\n0,0\n20,1\n10,0.5\n")
    rig = 'reference rig = curve("rig.csv", x = "x", y = "f", x_unit = 1 mm, y_unit = 1 N, uncertainty = 1 %)\n'
    (tmp_path / "a.scene").write_text(PULL + rig + "metric miss = curve_error(force, over = travel, against = rig)\n")
    loaded = softmark.load(str(tmp_path / "a.scene"))
    shown = table(run_scene(loaded.scene, list(loaded.warnings), RunOptions(draw=False)), terminal=False)
    assert "\nrig: line 2, `(mm)`, `(N)`, is not a row of numbers and is read as units\n" in shown
    assert "\nrig: rig.csv: 1 of 3 rows do not belong to the loading branch and are omitted\n" in shown


def test_curves_in_the_report(pulled: softmark.Report) -> None:
    """In JSON, and in the page one chart for each measurement: two statistics of the same curves share it."""
    page = render(pulled)
    assert page.count("curves of models and of") == 2
    assert "the mean of 2 repeats; their standard deviation is at most" in page
    assert "66.7 % of its range is compared" in page
    drawn = pulled.models["one"].metrics["miss"].to_json()["curve"]
    assert drawn["x"] == pytest.approx([4e-3, 8e-3, 12e-3, 16e-3, 20e-3])
    assert drawn["units"] == ["m", "N"]
    measured = pulled.references["high"].to_json()["curve"]
    assert len(measured["x"]) == len(measured["uncertainty"]) == 7


# ------------------------------------------------------------------ tables as courses


def test_a_table_is_straight_between_rows_and_its_means_are_exact(tmp_path: Path) -> None:
    file = tmp_path / "m.csv"
    file.write_text("t,v\n0,0\n100,50\n300,-25\n400,100\n")
    course = Table(str(file), "t", "v", 1e-3, 50.0)
    assert [course.at(t) for t in (0.0, 0.05, 0.1, 0.2, 0.4)] == pytest.approx([0.0, 0.5, 1.0, 0.25, 2.0])
    for begin, end in ((0.0, 0.4), (0.03, 0.07), (0.05, 0.35), (0.29, 0.31), (0.1, 0.3)):
        ends = sorted({begin, end, *(t for t in (0.1, 0.3) if begin < t < end)})
        area = math.fsum(quad(course.at, a, b)[0] for a, b in pairwise(ends))
        assert course.mean(begin, end) == pytest.approx(area / (end - begin), rel=1e-12)


def test_a_table_moves_a_body_as_the_ramp_that_it_tells(tmp_path: Path) -> None:
    """The same ramp as a course of its own: forces and motions to rounding."""
    (tmp_path / "ramp.csv").write_text("time [ms],share [%]\n0,0\n40,100\n60,100\n")
    text = (
        BAR
        + """
support  wall = fixed(bar, where = x <= 0 mm)
load     pull = traction(bar, where = x >= 40 mm, vector = (0, 0, -300) Pa, amplitude = COURSE)
analysis push = dynamic(duration = 60 ms, step = 6 ms, integrator = generalized_alpha)
metric   drop = displacement(end, along = -z)
"""
    )
    table = 'table("ramp.csv", at = "time [ms]", value = "share [%]", time_unit = 1 ms, whole = 100)'
    told = []
    for course in ("ramp(over = 40 ms)", table):
        (tmp_path / "a.scene").write_text(text.replace("COURSE", course))
        told.append(softmark.load(str(tmp_path / "a.scene")).run().models["one"].probes["end"].course)
    assert told[0] is not None
    assert np.abs(told[0]).max() > 1e-4
    assert told[1] == pytest.approx(told[0], abs=1e-12)


@pytest.mark.slow
def test_a_scene_without_curves_reads_and_imports_nothing_of_them() -> None:
    """The words are known; what checks, compares and states curves is not looked at, and no table is read."""
    asked = (
        "import sys, softmark; softmark.load('stiff-cantilever').run();"
        "print([m for m in sys.modules if m.endswith(('curve_checks', 'curve_errors'))])"
    )
    done = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
