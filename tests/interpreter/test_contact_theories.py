"""From scenes to what a rigid body presses, what theories of contact say of it, and what they refuse."""

from __future__ import annotations

import math

import pytest
from reference_problems import case, problem, refused

import softmark
from softmark.interpreter.problem.body_case import case_of
from softmark.interpreter.problem.theories import theory_setup_of
from softmark.interpreter.problem.theories.reference_solution import problem_of, solve_theory
from softmark.interpreter.report.run.report_page import render
from softmark.interpreter.report.run.report_terminal import table
from softmark.interpreter.report.run.tables.table_section import format_force
from softmark.references.cattaneo_mindlin import PartialSlip
from softmark.references.half_space_indentation import HalfSpace
from softmark.references.layer_integral_equation import Layer
from softmark.references.line_contact import LineContact, half_width

BLOCK = """
material gel   = linear_elastic(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     block = solid(box(size = (400, 300, 200) mm, origin = (-200, -150, -200) mm), gel)
body     ball  = rigid(sphere(radius = 10 mm, origin = (1, 2, 10.1) mm))
contact  touch = rigid_contact(ball, block)
support  base  = fixed(block, where = z <= -200 mm)
support  hand  = displaced(ball, by = (0, 0, -0.6) mm)
model    tets  = fem(tet10, strain = small, size = 50 mm)
reference told = hertz(block)
metric   push  = force(touch, along = -z, against = told)
"""
BALL = "sphere(radius = 10 mm, origin = (1, 2, 10.1) mm)"
TURNED = """
material gel   = neo_hookean(young = 10 kPa, poisson = 0.5, density = 1000 kg/m^3)
body     block = axisymmetric(quadrilateral(first = (0, 0, 0) mm, second = (80, 0, 0) mm, third = (80, 20, 0) mm,
    fourth = (0, 20, 0) mm), gel)
body     ball  = rigid(sphere(radius = 10 mm, origin = (0, 30, 0) mm))
contact  touch = rigid_contact(ball, block)
support  base  = fixed(block, where = y <= 0 mm)
support  hand  = displaced(ball, by = (0, -0.5, 0) mm)
model    quads = fem(quad9, strain = finite, size = 5 mm, formulation = mixed)
reference told = dimitriadis(block)
metric   push  = force(touch, along = -y, against = told)
"""
STRIP = """
material gel   = linear_elastic(young = 200 Pa, poisson = 0.3, density = 1000 kg/m^3)
body     block = plane_strain(quadrilateral(first = (0, 0, 0) m, second = (80, 0, 0) m, third = (80, 20, 0) m,
    fourth = (0, 20, 0) m), gel, thickness = 2 m)
body     roll  = rigid(cylinder(radius = 8 m, length = 10 m, axis = +z, origin = (40, 28.02, -5) m))
contact  touch = rigid_contact(roll, block)
support  base  = fixed(block, where = y <= 0 m)
support  hand  = displaced(roll, by = (0, -0.12, 0) m)
model    quads = fem(quad8, strain = small, size = 5 m)
reference told = hertz_line(block)
metric   push  = force(touch, along = -y, against = told)
"""
ROLL = "cylinder(radius = 8 m, length = 10 m, axis = +z, origin = (40, 28.02, -5) m)"
BAR = """
material gel   = linear_elastic(young = 10 kPa, poisson = 0.25, density = 1000 kg/m^3)
body     block = solid(box(size = (100, 20, 10) mm), gel)
body     wall  = rigid(half_space(origin = (101, 0, 0) mm, normal = (-1, 0, 0)))
contact  touch = rigid_contact(wall, block)
support  base  = fixed(block, where = x <= 0 mm, components = x)
support  side  = symmetric(block, where = y <= 0 mm)
support  below = symmetric(block, where = z <= 0 mm)
load     pull  = traction(block, where = x >= 100 mm, vector = (200, 0, 0) Pa)
model    tets  = fem(tet10, strain = small, size = 10 mm)
reference told = signorini(block)
metric   push  = force(touch, along = +x, against = told)
"""


def answer(text: str):
    """What it says."""
    return solve_theory(*case(text))


def test_a_sphere_above_a_block() -> None:
    """The gap of 0.1 mm is left before it touches: d = 0.5 mm."""
    own = problem(BLOCK)
    assert (own.kind, own.size, own.friction, own.share) == ("sphere", 0.01, 0.0, 1.0)
    assert own.depth == pytest.approx(0.5e-3, rel=1e-12)
    assert (own.young, own.poisson) == pytest.approx((10e3, 0.3))
    assert own.at == pytest.approx((1e-3, 2e-3, 0.0))
    assert own.normal == (0.0, 0.0, 1.0)
    assert (own.around.thickness, own.around.width, own.around.bonded) == pytest.approx((0.2, 0.148, True))


