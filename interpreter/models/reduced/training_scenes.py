"""Scenes that a reduced model is trained on: the scene itself, or the scene with every value of a sweep."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import field
from typing import TYPE_CHECKING, Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiler import recompile
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.planning import sweep_expansion
from softmark.interpreter.problem.body_case import Fault, case_for
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared, Scene

UNMESHED = ("load", "analysis", "material", "metric", "probe")  # kinds of declarations on which no mesh depends


@dataclass(frozen=True)
class Setting:
    """One scene of the sweep: the scene, its description, and its values by target of the sweep."""

    words: str
    scene: Scene
    values: dict[str, Any] = field(default_factory=dict)


def scenes(over: str | None, scene: Scene) -> Iterator[Setting]:
    """Yield the scene with each value of the sweep, or the scene itself if no sweep is named."""
    if over is None:
        yield Setting("", scene)
        return
    links = sweep_expansion.combined_sweeps(scene, scene.declared[over])
    for chosen in itertools.product(*(link.thing.over for link in links)):
        pairs = [(link.thing, variant) for link, variant in zip(links, chosen, strict=True)]
        other, _ = recompile(scene, [sweep_expansion.override_of(sweep, variant) for sweep, variant in pairs])
        words = "".join(f", {sweep.target.name} = {variant.text}" for sweep, variant in pairs)
        names = [sweep.target.name for sweep, _ in pairs]
        yield Setting(words, other, {name: sweep_expansion.value_of(other, name) for name in names})


def check_same_mesh(scene: Scene, declared: Declared) -> Diagnostic | None:
    """Return an error if the sweep varies the mesh of the reduced model. The check generates no mesh."""
    model = declared.thing
    if model.over is None:
        return None
    own = _mesh(scene, model.of)
    for link in sweep_expansion.combined_sweeps(scene, scene.declared[model.over]):
        owner = link.thing.target.name.rpartition(".")[0]
        if owner in scene.declared and scene.declared[owner].kind in UNMESHED:
            continue
        overrides = [sweep_expansion.override_of(link.thing, variant) for variant in link.thing.over]
        if scene.varied and {override.text for override in overrides}.issuperset(scene.varied):
            continue  # one of the scenes that were compared where the sweep was looked at, and nothing else is varied
        for override in overrides:
            other = _mesh(recompile(scene, [override])[0], model.of)
            if None not in (own, other) and own != other:
                at, problem = declared.at("over"), f"`{model.over}` varies the mesh of `{model.of}`"
                help = (
                    "use a sweep of a load, a displacement or a material: the basis of one mesh cannot be "
                    "used on another"
                )
                return diagnostic("E532", at, problem, "changes the mesh", help)
    return None


def _mesh(scene: Scene, model: str) -> tuple[Any, ...] | None:
    """Return the values that determine the mesh of a model; None if a value of the sweep is invalid."""
    full = scene.declared.get(model)
    if full is None:
        return None
    try:
        case = case_for(scene, full)
    except Fault:
        return None
    return case.shape, full.thing.meshed_as(case)
