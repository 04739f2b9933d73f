"""Sweeps carried out: which are combined, what puts one value in its place, and which number it is there."""

from __future__ import annotations

from typing import Any

from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.expression_evaluation import Place, Quantity
from softmark.interpreter.language.parameter_overrides import Override
from softmark.interpreter.language.sweep_values import Variant
from softmark.interpreter.vocabulary.study_words import Sweep


def override_of(sweep: Sweep, variant: Variant) -> Override:
    """The override that puts one value of a sweep in its place."""
    place = Place(variant.at.source, [])
    return Override(sweep.target.name, variant.node, place, sweep.target.span, written="sweep({}, over = [...])",
                    text=f"{sweep.target.name}={variant.text}")  # fmt: skip


def chain(scene: Scene, sweep: Declared) -> list[Declared]:
    """A sweep and those that it is combined with, outermost first. Stops at what is no sweep."""
    found = [sweep]
    while isinstance(last := found[-1].thing, Sweep) and last.with_ is not None:
        found.append(scene.declared[last.with_])
    return found


def value_of(scene: Scene, name: str) -> float | list[Any] | str | None:
    """What a parameter or a field is in a scene: a number or a list of numbers, SI, or a text; None where it is not."""
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
    """The number, SI, that a parameter or a field has in a scene; None where it is none."""
    found = value_of(scene, name)
    return None if isinstance(found, str | list) else found