def test_what_it_carries() -> None:
    """Hertz's 16.38145 mN of the catalogue goes down on the block, and all of it into the base; 1e-6 of rounding."""
    reference, own = case(BLOCK)
    found = solve_theory(reference, own)
    assert isinstance(found, HalfSpace)
    rest = theory_setup_of(reference).forces(own, found)
    assert rest is not None
    push, base = rest.reactions["touch"], rest.reactions["base"]
    assert push.force == pytest.approx((0.0, 0.0, -16.38145e-3), rel=1e-6)
    assert base.force == pytest.approx((0.0, 0.0, 16.38145e-3), rel=1e-6)
    total = [a + b for a, b in zip(push.moment, base.moment, strict=True)]
    assert total == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    touched = rest.touches["touch"]
    assert touched.area == pytest.approx(math.pi * 5e-6, rel=1e-12)
    assert (touched.pressure, touched.gap) == pytest.approx((1564.31, 0.0), rel=1e-5)
    assert found.relative_errors["depth"] == pytest.approx(0.05)
    reference, own = case(BLOCK.replace("-0.6", "-0.5"))
    assert theory_setup_of(reference).warning(solve_theory(reference, own)) is None


def test_what_is_left_before_it_touches() -> None:
    reference, own = case(BLOCK.replace("-0.6", "-0.04"))
    found = solve_theory(reference, own)
    rest = theory_setup_of(reference).forces(own, found)
    assert rest is not None
    assert rest.reactions["touch"].force == (0.0, 0.0, 0.0)
    assert rest.touches["touch"].gap == pytest.approx(0.06e-3, rel=1e-9)


def test_from_any_side_and_at_any_state() -> None:
    below = BLOCK.replace(BALL, "sphere(radius = 10 mm, origin = (1, 2, -210.1) mm)").replace("-0.6", "0.6")
    below = below.replace("z <= -200 mm", "z >= 0 mm")
    assert answer(below).push == pytest.approx(16.38145e-3, rel=1e-6)
    beside = BLOCK.replace(BALL, "sphere(radius = 10 mm, origin = (210.1, 0, -100) mm)").replace(
        "z <= -200", "x <= -200"
    )
    beside = beside.replace("by = (0, 0, -0.6)", "by = (-0.6, 0, 0)")
    own = problem(beside)
    assert own.normal == (1.0, 0.0, 0.0)
    assert (own.around.thickness, own.around.width) == pytest.approx((0.4, 0.1))
    states = "analysis press = static(states = [50, 100] %)\n"
    moved = BLOCK.replace("-0.6) mm)", "-0.6) mm, amplitude = per_state)") + states
    assert problem_of(*_in_state(moved, 0)).depth == pytest.approx(0.2e-3)


def _in_state(text: str, number: int):
    from softmark.interpreter.language.scene_states import in_state

    scene = in_state(softmark.loads("softmark 1\n" + text).scene, number)
    return scene.declared["told"], case_of(scene, "block")


def test_a_quarter_carries_a_quarter() -> None:
    """Planes of symmetry through the axis; the sides that are left are those that are far."""
    text = BLOCK.replace("size = (400, 300, 200) mm, origin = (-200, -150, -200) mm", "size = (200, 200, 200) mm, "
                         "origin = (1, 2, -200) mm")  # fmt: skip
    text += "support left = symmetric(block, where = x <= 1 mm)\nsupport front = symmetric(block, where = y <= 2 mm)\n"
    reference, own = case(text)
    found = problem_of(reference, own)
    assert (found.share, found.around.width) == pytest.approx((0.25, 0.2))
    rest = theory_setup_of(reference).forces(own, solve_theory(reference, own))
    assert rest is not None
    assert rest.reactions["touch"].force[2] == pytest.approx(-16.38145e-3 / 4, rel=1e-6)
    assert rest.reactions["base"].force[2] == pytest.approx(16.38145e-3 / 4, rel=1e-6)
    assert math.isnan(rest.reactions["left"].force[0])
    assert rest.touches["touch"].area == pytest.approx(math.pi * 5e-6 / 4, rel=1e-12)
    assert all(math.isnan(m) for m in (*rest.reactions["touch"].moment, *rest.reactions["touch"].own_moment))
    assert "axis of the indenter" in refused(text.replace("origin = (1, 2, 10.1)", "origin = (1.1, 2, 10.1)"))


