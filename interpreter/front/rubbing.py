"""Friction, whose path is one step long."""

from __future__ import annotations

from collections.abc import Iterator

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.messages import diagnostic
from softmark.interpreter.language.scene import Scene
from softmark.interpreter.language.states import states_of
from softmark.interpreter.vocabulary.analyses import Dynamic


def faults(scene: Scene) -> Iterator[Diagnostic]:
    """Of scenes with friction: a warning where all the load comes in one step."""
    rubbing = [c for c in scene.of_kind("contact").values() if getattr(c.thing, "friction", 0.0)]
    motion = any(isinstance(analysis.thing, Dynamic) for analysis in scene.of_kind("analysis").values())
    if not rubbing or motion or scene.state is not None or states_of(scene):
        return
    yield diagnostic(
        "W670",
        rubbing[0].at("friction"),
        f"`{rubbing[0].name}` has friction, and all the load comes in one step",
        "slip along a straight line",
        "what slides depends on the way there: follow it, `static(states = [25, 50, 75, 100] %)`, and compare with "
        "twice as many",
    )
