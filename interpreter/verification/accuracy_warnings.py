"""Warnings that mean that a solution may be inaccurate."""

from __future__ import annotations

from collections.abc import Sequence

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared, Scene

# codes of warnings that an answer may be inaccurate
DOUBTS: dict[str, str] = {
    "W301": "the element locks",
    "W302": "small strain cannot follow the rotation",
    "W304": "the beam is not slender",
    "W305": "the mesh has less volume than the body",
    "W306": "small strain was used with large rotations",
    "W312": "the cells are larger than half the thickness of the body",
    "W314": "other equilibrium states may exist",
    "W318": "the energies do not balance",
    "W321": "the springs have a fixed Poisson's ratio of 0.25",
    "W322": "the springs do not use the material's law",
    "W324": "cells of the spring network are inverted",
    "W331": "the reduced model is used outside its training range",
    "W351": "cells are inverted",
    "W352": "the solver tolerance is coarser than the compared differences",
    "W353": "the forces could not be verified independently",
    "W361": "numerical damping removed much of the energy",
    "W362": "the time step does not resolve the slowest vibration",
    "W364": "the mesh has sliver cells",
    "W365": "the supports hold a width that the model leaves free",
    "W366": "the material law loses ellipticity in this state",
    "W371": "the mesh carries another load than the scene prescribes",
    "W372": "the edge of a loaded area was not integrated exactly everywhere",
    "W375": "the mesh holds another part than the supports select",
    "W381": "the strains exceed the range of the material law",
    "W382": "the section is flat: between a beam and a plate",
    "W419": "the reduced model does not balance the forces of the full model",
    "W420": "the time step is too long for the metrics",
    "W377": "there are few time steps per period of an oscillating load",
    "W378": "the time steps do not resolve all of an amplitude",
    "W389": "the fibre direction is undefined somewhere",
    "W659": "the facets do not follow the shape of the rigid body",
    "W660": "the contact area is less than a few cells wide",
    "W661": "the contact barrier leaves a wide gap",
}


def is_doubt(code: str) -> bool:
    """Return whether the warning with this code means that the solution of a model may be inaccurate."""
    return code in DOUBTS


def accuracy_warning_codes(scene: Scene, declared: Declared, warnings: Sequence[Diagnostic]) -> list[str]:
    """Return the codes of the accuracy warnings about one model, leaving out warnings about other models."""
    others = [d.location for n, d in scene.of_kind("model").items() if n != declared.name]

    def concerns(warning: Diagnostic) -> bool:
        at = warning.span
        return at is None or not any(
            o.source is warning.source and o.span.start <= at.start < o.span.end for o in others
        )

    return list(dict.fromkeys(w.code for w in warnings if is_doubt(w.code) and concerns(w)))
