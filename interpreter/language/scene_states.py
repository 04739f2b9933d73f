"""Scene in one of the states of its analysis, as an ordinary scene with a single state.

Objects that differ between states provide `in_state(number, value)`: the analysis, loads, supports, references.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from softmark.interpreter.language.compiled_scene import Declared, Scene

SAME = 1e-9  # relative difference below which state values are equal, though written in other units


def states_of(scene: Scene) -> tuple[float, ...]:
    """Return the values of the states of the analysis; empty for a single state, or if a state was already selected."""
    for analysis in scene.of_kind("analysis").values():
        if (known := analysis.thing.situations) is not None:
            return tuple(known)
    return ()


def find_state_indices(states: Sequence[float], value: float) -> list[int]:
    """Return the indices from 0 of the states with a value: none, one, or several if the value occurs again."""
    return [i for i, state in enumerate(states) if abs(state - value) <= SAME * max(abs(state), abs(value))]


def in_state(scene: Scene, number: int) -> Scene:
    """Return the scene in the state with an index from 0; cached."""
    key = in_state, number
    if key not in scene.known:
        value = states_of(scene)[number]
        declared = {name: _declaration_in_state(d, number, value) for name, d in scene.declared.items()}
        scene.known[key] = replace(scene, declared=declared, state=number)
    found: Scene = scene.known[key]
    return found


def in_last_state(scene: Scene) -> Scene:
    """Return the scene in its last state, which studies report; the scene itself if it has no states."""
    states = states_of(scene)
    return in_state(scene, len(states) - 1) if states else scene


def find_time_dependent(scene: Scene) -> list[Declared]:
    """Return the declarations that may have a time history (`amplitude`): loads, supports and active materials."""
    driven = [d for kind in ("load", "support") for d in scene.of_kind(kind).values()]
    return [*driven, *(m for m in scene.of_kind("material").values() if hasattr(m.thing, "amplitude"))]


def _declaration_in_state(declared: Declared, number: int, value: float) -> Declared:
    changes = getattr(declared.thing, "in_state", None)
    return declared if changes is None else replace(declared, thing=changes(number, value))
