"""Checks of names of models given on the command line or in Python."""

from __future__ import annotations

from collections.abc import Sequence

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.grammar.name_suggestions import nearest
from softmark.grammar.tree import Span
from softmark.interpreter.language.compiled_scene import Scene


def unknown_models(scene: Scene, only: tuple[str, ...]) -> list[Diagnostic]:
    """Return errors for names given with --model that are not models."""
    models, found = list(scene.of_kind("model")), []
    for name in only:
        if name not in models:
            close = nearest(name, models)
            hint = f"did you mean `{close}`?" if close else "models: " + (", ".join(models) or "none")
            message = f"`{name}` is not a model of the scene"
            found.append(at_name("--model", name, "E201", message, "not found", hint))
    return found


def needed_models(scene: Scene, only: Sequence[str]) -> tuple[str, ...]:
    """Return the requested models, and all models that these or references depend on.

    The result is () if no model is requested or a requested name is unknown.
    """
    models = scene.of_kind("model")
    if not only or any(name not in models for name in only):
        return ()
    from softmark.interpreter.planning.declaration_dependencies import with_dependencies

    found = with_dependencies(scene, [*only, *scene.of_kind("reference")])
    return tuple(n for n in models if n in found)


def at_name(option: str, name: str, code: str, message: str, label: str, help: str) -> Diagnostic:
    """Return a diagnostic that points to a name after a command line option."""
    span = Span(0, len(name), 1, 1, 1, 1 + len(name))
    return Diagnostic(code, message, Source(f"{option} {name}", name), span, label, help)


def without_unrequested_warnings(
    scene: Scene | None, only: tuple[str, ...], found: list[Diagnostic]
) -> list[Diagnostic]:
    """Return the diagnostics without warnings about models that were not requested."""
    if scene is None or not only:
        return found
    others = [d.location for n, d in scene.of_kind("model").items() if n not in only]

    def elsewhere(d: Diagnostic) -> bool:
        return d.severity == "warning" and any(
            d.span and at.source is d.source and at.span.start <= d.span.start < at.span.end for at in others
        )

    return [d for d in found if not elsewhere(d)]
