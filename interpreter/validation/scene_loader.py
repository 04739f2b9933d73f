"""Loader that converts the text of a scene to a scene that can be run, and to its diagnostics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.interpreter.language.compiled_scene import Scene
from softmark.interpreter.validation.constructor_registry import compile_source
from softmark.interpreter.validation.requested_names import needed_models
from softmark.interpreter.validation.scene_checks import check


def load_scene(
    source: Source,
    folder: Path,
    file: Path | None,
    overrides: Sequence[str] = (),
    only: Sequence[str] = (),
    plugins: Sequence[str] = (),
) -> tuple[Scene | None, list[Diagnostic]]:
    """Return the scene, or None if it has errors, and all diagnostics.

    `only` are the requested models. Errors of other models are then ignored, except for models that these depend on.
    `plugins` are files, or names of installed plugins, whose words the scene may use.
    """
    scene, diagnostics = compile_source(source, folder, file, overrides, plugins)
    return check_scene(scene, diagnostics, only)


def check_scene(
    scene: Scene, diagnostics: list[Diagnostic], only: Sequence[str] = ()
) -> tuple[Scene | None, list[Diagnostic]]:
    """Return the checked scene, or None if it has errors, and its diagnostics, added to the given list."""
    scene = replace(scene, chosen=needed_models(scene, only))
    complete = not any(d.severity == "error" for d in diagnostics)
    diagnostics += check(scene, complete)
    if scene.of_kind("study") and not any(d.severity == "error" for d in diagnostics):
        from softmark.interpreter.validation import sweep_checks

        diagnostics += dict.fromkeys(sweep_checks.check(scene))
    return (None if any(d.severity == "error" for d in diagnostics) else scene), diagnostics
