"""Friction: whose path is one step long, and what is asked of it where there is none."""

from __future__ import annotations

from collections.abc import Iterator

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.messages import diagnostic
from softmark.interpreter.language.scene import Scene
from softmark.interpreter.language.states import states_of
from softmark.interpreter.metrics.slip import OfFriction
from softmark.interpreter.vocabulary.analyses import Dynamic


def faults(scene: Scene) -> Iterator[Diagnostic]:
    """Errors for what is asked of friction that is not there, and warnings where all the load comes in one step."""
    yield from _without(scene)
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


def _without(scene: Scene) -> Iterator[Diagnostic]:
    for metric in scene.of_kind("metric").values():
        contact = scene.declared[metric.thing.of] if isinstance(metric.thing, OfFriction) else None
        if contact is not None and not getattr(contact.thing, "friction", 0.0):
            yield diagnostic(
                "E662",
                metric.at("of"),
                f"`{metric.name}` asks how `{contact.name}` slips, which has no friction",
                "nothing sticks there",
                f"`{contact.name}` slides freely: give it a `friction`, or ask for its `force`, its area or its gap"
                if hasattr(contact.thing, "friction") else
                f"`{contact.name}` is `{contact.constructor.name}`, which knows none: ask for its `force`",
            )  # fmt: skip