@pytest.mark.parametrize(
    ("shape", "kind", "size"),
    [
        ("cylinder(radius = 5 mm, length = 20 mm, axis = +z, origin = (0, 0, 0.1) mm)", "punch", 5e-3),
        ("punch(radius = 5 mm, rounding = 0.5 mm, length = 20 mm, origin = (0, 0, 0.1) mm)", "punch", 4.5e-3),
        ("cone(length = 10 mm, radius = 10 mm, axis = -z, origin = (0, 0, 10.1) mm)", "cone", math.pi / 4),
        (
            "rounded_cone(angle = 90 deg, rounding = 0.1 mm, length = 10 mm, origin = (0, 0, 0.1) mm)",
            "cone",
            math.pi / 4,
        ),
    ],
)
def test_cones_and_punches(shape: str, kind: str, size: float) -> None:
    text = BLOCK.replace(BALL, shape).replace("hertz", "sneddon")
    own = problem(text)
    assert (own.kind, own.size, own.depth) == (kind, pytest.approx(size), pytest.approx(0.5e-3))
    off = answer(text).relative_errors
    rounded = {"punch": {"rim"}, "rounded_cone": {"tip"}}.get(shape.partition("(")[0], set())
    assert {"rim", "tip"} & set(off) == rounded


def test_a_layer() -> None:
    """The catalogue's 22.73437 and 22.04538 mN; a layer that slides says by how much its series is off."""
    found = answer(TURNED)
    assert found.push == pytest.approx(22.73437e-3, rel=1e-6)
    slides = TURNED.replace("y <= 0 mm)", "y <= 0 mm, components = y)")
    assert answer(slides).push == pytest.approx(22.04538e-3, rel=1e-6)
    exact = answer(slides.replace("dimitriadis", "pressed_layer"))
    assert isinstance(exact.layer, Layer)
    assert exact.push == pytest.approx(
        answer(slides).push * (1.0 + answer(slides).relative_errors["series"]), rel=1e-12
    )
    assert "the series holds for 0.5" in refused(TURNED.replace("= 0.5,", "= 0.45,"))


def test_a_body_that_ends_soon_is_doubted_and_then_refused() -> None:
    near = TURNED.replace("dimitriadis", "hertz")
    reference, own = case(near)
    doubt = theory_setup_of(reference).warning(solve_theory(reference, own))
    assert doubt is not None
    assert "far face is near" in doubt
    assert "times the distance to the far face" in refused(
        near.replace("20, 0) mm", "4, 0) mm").replace("30, 0", "14, 0")
    )


def test_a_cylinder_on_a_strip() -> None:
    """Force, half-width and pressure agree with Hertz's of that force; forces are those of the slice of 2 m."""
    found = answer(STRIP)
    assert isinstance(found, LineContact)
    assert (found.strip.depth, found.strip.thickness, found.slice) == pytest.approx((0.1, 20.0, 2.0))
    assert found.radius == pytest.approx(half_width(0.5 * found.push, 8.0, 200.0 / 0.91), rel=1e-12)
    assert "knows" not in str(found.relative_errors)
    assert found.at == pytest.approx((40.0, 20.0, 0.0))
    lost = STRIP + "probe top = point(block, at = (40, 20, 0) m)\nmetric miss = tip_error(top, against = told)\n"
    with pytest.raises(softmark.SceneError, match="a theory of forces only"):
        softmark.loads("softmark 1\n" + lost)


DRAGGED = BLOCK.replace("rigid_contact(ball, block)", "rigid_contact(ball, block, friction = 0.5)").replace(
    "hertz", "cattaneo_mindlin"
)
ALONG = "support drag = displaced(ball, by = (0.11233, 0, 0) mm)\n"


def test_a_sphere_that_is_dragged() -> None:
    """Half of mu P at the catalogue's travel of 0.11233 mm, to its five digits, along +x on the block."""
    reference, own = case(DRAGGED + ALONG)
    found = solve_theory(reference, own)
    assert isinstance(found, PartialSlip)
    assert found.drag / (0.5 * found.push) == pytest.approx(0.5, abs=3e-5)
    rest = theory_setup_of(reference).forces(own, found)
    assert rest is not None
    assert rest.reactions["touch"].force == pytest.approx((found.drag, 0.0, -found.push), rel=1e-12)
    assert rest.reactions["base"].force == pytest.approx((-found.drag, 0.0, found.push), rel=1e-12)
    assert rest.dissipated == found.dissipated > 0.0


