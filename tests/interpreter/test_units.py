"""Units: known conversions with their definitions, the algebra of dimensions, and words that are no units."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from softmark.interpreter.language import units
from softmark.interpreter.language.units import UNITS, UnitError, parse_unit

# unit, factor, what it is a multiple of, and where the factor comes from; the tolerance is a few roundings
CONVERSIONS = [
    ("mm", 1e-3, "m", "SI prefix"),
    ("µm", 1e-6, "m", "SI prefix, U+00B5"),
    ("μm", 1e-6, "m", "SI prefix, U+03BC"),
    ("um", 1e-6, "m", "SI prefix on a keyboard"),
    ("pm", 1e-12, "m", "SI prefix"),
    ("cm^2", 1e-4, "m^2", "the prefix is raised with its unit (SI brochure 2019, 3.1)"),
    ("mm^3", 1e-9, "m^3", "the prefix is raised with its unit"),
    ("inch", 0.0254, "m", "international yard and pound agreement 1959"),
    ("ft", 12 * 0.0254, "m", "12 inches"),
    ("g", 1e-3, "kg", "SI"),
    ("Mg", 1e3, "kg", "SI prefix: a tonne"),
    ("lb", 0.45359237, "kg", "international yard and pound agreement 1959"),
    ("min", 60.0, "s", "SI brochure 2019, table 8"),
    ("hour", 3600.0, "s", "SI brochure 2019, table 8"),
    ("ms", 1e-3, "s", "SI prefix"),
    ("kHz", 1e3, "s^-1", "SI prefix"),
    ("deg", math.pi / 180, "rad", "a full turn is 360 degrees and 2 pi radians"),
    ("N", 1.0, "kg*m/s^2", "SI: definition of the newton"),
    ("dyn", 1e-5, "N", "g*cm/s^2"),
    ("kgf", 9.80665, "N", "standard gravity, CGPM 1901"),
    ("lbf", 0.45359237 * 9.80665, "N", "a pound under standard gravity"),
    ("Pa", 1.0, "N/m^2", "SI: definition of the pascal"),
    ("kPa", 1e3, "Pa", "SI prefix"),
    ("MPa", 1e6, "Pa", "SI prefix"),
    ("mPa", 1e-3, "Pa", "SI prefix: not the same as MPa"),
    ("GPa", 1e9, "Pa", "SI prefix"),
    ("N/mm^2", 1e6, "Pa", "a newton on a square millimetre"),
    ("bar", 1e5, "Pa", "NIST SP 811"),
    ("mbar", 1e2, "Pa", "a thousandth of a bar"),
    ("atm", 101325.0, "Pa", "CGPM 1954"),
    ("psi", 0.45359237 * 9.80665 / 0.0254**2, "Pa", "a pound-force on a square inch"),
    ("mmHg", 133.322387415, "Pa", "13595.1 kg/m^3 * 9.80665 m/s^2 * 1 mm (NIST SP 811)"),
    ("J", 1.0, "N*m", "SI: definition of the joule"),
    ("W", 1.0, "J/s", "SI: definition of the watt"),
    ("mN/m", 1e-3, "kg/s^2", "SI prefix"),
    ("g/cm^3", 1e3, "kg/m^3", "1e-3 kg / 1e-6 m^3"),
    ("kg/m^3", 1.0, "kg*m^-3", "a quotient is a negative power"),
    ("J/(kg*K)", 1.0, "J*kg^-1*K^-1", "brackets hold a divisor together"),
    ("N·m", 1.0, "N*m", "a dot multiplies"),
    ("%", 1e-2, "1", "a hundredth"),
]


@pytest.mark.parametrize(("unit", "factor", "base"), [c[:3] for c in CONVERSIONS], ids=[c[0] for c in CONVERSIONS])
def test_conversion(unit: str, factor: float, base: str) -> None:
    found, known = parse_unit(unit), parse_unit(base)
    assert found.dimension == known.dimension
    assert found.factor / known.factor == pytest.approx(factor, rel=1e-14)


def test_every_unit_is_in_the_table_above() -> None:
    used = " ".join(c[0] for c in CONVERSIONS)
    assert [u for u in UNITS if u not in used and u not in ("m", "s", "K", "rad", "1", "Hz")] == []


SIMPLE = st.sampled_from(
    [p + u for u, (_, _, prefixed) in UNITS.items() if u != "1" for p in ("", *(units.PREFIXES if prefixed else ()))]
)
FACTOR = st.builds(lambda u, n: u if n == 1 else f"{u}^{n}", SIMPLE, st.integers(-3, 3).filter(bool))


@given(st.lists(FACTOR, min_size=1, max_size=4), FACTOR)
def test_products_and_quotients(factors: list[str], divisor: str) -> None:
    """Dimensions add up and factors multiply; the tolerance is the round-off of a few products."""
    whole = parse_unit("*".join(factors) + "/" + divisor)
    dimension, size = units.NONE, 1.0
    for factor in factors:
        dimension, size = (
            units.multiply_dimensions(dimension, parse_unit(factor).dimension),
            size * parse_unit(factor).factor,
        )
    assert whole.dimension == units.multiply_dimensions(dimension, parse_unit(divisor).dimension, -1)
    assert whole.factor == pytest.approx(size / parse_unit(divisor).factor, rel=1e-12)


@given(st.tuples(*[st.integers(-4, 4)] * 5))
def test_the_name_of_an_si_unit_reads_as_itself(dimension: units.Dimension) -> None:
    assert parse_unit(units.si_unit(dimension)) == units.Measure(1.0, dimension)


@given(st.floats(1e-18, 1e24), st.sampled_from([*units.NAMES]))
def test_what_is_shown_reads_as_the_value(value: float, dimension: units.Dimension) -> None:
    """Six digits are shown."""
    number, _, unit = units.format_value(value, dimension).partition(" ")
    measure = parse_unit(unit or "1")
    assert measure.dimension == dimension
    assert float(number) * measure.factor == pytest.approx(value, rel=1e-5)


@pytest.mark.parametrize(
    ("value", "unit", "shown"),
    [(0.178, "m", "178 mm"), (6e4, "Pa", "60 kPa"), (0.0, "m", "0 m"), (0.0, "Pa", "0 Pa"),
     (1070.0, "kg/m^3", "1070 kg/m^3"),
     (-0.02, "m", "-20 mm"), (math.pi / 6, "rad", "30 deg"), (0.05, "1", "0.05"), (2e12, "Pa", "2 TPa"),
     (6.4e-16, "m", "6.4e-16 m"), (4e-12, "m", "4 pm"), (1e21, "Pa", "1e+21 Pa"), (50442.6, "m", "50.4426 km"),
     (2e-11, "N", "2e-11 N"), (0.0, "rad", "0 rad"), (1e-9, "rad", "1e-09 rad"),
     (8.8234e-6, "m^2", "8.8234 mm^2"), (2.0, "m^2", "2 m^2"), (1e-15, "m^2", "1e-15 m^2")],
)  # fmt: skip
def test_show(value: float, unit: str, shown: str) -> None:
    assert units.format_value(value, parse_unit(unit).dimension) == shown


def test_vectors_and_ranges_are_shown_in_one_unit() -> None:
    assert units.format_vector((0.178, 0.0, -0.001), units.LENGTH) == "(178, 0, -1) mm"
    assert units.format_range(0.0, 0.178, units.LENGTH) == "0 to 178 mm"
    assert units.format_vector((1.0, 0.5), units.NONE) == "(1, 0.5)"


@pytest.mark.parametrize(
    ("wrong", "help"),
    [("kpa", "`kPa`"), ("KPA", "`kPa`"), ("mn", "`mN`"), ("meters", "`m`"), ("kg/m3", "`kg/m^3`"),
     ("m/s²", "`m/s^2`"),
     ("milimeter", "`mm`"), ("degC", "`K`"), ("N/mm/mm", "brackets"), ("J/kg*K", "brackets"),
     ("m^0.5", "sqrt"),
     ("furlong", "dsl list units"), ("m^13", "12"), ("kg/(m", "without spaces"), ("", "without spaces"),
     ("GPa*b^4", "`GPa * b^4`"), ("m/s^2*L^2", "`m/s^2 * L^2`"), ("N*Mm2", "`"), ("Mmm", "`")],
)  # fmt: skip
def test_what_is_said_of_a_word_that_is_no_unit(wrong: str, help: str) -> None:
    with pytest.raises(UnitError) as refused:
        parse_unit(wrong)
    assert help in refused.value.remedy


def test_no_suggestion_is_a_unit_itself_already() -> None:
    """Words that mean another unit are not units themselves, and what they mean is one."""
    for word, meant in units._MEANT.items():
        parse_unit(meant)
        with pytest.raises(UnitError):
            parse_unit(word)


def test_every_dimension_with_a_name_has_units_of_that_dimension() -> None:
    for dimension, (_, usual) in units.NAMES.items():
        for word in usual.replace(", or ", ", ").replace(" or ", ", ").split(", "):
            if word != "no unit":
                assert parse_unit(word).dimension == dimension, word
