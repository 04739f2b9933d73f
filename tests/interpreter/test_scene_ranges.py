"""Scenes whose parameters have a range: what they expect holds at its ends, too."""

from __future__ import annotations

import pytest

import softmark

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("scene", "given"),
    [
        ("rubber-vessels", {"fat": "1.8"}),  # its pressures were those of a ball twice as wide as its hole
        ("rubber-vessels", {"fat": "3"}),
        ("rubber-vessels", {"nu": "0"}),  # where nothing locks
        ("line-of-force", {"h": "14 mm"}),  # it met its bar on one mesh, and missed it on finer ones
        ("line-of-force", {"h": "10 mm"}),
    ],
)
def test_expectations_hold_over_the_ranges_of_parameters(scene: str, given: dict[str, str]) -> None:
    report = softmark.load(scene, **given).run()
    assert [e.text for e in report.expectations if e.passed is not True] == []