def test_a_bar_that_a_wall_stops() -> None:
    """E A = 2 N, gap 1 mm: free, 0.04 N would make it 2 mm longer; the wall carries 0.02 N. Across, 1/4 of 1 %.

    It pushes on the middle of the end, at (100, 10, 5) mm, wherever the planes of symmetry are.
    """
    reference, own = case(BAR)
    found = solve_theory(reference, own)
    assert (found.lengthening, found.push) == pytest.approx((1e-3, 0.02), rel=1e-9)
    assert found.root == pytest.approx((0.0, 0.0, 0.0))
    rest = theory_setup_of(reference).forces(own, found)
    assert rest is not None
    assert rest.reactions["touch"].force == pytest.approx((-0.02, 0.0, 0.0))
    assert rest.reactions["base"].force == pytest.approx((-0.02, 0.0, 0.0))
    assert rest.reactions["touch"].moment == pytest.approx((0.0, -1e-4, 2e-4), abs=1e-15)
    box = "box(size = (9, 90, 90) mm, origin = (101, -9, -9) mm)"
    wall = BAR.replace("load     pull", "#").replace("half_space(origin = (101, 0, 0) mm, normal = (-1, 0, 0))", box)
    wall += "support hand = displaced(wall, by = (-3, 0, 0) mm)\n"
    assert answer(wall).push == pytest.approx(0.04, rel=1e-9)


@pytest.mark.parametrize(
    ("text", "change", "why"),
    [
        (BLOCK, ("rigid_contact(ball, block)", "rigid_contact(ball, block, friction = 0.2)"), "friction of 0.2"),
        (BLOCK, ("fixed(block, where = z <= -200 mm)", "fixed(block, where = x <= -200 mm)"), "outside the far face"),
        (BLOCK, ("-200 mm)\nsup", "-200 mm)\nload weight = gravity(9.81 m/s^2)\nsup"), "include the load `weight`"),
        (BLOCK, ("contact  touch = rigid_contact(ball, block)", "contact touch = rigid_contact(ball, block)\n"
                 "contact again = rigid_contact(ball, block)"), "has 2 contacts"),
        (BLOCK, ("origin = (1, 2, 10.1)", "origin = (1, 2, 310.1)"), ""),
        (BLOCK, ("origin = (1, 2, 10.1)", "origin = (300, 2, 10.1)"), "not above a flat face"),
        (BLOCK, ("by = (0, 0, -0.6) mm", "by = (0, 0, -7) mm"), "0.69 of the radius"),
        (BLOCK, ("hertz", "sneddon"), "the indenter is a sphere"),
        (BLOCK, ("hertz", "signorini"), "is not a plane"),
        (BLOCK, ("hertz", "elastica"), "neglects contact"),
        (BLOCK, ("displaced(ball, by = (0, 0, -0.6) mm)", "rotated(ball, axis = +z, angle = 5 deg)"), "rotates"),
        (BLOCK, (BALL, "cylinder(radius = 5 mm, length = 20 mm, axis = +x, origin = (0, 0, 9) mm)"), "not normal"),
        (BLOCK, (BALL, "box(size = (9, 9, 9) mm, origin = (0, 0, 1) mm)"), "not a sphere, cylinder, cone or punch"),
        (BLOCK, ("-0.6) mm)", "-0.6) mm)\nsupport tilt = displaced(block, where = y <= -150 mm, by = (0, 0, 0) mm)"),
         "moves `block`"),
        (TURNED, ("origin = (0, 30, 0)", "origin = (1, 30, 0)"), "not on the axis"),
        (TURNED, ("(80, 0, 0) mm, third = (80, 20, 0)", "(3, 0, 0) mm, third = (3, 20, 0)"), "nearest free side"),
        (STRIP, ("hertz_line", "pressed_layer"), "the indenter is a cylinder"),
        (STRIP, (ROLL, "cone(length = 10 m, radius = 9 m, axis = -y, origin = (40, 30.02, 0) m)"),
         "cut along its axis"),
        (STRIP,
         (ROLL, "rounded_cone(angle = 90 deg, rounding = 1 m, length = 9 m, axis = +y, origin = (40, 20.02, 0) m)"),
         "cut along its axis"),
        (DRAGGED, ("by = (0, 0, -0.6)", "by = (0.1, 0, -0.6)"), "dragged while"),
        (BAR, ("components = x)\nsupport  side", ")\nsupport  side"), "cannot expand or contract"),
        (BAR, ("vector = (200, 0, 0) Pa", "vector = (200, 9, 0) Pa"), "does not act along the bar"),
    ],
)  # fmt: skip
def test_what_is_refused(text: str, change: tuple[str, str], why: str) -> None:
    assert change[0] in text
    changed = text.replace(*change)
    if not why:  # only a gap is left
        assert answer(changed).push == 0.0
        return
    assert why in refused(changed)


