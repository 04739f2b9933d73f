"""What contacts cannot be in a motion: explicit steps, which find out too late."""

from __future__ import annotations

from collections.abc import Iterator

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.messages import diagnostic
from softmark.interpreter.language.scene import Scene
from softmark.interpreter.vocabulary.analyses import Dynamic


def faults(scene: Scene) -> Iterator[Diagnostic]:
    """Of scenes with contacts whose analysis is dynamic."""
    contacts = list(scene.of_kind("contact").values())
    analysis = next(iter(scene.of_kind("analysis").values()), None)
    if not contacts or analysis is None or not isinstance(analysis.thing, Dynamic):
        return
    if analysis.thing.explicit:
        yield diagnostic(
            "E680",
            analysis.at("integrator"),
            f"`{analysis.thing.integrator}` cannot keep `{contacts[0].name}` clear",
            "explicit steps",
            "they find a touch only when they are behind the surface: take `generalized_alpha`, `trapezoidal`, "
            "`midpoint`, `bdf2` or `implicit_euler`",
        )
