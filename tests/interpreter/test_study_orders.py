"""Observed orders and grid convergence indices: published examples, exact power laws, and what has no number."""

from __future__ import annotations

import json
import math
from itertools import pairwise

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from softmark.references.convergence_orders import (
    ConvergenceEstimate,
    ErrorOrder,
    estimate_convergence,
    observed_order,
    order_of_errors,
)


def family(cells: tuple[int, ...], values: tuple[float, ...]) -> list[tuple[float, float]]:
    """Coarse to fine, h = N^(-1/2): the published examples are plane."""
    return [(n**-0.5, f) for n, f in zip(cells, values, strict=True)]


# Celik et al. 2008, table 1: cells, values, then p, the limit, e_a^21, e_ext^21 and GCI_fine^21 as they are printed
TABLE = [
    ((4500, 8000, 18000), (5.863, 5.972, 6.063), 1.53, 6.1685, 0.015, 0.017, 0.022),
    ((980, 4500, 18000), (10.6050, 10.7250, 10.7880), 0.75, 10.8801, 0.006, 0.009, 0.011),
    ((980, 4500, 18000), (6.0909, 5.9624, 6.0042), 1.51, 6.0269, 0.007, 0.004, 0.005),
]


@pytest.mark.parametrize(("cells", "values", "p", "limit", "e_a", "e_ext", "gci"), TABLE)
def test_published_example(
    cells: tuple[int, ...], values: tuple[float, ...], p: float, limit: float, e_a: float, e_ext: float, gci: float
) -> None:
    """Half a unit of the last printed digit; e_ext and GCI were printed from rounded numbers, so 1e-4 more."""
    found = estimate_convergence(family(cells, values))
    assert found.order == pytest.approx(p, abs=5e-3)
    assert found.value == pytest.approx(limit, abs=1e-3)
    assert abs(values[2] - values[1]) / values[2] == pytest.approx(e_a, abs=5e-4)
    assert found.extrapolated_change == pytest.approx(e_ext, abs=6e-4)
    assert found.relative == pytest.approx(gci, abs=6e-4)


def test_states_of_the_published_examples() -> None:
    first, second, third = (estimate_convergence(family(*row[:2]), formal=2.0) for row in TABLE)
    assert (first.state, first.asymptotic) == ("monotone", True)
    assert second.state == "monotone"
    assert second.doubt == "not asymptotic: observed order 0.75, theoretical order 2"
    assert third.state == "oscillatory"
    assert (third.asymptotic, third.doubt) == (False, "the values oscillate about their limit")


sizes = st.lists(st.floats(1.1, 3.0), min_size=3, max_size=5).map(lambda r: [math.prod(r[i:]) for i in range(len(r))])


@given(h=sizes, p=st.floats(0.4, 4.0), limit=st.floats(-10, 10), slope=st.sampled_from([-3.0, -1.0, 0.2, 5.0]))
def test_exact_power_laws_are_found(h: list[float], p: float, limit: float, slope: float) -> None:
    """value = limit + a h^p: order to 1e-4, limit and index to what rounding leaves of the differences."""
    values = [limit + slope * x**p for x in h]
    gap = min(abs(b - a) for a, b in pairwise(values))
    assume(gap > 1e-6 * max(abs(v) for v in values))
    found = estimate_convergence(list(zip(h, values, strict=True)), formal=p)
    away = abs(limit - values[-1])
    assert found.state == "monotone"
    assert found.order == pytest.approx(p, abs=1e-4)
    assert found.value == pytest.approx(limit, abs=1e-3 * away + 1e-12)
    assert found.gci == pytest.approx(1.25 * away, rel=1e-2)


def test_two_members_need_an_order() -> None:
    """Factor of safety 3 and Richardson's formula: 1 + (1 - 1.3) / (2^2 - 1) = 0.9."""
    found = estimate_convergence([(2.0, 1.3), (1.0, 1.0)], formal=2.0)
    assert (found.state, found.order) == ("assumed", 2.0)
    assert found.value == pytest.approx(0.9)
    assert found.gci == pytest.approx(0.3)
    assert not found.asymptotic
    assert estimate_convergence([(2.0, 1.3), (1.0, 1.0)]).reason == "two meshes give no order, and none is known"
    assert estimate_convergence([(1.0, 1.0)]).state == "too_few"


