"""What conditions select of a straight beam: exact areas of cross-sections, and every stretch along it."""

from __future__ import annotations

import math

import numpy as np
import pytest

import softmark
from softmark.grammar.diagnostic import Source
from softmark.grammar.parser import parse_expression
from softmark.interpreter.language.condition_syntax import read_condition
from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.language.expression_evaluation import Evaluator, Quantity, SourceErrors
from softmark.interpreter.language.units import LENGTH
from softmark.interpreter.problem.cross_section_coverage import coverage, inner_stations, selection_borders
from softmark.interpreter.problem.surface_selection.section_selection import selected_share
from softmark.interpreter.validation.constructor_registry import CATALOGUE
from softmark.solvers.mesh.shapes import Box, Cylinder, transverse

BOX = Box((0.2, 0.02, 0.02))
ROUND = Cylinder(0.2, 0.01)
OBLIQUE = Cylinder(0.2, 0.01, axis=(2 / 3, 2 / 3, 1 / 3), origin=(0.01, -0.02, 0.03))


def condition(text: str) -> Condition:
    """A condition from its text."""
    node, problems = parse_expression(Source("text", text))
    assert node is not None, problems
    return read_condition(
        node, Evaluator(SourceErrors(Source("text", text), []), lambda name: Quantity(0.2, LENGTH), CATALOGUE)
    )


SHARES = [
    (BOX, "x <= 0 mm and (z <= 1 mm or z >= 4 mm)", 0.85),
    (BOX, "y + z <= 20 mm", 0.5),
    (BOX, "(y - 10 mm)^2 + (z - 10 mm)^2 <= 36 mm^2", math.pi * 36 / 400),
    (ROUND, "x <= 0 mm and (y^2 + z^2 <= 26 mm^2 or y^2 + z^2 >= 99 mm^2)", 0.27),
    (ROUND, "y >= 0 mm", 0.5),
    (ROUND, "z >= 5 mm", (math.acos(0.5) - 0.5 * math.sqrt(0.75)) / math.pi),
    (ROUND, "sqrt(y^2 + z^2) <= 10 mm", 1.0),
    (ROUND, "y^2 + z^2 < 100.0001 mm^2", 1.0),
]


@pytest.mark.parametrize(("shape", "text", "exact"), SHARES)
def test_shares_of_cross_sections(shape: Box | Cylinder, text: str, exact: float) -> None:
    """By areas of rectangles, circles and segments (R^2 (acos h/R - h/R sqrt(1 - h^2/R^2))).

    A disc's core is a polygon of 6 sides, 1/512 as wide: what its sides leave out is 7e-7 of the area.
    """
    assert selected_share(condition(text), shape, 0.0) == pytest.approx(exact, abs=1e-6)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("seed", range(8))
def test_shares_of_oblique_sections_against_points(seed: int) -> None:
    """Random planes through an oblique cylinder's section against 200 000 points: five standard deviations, 0.006."""
    rng = np.random.default_rng(seed)
    n, at = rng.standard_normal(3), rng.uniform(0.0, 0.2)
    centre = np.array(OBLIQUE.root) + at * np.array(OBLIQUE.axis)
    through = n @ centre + rng.uniform(-0.008, 0.008)
    text = f"{n[0]:.6f}*x + {n[1]:.6f}*y + {n[2]:.6f}*z <= {1e3 * through:.6f} mm"
    r, t = OBLIQUE.radius * np.sqrt(rng.random(200_000)), 2 * np.pi * rng.random(200_000)
    e1, e2 = np.array(transverse(OBLIQUE.axis))
    X = centre + np.outer(r * np.cos(t), e1) + np.outer(r * np.sin(t), e2)
    held = condition(text).holds(*X.T, 1.0)
    assert selected_share(condition(text), OBLIQUE, at) == pytest.approx(float(np.mean(held)), abs=0.006)


