"""Values that a scene gives: what is held against them, by arithmetic; in states, in reports and in stated errors."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from loaded_modules import loaded_by

import softmark
from softmark.interpreter.language.expression_evaluation import VectorValue
from softmark.interpreter.metrics.measurement import Measurement, MetricInput, MetricNumber, ReferenceData
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.interpreter.metrics.value_error import ErrorOfValue
from softmark.interpreter.report.run.report_page import render
from softmark.interpreter.report.run.report_terminal import table
from softmark.references.published_values import KnownValue, Values

LENGTH, PLAIN = (1, 0, 0, 0, 0), (0, 0, 0, 0, 0)
ROD = """
material gel    = linear_elastic(young = 60 kPa, poisson = 0.25, density = 1000 kg/m^3)
body     bar    = solid(box(size = (100, 20, 20) mm), gel)
support  wall   = fixed(bar, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2, amplitude = per_state)
analysis rest   = static(states = [50, 100] %)
model    rod    = beam6dof(segments = 20)
reference theory = simo_reissner(bar)
probe    end    = point(bar, at = (100, 10, 10) mm)
metric   sag    = displacement(end, along = -z)
metric   held   = force(wall, along = +z)
metric   side   = force(wall, along = +y)
"""
WEIGHT = 0.1 * 0.02 * 0.02 * 1000.0 * 9.81  # N


def measured(metric: ErrorOfValue, found: float, given: KnownValue) -> Measurement:
    none = np.zeros((0, 3))
    seen = MetricInput(
        "m", None, none, none, known=ReferenceData("paper", value=given), number=MetricNumber(found, "m")
    )  # type: ignore[arg-type]
    return metric.measure(seen)


@pytest.mark.parametrize(("found", "given", "u"), [(53.6, 53.4, 0.05), (-53.44, -53.4, 0.05), (1.0, -2.0, 4.0)])
def test_an_error_is_the_difference_over_what_is_given(found: float, given: float, u: float) -> None:
    known = KnownValue(given, u, "a paper")
    share, times = (measured(ErrorOfValue("sag", "paper", of), found, known) for of in ("value", "uncertainty"))
    assert share.value == pytest.approx(abs(found - given) / abs(given), rel=1e-14)
    assert share.uncertainty == pytest.approx(u / abs(given))
    assert times.value == pytest.approx(abs(found - given) / u, rel=1e-14)
    assert times.uncertainty == 1.0
    for one in (share, times):
        assert one.details["difference_m"] == pytest.approx(found - given)
        assert one.details["within"] == (abs(found - given) <= u) == (one.value <= (one.uncertainty or 0.0))


def test_nothing_is_relative_to_zero() -> None:
    with pytest.raises(Undefined, match="the value of `paper` is zero"):
        measured(ErrorOfValue("sag", "paper"), 1.0, KnownValue(0.0, 0.1, "symmetry"))
    assert measured(ErrorOfValue("sag", "paper", "uncertainty"), 0.2, KnownValue(0.0, 0.1, "")).value == 2.0
    with pytest.raises(Undefined, match="the uncertainty of `paper` is zero"):
        measured(ErrorOfValue("sag", "paper", "uncertainty"), 1.0, KnownValue(1.0, 0.0, ""))


def test_uncertainties_are_amounts_or_shares() -> None:
    """Of values of -2 and 4 mm; of plain numbers a share would be ambiguous, and is an amount."""
    values = VectorValue((-2e-3, 4e-3), LENGTH)
    share = Values(values, VectorValue((0.1,), PLAIN), "a paper").each
    assert [v.uncertainty for v in share] == pytest.approx([2e-4, 4e-4])
    each = Values(values, VectorValue((1e-4, 3e-4), LENGTH), "a paper")
    assert [v.uncertainty for v in each.each] == [1e-4, 3e-4]
    assert [each.in_state(i, 1.0).load() for i in range(2)] == list(each.each)
    plain = Values(VectorValue((0.5,), PLAIN), VectorValue((0.02,), PLAIN), "a paper")
    assert plain.load().uncertainty == 0.02
    one = Values(VectorValue((1e-3,), LENGTH), VectorValue((0.0,), LENGTH), "a paper")
    assert one.in_state(5, 1.0) is one


def test_each_state_is_held_against_its_own_value() -> None:
    """Half the weight and the whole, given with 1 %: what the wall holds is m g to 1e-8."""
    report = softmark.loads(
        ROD
        + f'reference half = values([{WEIGHT / 2:.12g}, {WEIGHT:.12g}] N, uncertainty = 1 %, source = "m g")\n'
        + f'reference whole = values({WEIGHT:.12g} N, uncertainty = [1 mN], source = "m g")\n'
        + 'reference none = values(0 N, uncertainty = 1 mN, source = "symmetry")\n'
        "metric each = value_error(held, against = half)\n"
        "metric last = value_error(held, against = whole)\n"
        "metric flat = value_error(side, against = none, relative_to = uncertainty)\n"
        "expect rod.each < 1e-7 and rod.flat <= 1\n"
        "expect rod.last.at(50 %) > 49 % and rod.last.at(100 %) < 1e-7\n"
        "expect rod.last < 1 %\n"
    ).run()
    assert [e.passed for e in report.expectations] == [True, True, False]
    first, last = report.models["rod"].each
    assert first.metrics["last"].value == pytest.approx(0.5)
    assert first.metrics["last"].details["difference_N"] == pytest.approx(-0.5 * WEIGHT)
    assert last.metrics["last"].details["within"]
    assert not last.metrics["last"].meaningful
    assert "W352" not in {w.code for w in report.warnings}  # what lies within the uncertainty asks for no tolerance
    page, shown = render(report), table(report, terminal=False)
    assert "(none)" not in shown  # values have no row, for they have no numbers of their own
    assert 'id="values"' in page
    rows = page.partition('id="values"')[2].partition("</table>")[0]
    assert rows.count("<tr") == 1 + 3 * 2
    assert (rows.count(">yes<"), rows.count(">no<")) == (5, 1)
    assert "m g" in page.partition('id="values"')[2]
    kept = json.loads(json.dumps(report.to_json()))
    assert kept["references"]["whole"]["facts"] == {"value": pytest.approx(WEIGHT), "uncertainty": 1e-3, "unit": "N"}
    assert kept["models"]["rod"]["metrics"]["last"]["within"] is True


def test_theories_are_held_against_values_too() -> None:
    """w L^4 / (8 E I) of a slender beam is no theory's answer here: the theory's own number, which is 50.83 mm."""
    report = softmark.loads(
        ROD + 'reference paper = values([29.72, 50.83] mm, uncertainty = 0.005 mm, source = "this test")\n'
        "metric miss = value_error(sag, against = paper)\nexpect theory.miss < 1e-3 and rod.miss < 1e-3\n"
    ).run()
    assert [e.passed for e in report.expectations] == [True]


def test_a_stated_error_is_that_of_the_number() -> None:
    """|a - r| moves by no more than a does: 2 % of a value twice as large is 1 % of it."""
    from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene

    loaded = softmark.loads(
        ROD.replace("[50, 100]", "[100]")
        + 'reference paper = values(100 mm, uncertainty = 1 mm, source = "this test")\n'
        "metric miss = value_error(sag, against = paper)\n"
    )
    rod = run_scene(loaded.scene, list(loaded.warnings), RunOptions(draw=False, stated=())).models["rod"]
    own, held = rod.stated["sag"], rod.stated["miss"]
    assert own.value is not None
    assert held.value is not None
    assert held.value == pytest.approx(own.value / 0.1, rel=1e-12)
    assert (held.unit, set(held.parts)) == ("1", set(own.parts))
    assert math.isclose(sum(part or 0.0 for part in held.parts.values()), held.value, rel_tol=1e-9)


@pytest.mark.slow
def test_a_scene_without_values_imports_nothing_of_them() -> None:
    assert not {m for m in loaded_by(ROD) if m.endswith("value_checks")}


def test_stress_says_why_a_value_cannot_judge() -> None:
    from softmark.interpreter.planning.robustness_plan import no_judge_error

    scene = softmark.loads(
        ROD.replace("reference theory = simo_reissner(bar)\n", "")
        + 'reference paper = values(50 mm, uncertainty = 1 mm, source = "this test")\n'
        "metric miss = value_error(sag, against = paper)\n"
    ).scene
    told = no_judge_error(scene, None, "all")
    assert "`paper` was measured for this body and is not valid for varied parameters" in told.message
    assert "reference such as `reference theory = simo_reissner(BODY)`" in told.help
