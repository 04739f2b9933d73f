"""What a beam says of itself, and what is not a beam."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from softmark.references.straight_cantilever import Cantilever, Disc, NotApplicable, Rectangle


def test_silicone_beam_has_the_derived_values_of_the_recovered_experiment(silicone_beam: Cantilever) -> None:
    # A, I, EI, w, k, G, EA, kappa G A of references.json (seed_case_elastica, seed_case_reissner,
    # linear_small_strain): the same closed formulas in the same double precision, so only rounding is
    # allowed.
    beam = silicone_beam
    assert beam.section.area == pytest.approx(0.0011341149479459152, rel=1e-14)
    assert beam.section.second_moment == pytest.approx(1.0235387405211885e-07, rel=1e-14)
    assert beam.bending_stiffness == pytest.approx(0.006141232443127131, rel=1e-14)
    assert beam.weight_per_length == pytest.approx(11.904464374103888, rel=1e-14)
    assert beam.load_parameter == pytest.approx(10.932370234238228, rel=1e-14)
    assert beam.shear_modulus == pytest.approx(20134.228187919463, rel=1e-14)
    assert beam.axial_stiffness == pytest.approx(68.04689687675491, rel=1e-14)
    assert beam.shear_stiffness == pytest.approx(20.53729281994615, rel=1e-14)


def test_shear_factors_are_cowpers() -> None:
    # Cowper 1966: at nu = 0 the disc has 6/7 and the rectangle 5/6, the classical values; at nu = 0.3 the
    # formulas give 7.8/8.8 and 13/15.3. Exact fractions, so only rounding is allowed.
    assert Disc(1.0).shear_factor(0.0) == pytest.approx(6 / 7, rel=1e-15)
    assert Rectangle(1.0, 2.0).shear_factor(0.0) == pytest.approx(5 / 6, rel=1e-15)
    assert Disc(1.0).shear_factor(0.3) == pytest.approx(7.8 / 8.8, rel=1e-15)
    assert Rectangle(1.0, 2.0).shear_factor(0.3) == pytest.approx(13 / 15.3, rel=1e-15)


def test_rectangle_bends_about_the_axis_across_its_height() -> None:
    # b h^3 / 12 with h = 2 and b = 3 is 2, exactly.
    assert Rectangle(height=2.0, width=3.0).second_moment == 2.0
    assert Rectangle(height=2.0, width=3.0).area == 6.0


def test_down_is_the_direction_of_gravity(silicone_beam: Cantilever) -> None:
    # 3-4-5 triangle, exact in double precision.
    assert replace(silicone_beam, gravity=(0.0, 3.0, -4.0)).down == (0.0, 0.6, -0.8)


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"gravity": (0.0, 0.0, 0.0)}, "gravity is zero"),
        ({"gravity": (9.81, 0.0, 0.0)}, "at 0 degrees"),
        ({"gravity": (-9.81, 0.0, 0.0)}, "at 180 degrees"),
        ({"gravity": (1e-8, 0.0, -1.0)}, "degrees"),
        ({"gravity": (0.0, 0.0, math.inf)}, "the gravity is"),
        ({"axis": (1.0, 1.0, 0.0)}, "the axis has length 1.414213562"),
        ({"axis": (0.0, 0.0, 0.0)}, "the axis has length 0"),
        ({"axis": (math.nan, 0.0, 0.0)}, "the axis is"),
        ({"root": (0.0, math.nan, 0.0)}, "the root is"),
        ({"length": 0.0}, "the length is 0"),
        ({"length": math.nan}, "the length is nan"),
        ({"young": -1.0}, "the Young's modulus is -1"),
        ({"density": 0.0}, "the density is 0"),
        ({"poisson": 0.6}, "Poisson's ratio is 0.6"),
        ({"poisson": -1.0}, "Poisson's ratio is -1"),
    ],
)
def test_refuses_what_gravity_does_not_bend(silicone_beam: Cantilever, changes: dict[str, Any], word: str) -> None:
    with pytest.raises(NotApplicable) as refused:
        replace(silicone_beam, **changes)
    assert word in refused.value.reason
    assert refused.value.remedy
    assert str(refused.value) == f"{refused.value.reason}; {refused.value.remedy}"


@pytest.mark.parametrize("section", [lambda: Disc(0.0), lambda: Rectangle(1.0, -1.0), lambda: Rectangle(0.0, 1.0)])
def test_refuses_sections_without_area(section: Callable[[], object]) -> None:
    with pytest.raises(NotApplicable, match="above zero"):
        section()


def test_takes_a_direction_that_was_rounded(silicone_beam: Cantilever) -> None:
    # 1e-10 from a right angle is within the stated 1e-9: what normalising a vector twice may leave.
    assert replace(silicone_beam, gravity=(9.81e-10, 0.0, -9.81)).load_parameter > 10
