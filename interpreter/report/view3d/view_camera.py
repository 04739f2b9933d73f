"""Initial camera view: gravity points down on the screen, and the bending plane lies in the picture plane."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.view3d.compact_surfaces import Floats
from softmark.interpreter.report.view3d.still_picture import CameraView, frame_of
from softmark.interpreter.results.run_report import DrawnSurface
from softmark.interpreter.vocabulary import BODIES

TURN, TILT = 26.0, 16.0  # degrees
LETTERS = "xyz"
PLANE = frozenset(word for word, body in BODIES.items() if body.planar)  # bodies in the x-y plane


def view_of(findings: ReportSummary, shapes: Iterable[DrawnSurface]) -> CameraView:
    """Return the initial camera view.

    The longer horizontal direction points from left to right, and plane bodies lie in the picture plane.
    """
    names = findings.report.names
    if (own := names.of_kind("body")) and all(names.declared[name].word in PLANE for name in own):
        return CameraView(0.0, 90.0, np.eye(3))
    frame = frame_of(upward(findings))
    every = np.concatenate([s.position for s in shapes]) @ frame.T
    across, deep, _ = np.ptp(every, axis=0)
    return CameraView(TURN if across >= deep else 90.0 - TURN, TILT, frame)


def letters(view: CameraView) -> str:
    """Return the letters of the horizontal axes and of the upward axis, such as `xyz` or `zxy`."""
    return "".join(LETTERS[int(np.abs(row).argmax())] for row in view.frame)


def upward(findings: ReportSummary) -> Floats:
    """Return the unit vector (3,) against gravity, or along z without gravity."""
    return 0.0 - np.array(
        findings.report.names.down
    )  # subtracted from 0, because the negative of a zero would be shown as -0
