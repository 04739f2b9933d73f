"""The tables of a Prony series, g = 0.3 and 0.2 in 1 and 10 s: relaxation, creep and moduli, of the reference `prony`.

Numbers were computed outside the project, to six digits; tests/solvers/test_viscoelastic.py compares the recursion
of the solver with them, with a ramp and with Fung's form.
"""

from __future__ import annotations

import math
from typing import Any

import pytest

from softmark.references.prony import Amplitude, HarmonicAmplitudeSegment, RelaxingBar

G, TAU = (0.3, 0.2), (1.0, 10.0)
ONCE = Amplitude([(0.0, 1.0)], [])


def bar(driven: Amplitude, now: float, force: bool = False, g: Any = G, tau: Any = TAU) -> RelaxingBar:
    return RelaxingBar(1.0, 1.0, (0, 0, 0), (1, 0, 0), (0, 0, 0), 1.0, 0.3, g, tau, force, 1.0, driven, now)


def test_relaxation() -> None:
    table = {0.0: 1.0, 0.1: 0.969461, 1.0: 0.791331, 5.0: 0.623328, 10.0: 0.573590, 50.0: 0.501348}
    for t, E in table.items():
        assert bar(ONCE, t).pull == pytest.approx(E, abs=6e-7)


def test_creep_and_its_poles() -> None:
    table = {0.0: 1.0, 1.0: 1.239880, 5.0: 1.560232, 10.0: 1.698406, 50.0: 1.982020}
    for t, J in table.items():
        assert bar(ONCE, t, True).strain_at(t) == pytest.approx(J, abs=6e-7)
    assert sorted(bar(ONCE, 0.0, True)._creep_function_terms[0]) == pytest.approx([-0.709531, -0.070469], abs=6e-7)


def test_creep_of_one_term_and_maxwells_relaxation() -> None:
    table = {0.0: 1.0, 0.5: 1.221199, 1.0: 1.393469, 2.0: 1.632121, 5.0: 1.917915, 20.0: 1.999955}
    for t, J in table.items():
        assert bar(ONCE, t, True, (0.5,), (1.0,)).strain_at(t) == pytest.approx(J, abs=6e-7)
    for t, E in {1.0: 0.367879, 3.0: 0.049787}.items():
        assert bar(ONCE, t, False, (1.0,), (1.0,)).pull == pytest.approx(E, abs=6e-7)


@pytest.mark.parametrize(
    ("w", "storage", "loss", "tangent"),
    [
        (0.01, 0.502010, 0.022802, 0.045421),
        (0.1, 0.602970, 0.129703, 0.215107),
        (1.0, 0.848020, 0.169802, 0.200234),
        (10.0, 0.997010, 0.031703, 0.031798),
    ],
)
def test_dynamic_moduli(w: float, storage: float, loss: float, tangent: float) -> None:
    """Of sin(w t) after 40 times the longest tau: E' in phase, E'' a quarter of a swing ahead; a cycle loses pi E''."""
    cycle = 2.0 * math.pi / w
    begin = math.ceil(400.0 / cycle) * cycle
    driven = Amplitude([], [HarmonicAmplitudeSegment(0.0, begin + 2.0 * cycle, w, w)])
    in_phase, ahead = bar(driven, begin + 0.25 * cycle).pull, bar(driven, begin).pull
    assert in_phase == pytest.approx(storage, abs=6e-7)
    assert ahead == pytest.approx(loss, abs=6e-7)
    assert ahead / in_phase == pytest.approx(tangent, abs=1.2e-6)
    if w >= 1.0:
        return  # its many swings are integrated quarter by quarter
    lost = bar(driven, begin + cycle).dissipated - bar(driven, begin).dissipated
    assert lost == pytest.approx(math.pi * loss, rel=1e-4)