def test_more_than_three_scatter() -> None:
    """h^2 with alternating noise of 0.002: the order within 0.2, and the limit within its index, which is larger."""
    h = [0.4, 0.3, 0.2, 0.15, 0.1]
    values = [1.0 + x**2 + 0.002 * (-1) ** i for i, x in enumerate(h)]
    found = estimate_convergence(list(zip(h, values, strict=True)), formal=2.0)
    assert found.order == pytest.approx(2.0, abs=0.3)
    assert found.scatter is not None
    assert 0.001 < found.scatter < 0.004
    assert found.gci is not None
    assert abs(values[-1] - 1.0) < found.gci


def test_what_has_no_number_says_why() -> None:
    rows = {
        "divergent": ([(4.0, 1.0), (2.0, 1.1), (1.0, 1.4)], "the differences do not decrease"),
        "oscillatory": ([(4.0, 1.0), (2.0, 1.1), (1.0, 0.9)], "with growing amplitude on finer meshes"),
        "rounding": ([(4.0, 1.5), (2.0, 1.0), (1.0, 1.0)], "rounding"),
        "unusable": ([(1.0, 1.0), (2.0, 1.1), (4.0, 1.4)], "coarse to fine"),
    }
    for state, (members, words) in rows.items():
        found = estimate_convergence(members)
        assert (found.state, found.order, found.value) == (state, None, None)
        assert words in (found.reason or "")
    assert "not a finite" in (estimate_convergence([(2.0, math.nan), (1.0, 1.0)]).reason or "")


def test_a_solution_that_is_only_so_exact_has_its_own_floor() -> None:
    """What a solver leaves, 1e-8, is no convergence."""
    members = [(4.0, 1.0), (2.0, 1.0 + 2e-9), (1.0, 1.0 + 3e-9)]
    assert estimate_convergence(members).order is not None
    assert estimate_convergence(members, floor=1e-8).state == "rounding"


@given(
    st.lists(st.tuples(st.floats(allow_nan=True), st.floats(allow_nan=True)), max_size=6)
    | st.lists(st.tuples(st.floats(1e-3, 10), st.floats(-1e200, 1e200)), max_size=6).map(
        lambda rows: sorted(rows, reverse=True)
    )
    | st.lists(st.floats(-1, 1), min_size=3, max_size=5).map(lambda v: [(2.0**-i, f) for i, f in enumerate(v)]),
    st.sampled_from([None, 1.0, 2.0]),
)  # fmt: skip
def test_never_a_nan(members: list[tuple[float, float]], formal: float | None) -> None:
    for found in (
        estimate_convergence(members, formal),
        estimate_convergence(members, formal, floor=0.0),
        order_of_errors(members),
    ):
        json.dumps(found.to_json(), allow_nan=False)
        if isinstance(found, ConvergenceEstimate):
            assert (found.order is None) == (found.reason is not None)
        else:
            assert (found.last is None) == (found.reason is not None)


def test_order_of_errors() -> None:
    """3 h^2, and then a last error that is half of that: log 8 / log 2 between the last two."""
    h = [0.4, 0.2, 0.1]
    assert order_of_errors([(x, 3 * x**2) for x in h]) == ErrorOrder(pytest.approx(2.0), pytest.approx(2.0))
    bent = order_of_errors([(0.4, 0.48), (0.2, 0.12), (0.1, 0.015)])
    assert (bent.last, bent.fitted) == (pytest.approx(3.0), pytest.approx(2.5))
    assert order_of_errors([(0.2, 1e-3), (0.1, 0.0)]).reason == "an error is only rounding"
    assert order_of_errors([(0.2, 1e-3), (0.1, -1.0)]).reason == "an error is negative"
    assert order_of_errors([(0.2, 1e-3)]).reason == "an order needs two meshes"


def test_observed_order_alone() -> None:
    assert observed_order([(4.0, 17.0), (2.0, 5.0), (1.0, 2.0)]) == pytest.approx(2.0)
    assert observed_order([(4.0, 1.0), (2.0, 1.0), (1.0, 2.0)]) is None
