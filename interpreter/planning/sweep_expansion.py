"""Expansion of sweeps: combined sweeps, the override that sets each value, and the value of a field in a scene."""

from __future__ import annotations

from typing import Any

from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.expression_evaluation import Quantity, SourceErrors
from softmark.interpreter.language.parameter_overrides import Override
from softmark.interpreter.language.sweep_values import Variant
from softmark.interpreter.vocabulary.study_words import Sweep


def override_of(sweep: Sweep, variant: Variant) -> Override:
    """Return the override that sets the swept parameter or field to one value of the sweep."""
    place = SourceErrors(variant.at.source, [])
    return Override(sweep.target.name, variant.node, place, sweep.target.span, written="sweep({}, over = [...])",
                    text=f"{sweep.target.name}={variant.text}")  # fmt: skip


def combined_sweeps(scene: Scene, sweep: Declared) -> list[Declared]:
    """Return a sweep and the sweeps that it is combined with, outermost first.

    The list ends before the first name that is not a sweep.
    """
    found = [sweep]
    while isinstance(last := found[-1].thing, Sweep) and last.with_ is not None:
        found.append(scene.declared[last.with_])
    return found


def value_of(scene: Scene, name: str) -> float | list[Any] | str | None:
    """Return the value of a parameter or field: one or several numbers in SI, or a text; None without a value."""
    if name in scene.parameters:
        value = scene.parameters[name].value
        return value.value if isinstance(value, Quantity) else list(value.values)
    owner, _, attribute = name.rpartition(".")
    declared = scene.declared.get(owner)
    found = declared.value(attribute) if declared else None
    if found is None:
        return None
    if isinstance(found, int | float) and not isinstance(found, bool):
        return float(found)
    return list(found) if isinstance(found, tuple) else str(found)


def value_in(scene: Scene, name: str) -> float | None:
    """Return the number in SI of a parameter or field; None if its value is not a number."""
    found = value_of(scene, name)
    return None if isinstance(found, str | list) else found
