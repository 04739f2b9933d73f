"""Asking the models of a run what errors they state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from softmark.interpreter.evidence.error_estimate import stated


def state(work: Any, asked: Sequence[str], free: bool) -> None:
    """Have models of a run state the error of their answers: at a cost those `asked`, at none the others if `free`."""
    for name, result in list(work.models.items()):
        if name not in asked and not free:
            continue
        work.options.say("state", f"the error of {name}")
        declared, prepared, view = work.scene.declared[name], work.prepared[name][0], work.views[name]
        known = work.measured, work.warnings
        said = stated(work.scene, declared, view, prepared, result, *known, name in asked)
        work.models[name] = replace(result, stated=said)
