"""Constants of rubber laws for closed-form theories."""

from __future__ import annotations

from typing import Any

from softmark.interpreter.problem.body_case import Case
from softmark.references.rubber_energies import KNOWN, LAWS, Rubber
from softmark.references.straight_cantilever import NotApplicable
from softmark.solvers.materials import MATERIALS
from softmark.solvers.materials.neo_hookean import NeoHookean
from softmark.solvers.materials.neo_hookean_isochoric import NeoHookeanIsochoric

OTHER = ("density", "poisson", "bulk", "young", "volumetric")  # fields without effect on an incompressible solid


def word_of(material: Any) -> str:
    """Return the word that makes a material in the scene language; the name of its class if there is none."""
    return next((name for name, cls in MATERIALS.items() if type(material) is cls), type(material).__name__)


def rubber_of(case: Case) -> Rubber:
    """Return the rubber law of a case's body. Raises NotApplicable if no closed form is known for its material."""
    material: Any = case.material
    if isinstance(material, NeoHookean | NeoHookeanIsochoric):
        return Rubber.neo_hookean(material.shear_modulus)
    word = word_of(material)
    if word not in KNOWN:
        raise NotApplicable(
            f"`{word}` is not a rubber law that the theory supports",
            f"use `neo_hookean(...)`, or one of {', '.join(LAWS)}",
        )
    return Rubber(word, tuple((name, value) for name, value in vars(material).items() if name not in OTHER))
