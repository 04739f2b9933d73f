"""Names that come from the command line or from Python rather than from a scene."""

from __future__ import annotations

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.grammar.suggest import nearest
from softmark.grammar.tree import Span
from softmark.interpreter.scene import Scene


def unknown_models(scene: Scene, only: tuple[str, ...]) -> list[Diagnostic]:
    """Errors for names given with --model that are not models."""
    models, found = list(scene.of_kind("model")), []
    for name in only:
        if name not in models:
            close = nearest(name, models)
            hint = f"did you mean `{close}`?" if close else "models: " + (", ".join(models) or "none")
            span = Span(0, len(name), 1, 1, 1, 1 + len(name))
            found.append(
                Diagnostic(
                    "E201",
                    f"`{name}` is not a model of the scene",
                    Source(f"--model {name}", name),
                    span,
                    "not found",
                    hint,
                )
            )
    return found


def concerning(scene: Scene | None, only: tuple[str, ...], found: list[Diagnostic]) -> list[Diagnostic]:
    """The diagnostics without warnings about models that were not chosen."""
    if scene is None or not only:
        return found
    others = [d.location for n, d in scene.of_kind("model").items() if n not in only]

    def elsewhere(d: Diagnostic) -> bool:
        return d.severity == "warning" and any(
            d.span and at.source is d.source and at.span.start <= d.span.start < at.span.end for at in others
        )

    return [d for d in found if not elsewhere(d)]
