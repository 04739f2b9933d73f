"""The Truth Cube: the errors of the report against the same errors from the table of bead positions itself.

Positions are read here by the csv module and arithmetic of the standard library alone: -z is up in the file (z of the
scene is minus z of the file), the layers are k = 1 (bottom) to 7, and the 5 x 49 beads between the outermost layers are
judged (REFERENCES, section 2.1).
"""

from __future__ import annotations

import csv
import math
import statistics
from collections.abc import Callable

import numpy as np
import pytest

import softmark
from softmark.references.data_download import find_local

STATES = {5: 1, 12: 2, 18: 3}
LAWS = ("linear", "corot", "finite")
# mean motion of the bead layers k = 1 and 7 towards the bottom and top plates, mm (REFERENCES, section 2.1)
LAYERS = {5: (0.32, 4.34), 12: (0.90, 10.16), 18: (1.47, 15.02)}

Bead = tuple[int, tuple[float, float, float], tuple[float, float, float]]


@pytest.fixture(scope="module")
def report(report_of: Callable[[str], softmark.Report]) -> softmark.Report:
    return report_of("truth-cube")


def beads(state: int) -> list[Bead]:
    """Layer k, position at rest and displacement, mm in the scene's frame, of every bead."""
    file = find_local("truth-cube/truthcube_uniaxial_positions.csv")
    assert file is not None
    with file.open(encoding="utf-8") as lines:
        rows = [row for row in csv.reader(lines) if row[0].isdecimal()]
    found = []
    for row in rows:
        rest = [float(v) for v in row[3:6]]
        now = [float(v) for v in row[3 + 3 * state : 6 + 3 * state]]
        dx, dy, dz = (b - a for a, b in zip(rest, now, strict=True))
        # the scene's z axis is minus the file's, x stays: then y turns as well, or the frame would be left-handed
        found.append((int(row[2]), (rest[0], -rest[1], -rest[2]), (dx, -dy, -dz)))
    return found


@pytest.mark.parametrize("state", STATES)
def test_the_table_is_the_one_that_was_digested(report: softmark.Report, state: int) -> None:
    for k, mean in zip((1, 7), LAYERS[state], strict=True):
        layer = [u[2] for layer, _, u in beads(STATES[state]) if layer == k]
        assert len(layer) == 49
        assert -statistics.fmean(layer) == pytest.approx(mean, abs=0.006)  # as printed, two decimals


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("state", STATES)
def test_errors_are_those_of_the_table(report: softmark.Report, state: int, law: str) -> None:
    model = report.models[law].each[STATES[state] - 1]
    computed = {tuple(np.round(1e3 * X, 6)): 1e3 * u for X, u in _pairs(model.probes["inside"])}
    inner = [(X, u) for k, X, u in beads(STATES[state]) if 2 <= k <= 6]
    assert len(computed) == len(inner) == 245
    errors = [math.dist(computed[tuple(round(c, 6) for c in X)], u) for X, u in inner]
    # the same arithmetic in another order: rounding alone
    assert model.metrics["error"].value == pytest.approx(1e-3 * statistics.fmean(errors), rel=1e-9)
    assert model.metrics["worst"].value == pytest.approx(1e-3 * max(errors), rel=1e-9)


def _pairs(probe: softmark.ProbeResult) -> list[tuple[np.ndarray, np.ndarray]]:
    return list(zip(probe.points, probe.displacement, strict=True))


@pytest.mark.parametrize("state", STATES)
def test_the_outermost_layers_move_as_they_were_seen_to(report: softmark.Report, state: int) -> None:
    """Between the measured layers the stretch is theirs: the inner beads' mean motion lies within that of layers."""
    model = report.models["finite"].each[STATES[state] - 1]
    u = 1e3 * model.probes["inside"].displacement[:, 2]
    low, high = LAYERS[state]
    assert -high < u.min() < u.max() < -low + 0.6  # a layer is not flat: its beads differ by up to 0.6 mm


def test_what_the_beads_can_tell(report: softmark.Report) -> None:
    """Each metric carries the uncertainty of the positions, 0.3 mm, and says whether it means more than that."""
    data = report.to_json()["models"]
    for law in LAWS:
        for state in STATES:
            metric = data[law]["states"][STATES[state] - 1]["metrics"]["error"]
            assert metric["uncertainty"] == pytest.approx(0.3e-3)
            assert metric["meaningful"] == (metric["value"] > 0.3e-3)
    assert not data["finite"]["states"][0]["metrics"]["error"]["meaningful"]
    assert data["linear"]["metrics"]["error"]["meaningful"]  # of the last state


# metres, of three cubes that were solved each for itself from rest, before one cube could have states
ALONE = {
    "linear": {"error": (2.960800263648e-4, 4.635619282878e-4, 8.697084677464e-4),
               "worst": (9.042882911056e-4, 1.181177113130e-3, 1.992278472774e-3)},
    "corot": {"error": (2.967308392751e-4, 4.681227555524e-4, 8.779890295622e-4),
              "worst": (9.027522572138e-4, 1.183371930033e-3, 1.963705554355e-3)},
    "finite": {"error": (2.866244868853e-4, 3.180900999175e-4, 3.499219141799e-4),
               "worst": (8.292199399966e-4, 9.310215092086e-4, 9.805305661947e-4)},
}  # fmt: skip


@pytest.mark.parametrize("law", LAWS)
def test_a_state_that_starts_from_the_one_before_ends_where_it_would_from_rest(
    report: softmark.Report, law: str
) -> None:
    """To the tolerance of 1e-8 of the forces: a thousandth of it was seen."""
    for metric, values in ALONE[law].items():
        assert report.models[law].curve(metric).states == (0.05, 0.125, 0.1825)
        assert report.models[law].curve(metric).values == pytest.approx(values, rel=1e-9)
    assert all(own.solve["started"] for own in report.models[law].each[1:])


def test_references_say_what_they_are(report: softmark.Report) -> None:
    for reference in (report.references["beads"], *report.references["beads"].each):
        assert reference.kind == "measurement"
        assert "Kerdok" in reference.source
        assert reference.estimated_error == pytest.approx(0.3e-3)
