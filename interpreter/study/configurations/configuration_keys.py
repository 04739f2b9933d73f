"""Keys of results: a key is a digest of everything that a result depends on, so equal keys mean equal results.

A key covers softmark's sources, the model, all declarations that can affect its result, the contents of files, and the
versions of external programs. It excludes names of parameters, texts of expressions, expectations and published values.
Studies count only if a model is made from one. The whole text of the scene then counts, since a sweep changes the
scene.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Collection
from dataclasses import replace
from typing import Any

from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.models.external.external_program import ExternalModel
from softmark.interpreter.planning.declaration_dependencies import models_of, with_dependencies
from softmark.interpreter.study.configurations import source_digests

SPEAKING = ("study", "published")  # kinds that cannot affect a model's result
KEPT = 32  # maximum number of cached references


def key_of(scene: Scene, model: str) -> str:
    """Return the key of a model's result, the SHA-256 of everything that decides it."""
    whole = with_dependencies(scene, needed_models(scene, model))
    h = hashlib.sha256(f"{source_digests.digest_sources()}\0{model}\0".encode())
    for declared in scene.declared.values():
        if declared.name in whole or declared.kind not in (*SPEAKING, "model"):
            h.update(declaration_text(declared).encode())
    h.update(_refined_model_texts(scene, whole).encode())
    if any(scene.declared[name].kind == "study" for name in whole):
        h.update(_text(scene).encode())
    return h.hexdigest()


def non_study_texts(scene: Scene) -> list[str]:
    """Return all declarations except studies as text, including models that only references refine."""
    return [declaration_text(declared) for declared in scene.declared.values() if declared.kind != "study"]


def invalid_scene_key(scene: Scene, model: str) -> str:
    """Return the key of a model in an invalid scene, the SHA-256 of its text and its overrides."""
    parts = (source_digests.digest_sources(), model, scene.source.text, *scene.overrides)
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def key_of_reference(scene: Scene, reference: Declared) -> str:
    """Return the key of a reference's result, the SHA-256 of everything that decides it.

    Models are included only if references refine them.
    """
    h = hashlib.sha256(f"{source_digests.digest_sources()}\0{reference.name}\0".encode())
    for declared in scene.declared.values():
        if declared.kind not in (*SPEAKING, "model", "metric"):
            h.update(declaration_text(declared).encode())
    h.update(_refined_model_texts(scene, ()).encode())
    return h.hexdigest()


def _text(scene: Scene) -> str:
    values = (f"{name} = {p.value!r}" for name, p in scene.parameters.items())
    return "\0".join((scene.source.text, *scene.overrides, *values))


def _refined_model_texts(scene: Scene, whole: Collection[str]) -> str:
    """Return the models that references refine as text, without their mesh size where the reference chooses it.

    Models in `whole` are left out.
    """
    refined = [n for n in _refined_models(scene) if n not in whole]
    behind = [n for n in with_dependencies(scene, refined) if n not in (*refined, *whole)]
    own = [declaration_text(_without_mesh_size(scene.declared[n])) for n in refined]
    return "".join((*own, *(declaration_text(scene.declared[n]) for n in behind)))


def declaration_text(declared: Declared) -> str:
    """Return a declaration as text.

    Names of files are replaced by digests of their contents. The digests of its plugin and external program are added.
    """
    text = repr(declared.thing)
    for file in sorted(set(source_digests.files_of(declared.thing)), key=len, reverse=True):
        text = text.replace(repr(file), source_digests.digest_file(file))
    whose = source_digests.digest_plugins(declared.thing)
    if isinstance(declared.thing, ExternalModel):
        whose += source_digests.digest_program(declared.thing.program)
    return f"{declared.kind} {declared.name} {declared.constructor.name} {text}{whose}\0"


# ------------------------------------------------------------------ models needed by metrics and references


def needed_models(scene: Scene, model: str) -> tuple[str, ...]:
    """Return a model and the models that metrics and references compare it with, in the order of the scene."""
    needed = {model}
    for declared in scene.declared.values():
        if declared.kind not in (*SPEAKING, "model"):
            needed.update(models_of(scene, declared, "name"))
    return tuple(n for n in scene.declared if n in needed)


def _refined_models(scene: Scene) -> list[str]:
    """Return the names of the models that references solve again on finer meshes, to use as their own solutions.

    These are models that a reference lists by name.
    """
    found: dict[str, None] = {}
    for reference in scene.of_kind("reference").values():
        found.update(dict.fromkeys(models_of(scene, reference, "names")))
    return list(found)


def _without_mesh_size(model: Declared) -> Declared:
    """Return a model without its mesh size, which a reference chooses when it refines the model."""
    if "size" not in model.thing.resolution_fields:
        return model
    return replace(model, thing=replace(model.thing, size=None))


# ------------------------------------------------------------------ cached references


_REMEMBERED: dict[str, Any] = {}


def cached_reference(scene: Scene, reference: Declared, make: Callable[[], Any]) -> Any:
    """Return the result of a reference, computed by `make` at its first use in this process.

    Configurations with equal references share it.
    """
    key = key_of_reference(scene, reference)
    if key not in _REMEMBERED:
        while len(_REMEMBERED) >= KEPT:
            del _REMEMBERED[next(iter(_REMEMBERED))]
        _REMEMBERED[key] = make()
    return _REMEMBERED[key]
