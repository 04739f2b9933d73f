"""Bodies at random that are squeezed between rigid ones: every one is solved, or refused with a reason.

What is solved is checked by other formulas in every run: forces balance, and no node is behind a rigid surface. Here
it is asserted that this was looked at, and that what one plate presses the other carries.
"""

from __future__ import annotations

import random
from typing import Any

import pytest

from softmark import SceneError, loads

SEEDS = (0, 1, 2, 3, 4, 5, 6, 7, 8)  # those that take seconds; tests/benchmarks/squeezed.py takes any
LAWS = (
    "neo_hookean(young = {E:.3g} kPa, poisson = {nu}, density = 1000 kg/m^3)",
    "linear_elastic(young = {E:.3g} kPa, poisson = {nu}, density = 1000 kg/m^3)",
    "mooney_rivlin(c1 = {E:.3g} kPa, c2 = {F:.3g} kPa, poisson = 0.5, density = 1000 kg/m^3)",
    "yeoh(c1 = {E:.3g} kPa, c3 = {F:.3g} kPa, poisson = 0.5, density = 1000 kg/m^3)",
)
ABOVE = (
    "half_space(origin = (0, 0, {top}) mm, normal = (0, 0, -1))",
    "sphere(radius = {r} mm, origin = ({x}, {y}, {over}) mm)",
    "punch(radius = {r} mm, rounding = {round} mm, length = 20 mm, axis = +z, origin = ({x}, {y}, {top}) mm)",
    "rounded_box(size = ({r}, {r}, 10) mm, rounding = {round} mm, origin = ({x}, {y}, {top}) mm)",
    "tip(angle = 120 deg, rounding = {round} mm, length = 20 mm, axis = +z, origin = ({x}, {y}, {top}) mm)",
)
SCENE = """softmark 1
scene "squeezed"
material gel   = {law}
body     block = solid(box(size = ({a}, {b}, {c}) mm), gel)
body     floor = rigid(half_space(origin = (0, 0, {low}) mm, normal = (0, 0, 1)))
body     tool  = rigid({tool})
support  held  = fixed(block, where = z <= 0 mm{held})
support  hand  = displaced(tool, by = ({drag}, 0, {by}) mm, course = state)
contact  under = between(floor, block)
contact  over  = between(tool, block)
analysis press = static(states = [50, 100] %)
model    fe    = fem({element}, size = {size} mm, strain = {strain}{more})
metric   push  = force(over, along = -z)
metric   base  = force(held, along = +z)
metric   rest  = force(under, along = +z)
"""


def squeezed(seed: int) -> str:
    """A scene of a seed: of a block, its law, its elements and what presses on it from above."""
    one = random.Random(seed)
    law = one.choice(LAWS)
    full = "poisson = 0.5" in law
    a, b, c = (one.choice((8, 12, 20)) for _ in range(3))
    r, top = one.choice((3, 6, 10)), c + one.choice((0.0, 0.1))
    element = one.choice(("tet10",) if full else ("hex8", "tet4", "tet10", "hex20"))
    return SCENE.format(
        law=law.format(E=10 ** one.uniform(-1, 4), F=10 ** one.uniform(-2, 1), nu=one.choice((0.0, 0.3, 0.45))),
        a=a, b=b, c=c, low=-one.choice((0.0, 0.5)), held=one.choice(("", ", components = (x, y, z)")),
        tool=one.choice(ABOVE).format(
            top=top, r=r, over=top + r, round=0.3 * r, x=one.uniform(0, a), y=one.uniform(0, b)
        ),
        drag=one.choice((0.0, 0.0, 0.1 * a)), by=-one.uniform(0.02, 0.3) * c - (top - c),
        element=element, size=one.choice((4, 6)),
        strain="small" if law.startswith("linear") else "finite", more=", formulation = mixed" if full else "",
    )  # fmt: skip


@pytest.mark.parametrize("seed", [pytest.param(s, marks=[] if s == 3 else [pytest.mark.slow]) for s in SEEDS])
def test_what_is_squeezed_is_solved_or_refused_with_a_reason(seed: int) -> None:
    """Forces of both sides to 1e-6: what holds the block below, and what presses on it above."""
    try:
        report = loads(squeezed(seed)).run()
    except SceneError as refused:
        said = refused.diagnostics
    else:
        _is_right(report.models["fe"])
        return
    assert all(d.help for d in said)


def _is_right(found: Any) -> None:
    if found.status != "converged":
        assert found.message
        return
    assert all(c["least_gap"] is None or c["least_gap"] > 0.0 for c in found.solve["checks"]["contact"].values())
    push, base, rest = (found.metrics[name].value for name in ("push", "base", "rest"))
    assert None not in (push, base, rest)
    assert push == pytest.approx(base + rest, rel=1e-6, abs=1e-12)
