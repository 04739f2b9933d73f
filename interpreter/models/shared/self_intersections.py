"""Independent detection of surfaces that intersect each other in a solution, with a warning."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from softmark.interpreter.language.message_builder import diagnostic

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.solvers.energies.energy import Floats


def count_intersections(beds: Mapping[str, Any], x: Floats) -> dict[str, dict[str, int]]:
    """Return the numbers of intersecting pairs of faces in a state x (dofs,), m, by contact.

    The test does not use the contact solver.
    """
    from softmark.solvers.energies.energy import DynamicPatternEnergy

    found = {}
    for name in (name for name, bed in beds.items() if isinstance(bed, DynamicPatternEnergy)):
        from softmark.solvers.independent_forces.self_intersection import find_intersections

        skin = beds[name].skin
        found[name] = len(find_intersections(skin.places(x)[: skin.corners], skin.faces))
    return {"crossings": found} if found else {}


def intersection_warnings(declared: Declared, facts: Mapping[str, Any]) -> Iterator[Diagnostic]:
    """Yield a warning for every contact whose surfaces intersect each other."""
    for name, count in facts.get("crossings", {}).items():
        if count:
            yield diagnostic(
                "W630",
                declared.at(),
                f"surfaces of the contact `{name}` intersect in `{declared.name}`",
                f"{count} pairs of faces intersect",
                "please report this: the result is invalid",
            )
