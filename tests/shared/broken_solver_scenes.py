"""Scenes of solvers that are broken on purpose: what a run reports against its one model."""

from __future__ import annotations

import functools

import softmark

HEAD = 'softmark 1\nscene "broken"\n'


def said_of(text: str) -> str:
    """Return what a run reports against its one model; empty where it accepts the answer."""
    report = softmark.loads(HEAD + text).run()
    (model,) = report.models.values()
    if model.status != "converged":
        return f"{model.status}: {model.message}"
    return next((f"W353: {w.message}" for w in report.warnings if w.code == "W353"), "")


@functools.cache
def must_be_right(text: str) -> None:
    """Run the scene with nothing broken, so that only the break can be caught later."""
    assert said_of(text) == ""