def test_a_model_is_held_against_it() -> None:
    """The bar and the wall, computed: uniform, so that only the gap that the barrier leaves is off, 0.1 % of the force,
    and 1e-5 of the size of the body of the displacement."""
    text = BAR + "probe end = point(block, at = (100, 20, 10) mm)\n"
    text += "metric miss = tip_error(end, against = told)\n"
    text += "metric turn = moment(touch, along = +z, about = (0, 0, 0) mm, against = told)\n"
    report = softmark.loads("softmark 1\n" + text).run()
    found = report.models["tets"]
    assert found.status == "converged"
    assert found.metrics["push"].value < 2e-3
    assert found.metrics["miss"].value < 2e-6
    assert found.metrics["turn"].value < 2e-3
    assert report.references["told"].facts["push_N"] == pytest.approx(0.02, rel=1e-9)


@pytest.mark.slow
@pytest.mark.long
def test_forces_of_a_theory_stand_beside_those_of_models_and_are_of_the_same_part() -> None:
    """A quarter of a block: a quarter of what Hertz says, 4/3 E/(1 - nu^2) sqrt(R d) d, and so is what the base holds.

    Tolerance: the closed form, rounded. The area is a quarter of pi R d; of the strain energy the theory says nothing,
    and neither of what a plane of symmetry carries.
    """
    text = """softmark 1
    material gel   = linear_elastic(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
    body     block = solid(box(size = (40, 40, 40) mm), gel)
    body     ball  = rigid(sphere(radius = 10 mm, origin = (0, 0, 50) mm))
    contact  touch = rigid_contact(ball, block)
    support  base  = fixed(block, where = z <= 0 mm)
    support  left  = symmetric(block, where = x <= 0 mm)
    support  front = symmetric(block, where = y <= 0 mm)
    support  hand  = displaced(ball, by = (0, 0, -0.4) mm)
    model    cubes = fem(hex8, strain = small, size = 10 mm)
    reference told = hertz(block)
    metric   push  = force(touch, along = -z)
    metric   held  = force(base, along = +z)
    metric   side  = force(left, along = +x)
    metric   area  = contact_area(touch)
    metric   energy = strain_energy(block)
    metric   off   = force(touch, along = -z, against = told)
    expect told.push < 1 N
    """
    report = softmark.loads(text).run()
    told = report.references["told"]
    quarter = 4.0 / 3.0 * 10e3 / 0.91 * math.sqrt(0.01 * 4e-4) * 4e-4 / 4.0
    assert set(told.metrics) == {"push", "held", "area"}
    assert told.metrics["push"].value == pytest.approx(quarter, rel=1e-12)
    assert told.metrics["held"].value == pytest.approx(quarter, rel=1e-12)
    assert told.metrics["area"].value == pytest.approx(math.pi * 0.01 * 4e-4 / 4.0, rel=1e-12)
    assert told.metrics["push"].uncertainty == pytest.approx(quarter * sum(map(abs, told.facts["off"].values())))
    own = report.models["cubes"].metrics
    assert own["off"].value == pytest.approx(abs(own["push"].value / quarter - 1.0))
    assert report.expectations[0].passed
    part = "of the quarter of block that is modelled, by symmetry (left, front); also of told"
    assert f"push, held, area, energy: {part}" in table(report, terminal=False)
    page = render(report)
    assert page.count("Of the quarter of <code>block</code> that is modelled") == 4


def test_a_force_is_told_by_its_size_where_that_is_what_a_metric_along_it_says() -> None:
    """4 % across make 0.08 % of the size: seen on four digits, not on three."""
    force = (0.04, 0.0, -1.0)
    assert format_force(force, 3, 1e-8) == "1 N"
    assert format_force(force, 4, 1e-8) == "(0.04, 0, -1) N"


@pytest.mark.parametrize(("start", "askew"), [("10 s", False), ("2 s", True)])
def test_courses_that_drag_while_they_press(start: str, askew: bool) -> None:
    text = DRAGGED.replace("-0.6) mm)", "-0.6) mm, amplitude = ramp(over = 5 s))")
    text += f"support drag = displaced(ball, by = (0.1, 0, 0) mm, amplitude = ramp(over = 5 s, start = {start}))\n"
    text += "analysis press = quasistatic(duration = 20 s, step = 1 s)\n"
    if askew:
        assert "dragged while" in refused(text)
    else:
        assert problem(text).slid == pytest.approx((1e-4, 0.0, 0.0))
