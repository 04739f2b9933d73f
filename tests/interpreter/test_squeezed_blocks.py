"""Bodies at random that are squeezed between rigid ones: every one is solved, or refused with a reason.

What is solved is checked by other formulas in every run: forces balance, and no node is behind a rigid surface. Here
it is asserted that this was looked at, and that what one plate presses the other carries.
"""

from __future__ import annotations

import pytest
from squeezed_bodies import squeezed, unlike

from softmark import SceneError, loads

SEEDS = (
    8,
    1,
    4,
    6,
    10,
    13,
    15,
    18,
    20,
    21,
    24,
    82,
    146,
)  # of each kind of body, with friction and without; 146 had a point pressing deep inside; squeezed.py takes any


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_what_is_squeezed_is_solved_or_refused_with_a_reason(seed: int) -> None:
    """Forces of both sides to 1e-6: what holds the block below, and what presses on it above."""
    try:
        found = loads(squeezed(seed)).run().models["fe"]
    except SceneError as error:
        refused = error
    else:
        assert found.status == "converged" or found.message
        assert unlike(found) == ""
        return
    assert all(d.help for d in refused.diagnostics)
