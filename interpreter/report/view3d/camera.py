"""From where shapes are seen at first: gravity points down on the screen, and the bend lies in the picture."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from softmark.grammar import tree
from softmark.interpreter.report.run.findings import Findings
from softmark.interpreter.report.view3d.still import CameraView, frame_of
from softmark.interpreter.report.view3d.surfaces import Floats
from softmark.interpreter.results.report import SeenSurface

TURN, TILT = 26.0, 16.0  # degrees
LETTERS = "xyz"


def view_of(findings: Findings, shapes: Iterable[SeenSurface]) -> CameraView:
    """The first view: the longer level direction runs from left to right."""
    frame = frame_of(upward(findings))
    every = np.concatenate([s.position for s in shapes]) @ frame.T
    across, deep, _ = np.ptp(every, axis=0)
    return CameraView(TURN if across >= deep else 90.0 - TURN, TILT, frame)


def letters(view: CameraView) -> str:
    """The names of the level directions and of the upward one: `xyz`, `zxy`."""
    return "".join(LETTERS[int(np.abs(row).argmax())] for row in view.frame)


def upward(findings: Findings) -> Floats:
    """The direction (3,) against gravity as the scene's text has it; z where there is no gravity."""
    for declared in findings.declared.values():
        call = declared.value
        if not isinstance(call, tree.Call) or call.function.text != "gravity":
            continue
        for argument in call.arguments:
            down = _direction(argument.value)
            if down is not None:
                return -down
    return np.array([0.0, 0.0, 1.0])


def _direction(value: object) -> Floats | None:
    """`-z` or `(0, -1, 0)` as a vector; None for what is neither."""
    if isinstance(value, tree.Vector) and len(value.items) == 3:
        known = np.array([_number(item) for item in value.items])
        return known if np.isfinite(known).all() and known.any() else None
    sign = 1.0
    if isinstance(value, tree.Unary) and value.operator in ("-", "+"):
        sign, value = (-1.0 if value.operator == "-" else 1.0), value.operand
    if isinstance(value, tree.Name) and value.text in LETTERS and len(value.text) == 1:
        along: Floats = sign * np.eye(3)[LETTERS.index(value.text)]
        return along
    return None


def _number(value: object) -> float:
    if isinstance(value, tree.Unary) and value.operator == "-":
        return -_number(value.operand)
    return float(value.value) if isinstance(value, tree.Number) else np.nan
