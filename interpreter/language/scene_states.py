"""A scene in one of the states of its analysis: an ordinary scene, in which nothing knows of states any more.

What is different from state to state says how by `in_state(number, value)`: the analysis, loads, supports, references.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from softmark.interpreter.language.compiled_scene import Declared, Scene

SAME = 1e-9  # relative: values of states that are nearer are one, written in other units


def states_of(scene: Scene) -> tuple[float, ...]:
    """The values of the states of its analysis; none of a scene in one situation, or in one of its states."""
    for analysis in scene.of_kind("analysis").values():
        if (known := analysis.thing.situations) is not None:
            return tuple(known)
    return ()


def numbers_of(states: Sequence[float], value: float) -> list[int]:
    """Which states have a value, counted from 0: none, one, or several of a sequence that comes back to it."""
    return [i for i, state in enumerate(states) if abs(state - value) <= SAME * max(abs(state), abs(value))]


def in_state(scene: Scene, number: int) -> Scene:
    """The scene in one of its states, counted from 0; made once."""
    key = in_state, number
    if key not in scene.known:
        value = states_of(scene)[number]
        declared = {name: _in_state(d, number, value) for name, d in scene.declared.items()}
        scene.known[key] = replace(scene, declared=declared, state=number)
    found: Scene = scene.known[key]
    return found


def in_last(scene: Scene) -> Scene:
    """The scene in the last of its states, of which studies tell; itself without any."""
    states = states_of(scene)
    return in_state(scene, len(states) - 1) if states else scene


def acting(scene: Scene) -> list[Declared]:
    """What may follow a course: loads, supports, and materials that pull."""
    driven = [d for kind in ("load", "support") for d in scene.of_kind(kind).values()]
    return [*driven, *(m for m in scene.of_kind("material").values() if hasattr(m.thing, "course"))]


def _in_state(declared: Declared, number: int, value: float) -> Declared:
    changes = getattr(declared.thing, "in_state", None)
    return declared if changes is None else replace(declared, thing=changes(number, value))
