"""From scenes to the stack of blocks of the patch test, what it says of them beside models, and what it refuses."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from reference_problems import case, problem, refused

import softmark
from softmark.interpreter.problem.theories import theory_setup_of
from softmark.interpreter.problem.theories.reference_solution import solve_theory
from softmark.interpreter.results.reaction_results import EquilibriumForces
from softmark.references.contact_patch_test import DeformedStack

PAIR = """
material gel   = linear_elastic(young = 10 kPa, poisson = 0.25, density = 1000 kg/m^3)
material stiff = linear_elastic(young = 40 kPa, poisson = 0.1, density = 1000 kg/m^3)
body     pair  = solid(disjoint(box(size = (10, 20, 10) mm),
    box(size = (30, 20, 10) mm, origin = (10.5, 0, 0) mm)), gel)
region   far   = part(pair, where = x >= 10.2 mm, material = stiff)
contact  touch = self_contact(pair, where = x >= 10 mm and x <= 10.5 mm)
support  base  = fixed(pair, where = x <= 0 mm, components = x)
support  side  = symmetric(pair, where = y <= 0 mm)
support  below = symmetric(pair, where = z <= 0 mm)
support  hand  = displaced(pair, where = x >= 40.5 mm, by = (-0.85, 0, 0) mm, components = x)
model    tets  = fem(tet4, strain = small, size = 5 mm)
reference told = patch_test(pair)
metric   push  = force(touch, along = +x, against = told)
"""
GLUED = """
material gel   = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     pair  = solid(disjoint(box(size = (10, 10, 10) mm), box(size = (10, 10, 10) mm, origin = (0, 0, 10) mm),
    coarser = 0.6), gel)
contact  glue  = tied(pair)
support  base  = fixed(pair, where = z <= 0 mm, components = z)
support  lower = fixed(pair, where = y <= 0 mm and z <= 10 mm, components = y)
support  upper = fixed(pair, where = y <= 0 mm and z >= 10 mm, components = y)
support  front = symmetric(pair, where = x <= 0 mm)
load     press = LOAD
model    tets  = fem(tet4, strain = finite, size = 5 mm)
probe    all   = volume(pair, size = 3 mm)
reference told = patch_test(pair)
metric   off   = stress(all, component = zz, against = told)
metric   miss  = max_error(all, against = told)
metric   held  = force(base, along = +z, against = told)
metric   within = force(glue, along = +z, against = told)
"""
FLAT = """
material gel   = neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)
body     pair  = BODY(disjoint(
    quadrilateral(first = (R, 0, 0) mm, second = (12, 0, 0) mm, third = (12, 10, 0) mm, fourth = (R, 10, 0) mm),
    quadrilateral(first = (R, 10.02, 0) mm, second = (12, 10.02, 0) mm, third = (12, 18, 0) mm, fourth = (R, 18, 0) mm),
    coarser = 0.7), gel)
