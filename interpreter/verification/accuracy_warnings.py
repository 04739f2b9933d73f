"""Warnings that an answer may be inaccurate."""

from __future__ import annotations

from collections.abc import Sequence

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared, Scene

# codes of warnings that an answer may be inaccurate
DOUBTS: dict[str, str] = {
    "W301": "its element locks",
    "W302": "its strain cannot follow the rotation",
    "W304": "the beam is not slender",
    "W305": "its mesh loses volume",
    "W306": "its strain met a large rotation",
    "W312": "its mesh is coarser than the body",
    "W314": "the state may not be the only one",
    "W318": "energies do not balance",
    "W321": "springs have a Poisson's ratio of their own",
    "W322": "springs do not know the material's law",
    "W324": "cells of its network are inside out",
    "W331": "it is outside of its training",
    "W351": "cells are inside out",
    "W352": "the tolerance is looser than what is read",
    "W353": "its forces were not found again",
    "W361": "the integrator has taken much of the energy",
    "W362": "the step does not resolve the slowest vibration",
    "W364": "its mesh has slivers",
    "W365": "its supports hold a width that it lets go",
    "W366": "its law gives way in the state that it found",
    "W371": "its mesh does not carry the load that is asked for",
    "W372": "where a load ends was not followed everywhere",
    "W375": "its supports hold another part than they select",
    "W381": "its law ends before its strains do",
    "W382": "it is flat, between a beam and a plate",
    "W419": "it does not balance the forces of the full model",
    "W420": "its time step is too long for what is asked",
    "W377": "there are few steps to a swing of its loads",
    "W378": "steps do not show all of an amplitude",
    "W389": "its fibres have no direction somewhere",
    "W659": "its facets do not follow what presses",
    "W660": "its contact is less than a few cells wide",
    "W661": "its barrier keeps what it touches far away",
}


def is_doubt(code: str) -> bool:
    """Return whether a warning means that a model's answer may be inaccurate."""
    return code in DOUBTS


def doubts_of(scene: Scene, declared: Declared, warnings: Sequence[Diagnostic]) -> list[str]:
    """Return the codes of accuracy warnings, without those about another model."""
    others = [d.location for n, d in scene.of_kind("model").items() if n != declared.name]

    def concerns(warning: Diagnostic) -> bool:
        at = warning.span
        return at is None or not any(
            o.source is warning.source and o.span.start <= at.start < o.span.end for o in others
        )

    return list(dict.fromkeys(w.code for w in warnings if is_doubt(w.code) and concerns(w)))
