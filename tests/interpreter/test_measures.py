"""Units that are offered for a dimension."""

from __future__ import annotations

import pytest

from softmark.interpreter.help.display_units import common_units, describe_unit, units_of
from softmark.interpreter.language import units


@pytest.mark.parametrize("dimension", units.NAMES, ids=lambda d: units.dimension_name(d))
def test_every_unit_that_is_offered_is_one_of_its_dimension(dimension: units.Dimension) -> None:
    found = units_of(dimension)
    assert found
    assert {units.parse_unit(unit).dimension for unit in found} == {dimension}


def test_pressures_are_the_usual_ones_first_and_nothing_odd() -> None:
    assert units_of(units.PRESSURE)[:4] == ("Pa", "kPa", "MPa", "GPa")
    assert not {"nPa", "TPa", "Mbar"} & set(units_of(units.PRESSURE))


def test_a_dimension_without_a_name_has_its_unit_of_si() -> None:
    assert units_of((0, 2, -1, 0, 0)) == ("kg^2/s",)


def test_a_unit_says_what_it_measures() -> None:
    assert describe_unit("kPa") == "a pressure, 1000 Pa"
    assert describe_unit("%") == "a plain number, 0.01"
    assert {"kPa", "mm", "%"} <= {unit for unit, _ in common_units()}