contact  touch = self_contact(pair, where = y >= 10 mm and y <= 10.02 mm)
support  base  = fixed(pair, where = y <= 0 mm, components = y)
load     press = traction(pair, where = y >= 18 mm, vector = (0, -600, 0) Pa)
model    quads = fem(quad4, strain = finite, size = 4 mm)
probe    all   = line(pair, from = (5, 0, 0) mm, to = (5, 17.9, 0) mm, points = 40)
reference told = patch_test(pair)
metric   along = stress(all, component = yy, against = told)
metric   round = stress(all, component = zz, against = told)
metric   held  = force(base, along = +y, against = told)
metric   push  = force(touch, along = +y, against = told)
"""


def answer(text: str) -> DeformedStack:
    """What it says."""
    found = solve_theory(*case(text))
    assert isinstance(found, DeformedStack)
    return found


def forces(text: str, found: DeformedStack) -> EquilibriumForces | None:
    """Return the forces of a solution."""
    reference, own = case(text)
    return theory_setup_of(reference).forces(own, found)


def test_two_blocks_of_two_materials() -> None:
    """0.35 mm are left of 0.85 mm: P = -0.35 mm / (10 mm / 10 kPa + 30 mm / 40 kPa) = -200 Pa, on 2 cm^2 40 mN.

    The force on the second piece is along +x, at the middle of the face; planes of symmetry carry nothing.
    """
    reference, own = case(PAIR)
    found = solve_theory(reference, own)
    assert isinstance(found, DeformedStack)
    assert (found.stress, found.push) == pytest.approx((-200.0, 0.04), rel=1e-9)
    rest = theory_setup_of(reference).forces(own, found)
    assert rest is not None
    assert rest.reactions["touch"].force == pytest.approx((0.04, 0.0, 0.0))
    assert rest.reactions["touch"].moment == pytest.approx((0.0, 2e-4, -4e-4))
    assert rest.reactions["base"].force == pytest.approx((0.04, 0.0, 0.0))
    assert rest.reactions["hand"].force == pytest.approx((-0.04, 0.0, 0.0))
    assert rest.reactions["side"].force == rest.reactions["below"].force == (0.0, 0.0, 0.0)
    touched = rest.touches["touch"]
    assert (touched.area, touched.pressure, touched.gap) == pytest.approx((2e-4, 200.0, 0.0))
    assert touched.field is not None
    pressures = touched.field.pressures(np.array([[0.01, 0.01, 0.002], [0.0105, 0.0, 0.01], [0.005, 0.01, 0.002]]))
    assert pressures[:2] == pytest.approx([200.0, 200.0])
    assert math.isnan(pressures[2])
    assert (rest.relative_error, theory_setup_of(reference).warning(found)) == (
        pytest.approx(sum(found.relative_errors.values())),
        None,
    )
    assert set(theory_setup_of(reference).facts(found)) == {"off", "area_m2", "push_N"}
    moved = found.displacement(np.array([[0.01, 0.02, 0.01], [0.0105, 0.02, 0.01]]))
    assert moved == pytest.approx(np.array([[-2e-4, 1e-4, 5e-5], [-7e-4, 1e-5, 5e-6]]), abs=1e-15)
    other = PAIR.replace("solid(disjoint(box(size = (10, 20, 10) mm),\n    ", "solid(disjoint(").replace(
        "origin = (10.5, 0, 0) mm)", "origin = (10.5, 0, 0) mm), box(size = (10, 20, 10) mm)")  # fmt: skip
    rest = forces(other, answer(other))
    assert rest is not None
    assert rest.reactions["touch"].force == pytest.approx((-0.04, 0.0, 0.0))


def test_a_gap_that_is_not_closed_is_left() -> None:
    text = PAIR.replace("-0.85", "-0.2")
    rest = forces(text, answer(text))
    assert rest is not None
    touched = rest.touches["touch"]
    assert (touched.area, touched.pressure, touched.gap) == pytest.approx((0.0, 0.0, 0.3e-3))
    assert rest.reactions["touch"].force == (0.0, 0.0, 0.0)


def test_three_blocks_and_any_end_that_moves() -> None:
    """Gaps of 0.5 and 0.1 mm: 0.25 mm are left, and P = -0.25 mm / 2.75 m/GPa."""
    third = "box(size = (10, 20, 10) mm, origin = (40.6, 0, 0) mm)"
    text = PAIR.replace("disjoint(", "disjoint(disjoint(").replace("(10.5, 0, 0) mm))", f"(10.5, 0, 0) mm)), {third})")
    text = text.replace("x >= 10.2 mm, m", "x >= 10.2 mm and x <= 40.55 mm, m").replace("x >= 40.5 mm", "x >= 50.6 mm")
    again = "contact  again = self_contact(pair, where = x >= 40.5 mm and x <= 40.6 mm)\n"
    found = answer(text + again)
    assert found.stress == pytest.approx(-0.25e-3 / 2.75e-6, rel=1e-9)
    lifted = text.replace(
        "fixed(pair, where = x <= 0 mm, c", "displaced(pair, where = x <= 0 mm, by = (0.85, 0, 0) mm, c"
    )
    lifted = lifted.replace("by = (-0.85", "by = (0")
    assert answer(lifted + again).stress == pytest.approx(found.stress, rel=1e-12)
    rest = forces(text + again, found)
    assert rest is not None
    assert rest.reactions["again"].force == (0.0, 0.0, 0.0)  # both sides are not the first of the pieces
    assert rest.touches["again"].area == pytest.approx(2e-4)
    assert "no contact meets the joint at x = 40.5 mm" in refused(text)
    assert "blocks between them are free" in refused(text.replace("-0.85", "-0.55") + again)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    "load",
    [
        "traction(pair, where = z >= 20 mm, vector = (0, 0, -3) kPa)",
        "pressure(pair, where = z >= 20 mm, magnitude = 3 kPa)",
        "remote_stress(pair, where = z >= 20 mm, magnitude = 4 kPa, direction = +z)",
    ],
)
def test_a_model_of_glued_blocks_is_held_against_it(load: str) -> None:
    """Exact but for the spring of the joint, which lets the upper block move by P / (1e4 E / size) = 1 um more."""
    report = softmark.loads("softmark 1\n" + GLUED.replace("LOAD", load)).run()
    found = report.models["tets"]
    assert found.status == "converged"
    values = {name: found.metrics[name].value for name in ("off", "miss", "held", "within")}
    assert max(values["off"], values["held"], values["within"]) < 1e-8
    assert values["miss"] < 1e-6


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(("body", "inner"), [("plane_strain", "0"), ("axisymmetric", "0"), ("axisymmetric", "4")])
def test_a_model_in_the_plane_and_of_revolution(body: str, inner: str) -> None:
    """What quadrature leaves of a uniform pressure, in facets of 4 and 2.8 mm: 0.2 %. Forces are those of the load."""
    text = FLAT.replace("R,", f"{inner},").replace("BODY", body)
    if body == "plane_strain":
        text = text.replace("0.7), gel)", "0.7), gel, thickness = 5 mm)")
        text += "support side = symmetric(pair, where = x <= 0 mm)\n"
    report = softmark.loads("softmark 1\n" + text).run()
    found = report.models["quads"]
    assert found.status == "converged", found.message
    values = {name: found.metrics[name].value for name in ("along", "round", "held", "push")}
    assert max(values["along"], values["round"]) < 2e-3
    assert max(values["held"], values["push"]) < 1e-6


def test_stress_is_known_everywhere() -> None:
    reference, own = case(PAIR)
    told = theory_setup_of(reference).stress(solve_theory(reference, own))
    assert told is not None
    tensors = told.at(np.array([[0.001, 0.001, 0.001], [0.03, 0.001, 0.001]]))
    assert tensors.small
    assert tensors.cauchy[:, 0, 0] == pytest.approx([-200.0, -200.0])
    assert np.abs(tensors.cauchy[:, 1:, 1:]).max() == 0.0
    assert told.usual[0] == pytest.approx(200.0)
    assert told.usual[2] == pytest.approx(200.0 * math.sqrt(2.0 / 3.0))


@pytest.mark.parametrize(
    ("text", "change", "why"),
    [
        (PAIR, ("x <= 10.5 mm)", "x <= 10.5 mm, friction = 0.2)"), "friction of 0.2 between blocks whose sections"),
        (PAIR, ("box(size = (30, 20, 10)", "box(size = (30, 20, 9)"), "with one section"),
        (PAIR, ("origin = (10.5, 0, 0)", "origin = (10.5, 1, 0)"), "with one section"),
        (PAIR, ("box(size = (30, 20, 10) mm, origin = (10.5, 0, 0) mm)",
                "cylinder(radius = 5 mm, length = 30 mm, axis = +x, origin = (10.5, 9, 5) mm)"), "not boxes"),
        (PAIR, ("disjoint(box(size = (10, 20, 10) mm),\n    box(size = (30, 20, 10) mm, origin = (10.5, 0, 0) mm))",
                "box(size = (40.5, 20, 10) mm)"), "is in one piece"),
        (PAIR, ("where = x >= 10 mm and x", "where = y >= 1 mm and x >= 10 mm and x"), "covers only a part of a joint"),
        (PAIR, ("x >= 10.2 mm, m", "x >= 20 mm, m"), "not a whole block"),
        (PAIR, ("mm, components = x)\nsupport  side", "mm)\nsupport  side"), "cannot expand or contract"),
        (PAIR, ("below = symmetric(pair, where = z <= 0 mm)", "below = fixed(pair, where = z <= 5 mm, components = z)"),
         "neither an end nor a side"),
        (PAIR, ("support  below", "support  top = symmetric(pair, where = z >= 10 mm)\nsupport  below"),
         "cannot expand along z"),
        (PAIR, ("by = (-0.85, 0, 0) mm, components = x", "by = (-0.85, 0.1, 0) mm, components = (x, y)"),
         "across its axis"),
        (PAIR, ("-0.85", "-50"), "more than the length"),
        (PAIR, ("model ", "load pull = gravity(9.81 m/s^2, direction = -x)\nmodel "), "`pull` does not act on exactly"),
        (PAIR, ("support  hand  = displaced(pair, where = x >= 40.5 mm, by = (-0.85, 0, 0) mm, components = x)\n", ""),
         "nothing moves or loads"),
        (PAIR, ("support  hand  = displaced(pair, where = x >= 40.5 mm, by = (-0.85, 0, 0) mm, components = x)",
                "load hand = traction(pair, where = x >= 40.5 mm, vector = (1, 0, 0) kPa)"), "does not press"),
        (PAIR, ("support  hand  = displaced(pair, where = x >= 40.5 mm, by = (-0.85, 0, 0) mm, components = x)",
                "load hand = traction(pair, where = x >= 40.5 mm, vector = (-1, 1, 0) kPa)"), "act along the axis"),
        (GLUED, ("base  = fixed(pair, where = z <= 0 mm, components = z)",
                 "base = fixed(pair, where = x <= 0 mm and z <= 1 mm, components = z)"), "neither an end nor a side"),
        (GLUED, ("contact  glue", "region top = part(pair, where = z >= 10 mm, material = neo_hookean(young = 9 kPa, "
                 "poisson = 0.3, density = 1 g/cm^3))\ncontact  glue"), "a tied contact between blocks"),
        (GLUED, ("tied(pair)", "tied(pair, where = z >= 9 mm and z <= 11 mm and x <= 5 mm)"), "a part of a joint"),
        (FLAT.replace("R,", "4,").replace("BODY", "axisymmetric"),
         ("load ", "support hub = fixed(pair, where = x <= 4 mm, components = x)\nload "), "expansion around its axis"),
    ],
)  # fmt: skip
def test_what_is_refused(text: str, change: tuple[str, str], why: str) -> None:
    text = text.replace("LOAD", "traction(pair, where = z >= 20 mm, vector = (0, 0, -3) kPa)")
    assert change[0] in text
    assert re.search(re.escape(why), refused(text.replace(*change)))


def test_what_narrows_alike_may_stick_and_what_does_not_narrow_may_be_fixed() -> None:
    """Friction does nothing where faces move as one."""
    alike = PAIR.replace("x <= 10.5 mm)", "x <= 10.5 mm, friction = 0.2)").replace("material = stiff", "material = gel")
    assert answer(alike).stress == pytest.approx(-0.35e-3 / 4e-6, rel=1e-9)
    rigid = PAIR.replace("poisson = 0.25", "poisson = 0").replace("poisson = 0.1", "poisson = 0")
    rigid = rigid.replace("mm, components = x)", "mm)")
    assert problem(rigid).ends == pytest.approx((0.0, -0.85e-3))
