"""Dependencies between declarations: the models and studies that the declaration of a model names."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from softmark.interpreter.language.compiled_scene import Declared, Scene


def with_dependencies(scene: Scene, models: Collection[str]) -> list[str]:
    """Return the given models and all models and studies that they depend on, directly or indirectly."""
    found, pending = dict.fromkeys(models), list(models)
    while pending:
        declared = scene.declared[pending.pop()]
        for name in (
            *find_named_declarations(scene, declared, "name"),
            *find_named_declarations(scene, declared, "names"),
        ):
            if name not in found and scene.declared[name].kind in ("model", "study"):
                found[name] = None
                pending.append(name)
    return list(found)


def models_of(scene: Scene, declared: Declared, form: str) -> Iterator[str]:
    """Yield the models that a declaration names in its fields of one form, `name` or `names`."""
    yield from (n for n in find_named_declarations(scene, declared, form) if scene.declared[n].kind == "model")


def find_named_declarations(scene: Scene, declared: Declared, form: str) -> Iterator[str]:
    """Yield the declarations that a declaration names in its fields of one form, `name` or `names`."""
    for field in declared.constructor.fields:
        if field.form == form:
            value = declared.value(field.name)
            names = (value,) if form == "name" else value
            yield from (n for n in names or () if n in scene.declared)
