"""What of its `where` a contact takes: in the report, and as a part of the stated error."""

from __future__ import annotations

import pytest

from softmark import loads
from softmark.interpreter.report.run.html import render
from softmark.interpreter.run import pipeline

PRESSED = """softmark 1
material gel   = linear_elastic(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = solid(box(size = (20, 20, 20) mm), gel)
body     tool  = rigid(sphere(radius = 20 mm, origin = (10, 10, 40) mm))
support  floor = fixed(block, where = z <= 0 mm)
support  hand  = displaced(tool, by = (0, 0, -1) mm)
contact  touch = between(tool, block, where = z >= 20 mm and x <= {to} mm)
model    hexes = fem(hex8, strain = small, size = 5 mm)
metric   push  = force(touch, along = -z)
"""


@pytest.mark.slow
@pytest.mark.parametrize(("to", "share"), [(15.0, 1.0), (12.0, 1.25)])
def test_facets_may_be_more_than_what_is_selected(to: float, share: float) -> None:
    """Facets are 5 mm wide: those up to x = 15 mm take part for 12 mm, which is a part of the error."""
    loaded = loads(PRESSED.format(to=to))
    report = pipeline.run(loaded.scene, list(loaded.warnings), pipeline.Options(stated=("hexes",)))
    model = report.models["hexes"]
    touched, metric = model.contacts["touch"], model.metrics["push"]
    assert touched.taken == pytest.approx(share)
    assert ("its facets are 125 % of what it selects" in render(report)) is (share > 1.0)
    parts = model.stated["push"].parts
    assert ("touching" in parts) is (share > 1.0)
    assert (parts.get("touching") or 0.0) <= (metric.value or 0.0)