@pytest.mark.parametrize(
    ("shape", "text", "covers"),
    [
        (BOX, "x <= 0 mm", {"none"}),
        (BOX, "x <= 0 mm or (x >= 100.2 mm and x <= 100.5 mm)", {"none", "all"}),
        (BOX, "x <= 0 mm or (x >= 102 mm and x <= 102.1 mm and z <= 5 mm)", {"none", "some"}),
        (BOX, "x <= 0 mm or (x - 50 mm)^2 <= 0.01 mm^2", {"none", "all"}),
        (BOX, "x <= 0 mm or (x >= 70 mm and x <= 70 mm)", {"none", "all"}),
        (ROUND, "x <= 0 mm or (x - 50 mm)^2 + y^2 + z^2 <= 0.01 mm^2", {"none", "some"}),
    ],
)
def test_no_stretch_is_passed_over(shape: Box | Cylinder, text: str, covers: set[str]) -> None:
    """However thin, and wherever nodes of a beam would be."""
    assert {cover for _, cover in inner_stations(condition(text), shape)} == covers


def test_borders_of_a_thin_band() -> None:
    """100.2 and 100.5 mm, give or take the 1e-9 of the body's extent by which conditions agree."""
    found = selection_borders(condition("x <= 0 mm or (x >= 100.2 mm and x <= 100.5 mm)"), BOX)
    assert found == pytest.approx([0.1002, 0.1005], abs=3e-10)


@pytest.mark.parametrize("text", ["z <= 1 mm or z >= 4 mm", "z <= 6 mm or z >= 9 mm", "z >= 0.01 mm"])
def test_gaps_between_points_are_parts(text: str) -> None:
    """Of a section of 20 mm: a grid of 5 x 5 points took them for all of it."""
    assert coverage(condition(text), BOX, 0.0) == "some"


SCENE = """
material gel = neo_hookean(young = 600 kPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(box(size = (200, 20, 20) mm), gel)
support wall = fixed(bar, where = {where})
load weight = gravity(9.81 m/s^2)
model rod = beam6dof(segments = 20)
probe tip = point(bar, at = (200, 10, 10) mm)
"""


def test_a_beam_is_held_where_a_thin_band_holds_it() -> None:
    """As much as by a clamp of half the length, q L^4 / 8 EI of 99.5 mm and shear; without the band 84.7 mm."""
    report = softmark.loads(SCENE.format(where="x <= 0 mm or (x >= 100.2 mm and x <= 100.5 mm)")).run()
    tip = -report.models["rod"].probes["tip"].displacement[0, 2]
    L, q, E, h = 0.0995, 1000 * 9.81 * 0.02**2, 6e5, 0.02
    bent = q * L**4 / (8 * E * h**4 / 12) + q * L**2 / (2 * E / 2.6 * h**2 * 10 * 1.3 / (12 + 11 * 0.3))
    assert tip == pytest.approx(bent, rel=0.01)  # a slope of 5 degrees: the elastica is 0.2 % less


def test_a_beam_refuses_a_part_of_a_section_between_its_nodes() -> None:
    """Nodes are 10 mm apart: the band held no node, and was left out without a word."""
    where = "x <= 0 mm or (x >= 102 mm and x <= 108 mm and z <= 5 mm)"
    with pytest.raises(softmark.SceneError, match="selects only part of a cross-section"):
        softmark.loads(SCENE.format(where=where)).run()


@pytest.mark.parametrize("where", ["x <= 0.5 mm", "x <= 0 mm or (x >= 100.2 mm and x <= 100.5 mm)"])
def test_theories_of_clamped_ends_refuse_what_holds_more(where: str) -> None:
    """Looked at at 200 stations, a clamp of 0.5 mm and a second support of 0.3 mm were none."""
    scene = SCENE.format(where=where) + "reference theory = simo_reissner(bar)\n"
    with pytest.raises(softmark.SceneError, match="does not clamp exactly one end face"):
        softmark.loads(scene + "metric e = tip_error(tip, against = theory)\n").run()
