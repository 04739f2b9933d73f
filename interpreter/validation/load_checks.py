"""Checks of loads that need only the scene: the analysis they act in, and other loads of the same body."""

from __future__ import annotations

from collections.abc import Iterator

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.vocabulary.analysis_words import Dynamic


def check_loads(scene: Scene, found: list[Diagnostic]) -> Iterator[Diagnostic]:
    """Yield errors of loads that are not available in dynamics, or of which a body can have only one."""
    moving = any(isinstance(analysis.thing, Dynamic) for analysis in scene.of_kind("analysis").values())
    bodies = set()
    for load in scene.of_kind("load").values():
        action, body = load.thing.action, load.value("body")
        if moving and action.in_dynamics:
            yield diagnostic("E501", load.at(), f"`{load.name}` is not available in a dynamic analysis",
                             action.in_dynamics, "use `static()` or `quasistatic(...)`")  # fmt: skip
        if action.exclusive and (body, type(action)) in bodies:
            yield diagnostic("E501", load.at(),
                             f"`{load.name}` is the second load `{load.constructor.name}` of `{body}`",
                             "only one is allowed", "remove one of the two: a body rotates about one axis")  # fmt: skip
        bodies.add((body, type(action)))
