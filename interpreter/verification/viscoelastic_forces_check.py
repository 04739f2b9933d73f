"""Independent forces of viscoelastic solids, by the hereditary integral.

The integral is evaluated in solvers/independent_forces/hereditary_integral.py.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any

import numpy as np

from softmark.interpreter.models.shared.prepared_model import DeformedMesh
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.verification.unverified_model_error import NoIndependentFormula
from softmark.solvers.independent_forces import hereditary_integral, solid_forces
from softmark.solvers.independent_forces.hereditary_integral import (
    DisplacementHistory,
    Measure,
    ViscoelasticBody,
    ViscoelasticMixedBody,
)
from softmark.solvers.independent_forces.mixed_formulation_forces import MixedBody
from softmark.solvers.independent_forces.solid_forces import Floats
from softmark.solvers.independent_forces.stress_by_differences import EnergyStress

MOST = 2e9  # numbers that a past may be looked through


def deformation_history(case: Case, strain: str, mesh: DeformedMesh, points: int) -> DisplacementHistory:
    """Return the deformation history of a viscoelastic body of one material. Raises NoIndependentFormula."""
    material = case.material
    past = getattr(mesh, "past", None)
    if past is None:
        raise NoIndependentFormula("the deformation history is not known")
    if len(past.times) * points * 9.0 > MOST:
        raise NoIndependentFormula(f"the history of {len(past.times)} steps is too long to be verified")
    g, tau = (np.array(column) for column in zip(*material.branches, strict=True))
    return DisplacementHistory(
        past.times,
        past.states,
        _relaxing_stress(material, strain),
        g,
        tau,
        _history_strain_measure(material, strain),
        case.depth,
    )


def _history_strain_measure(material: Any, strain: str) -> Measure:
    """Return the name of the strain measure in which a viscoelastic material's history is recorded."""
    if strain == "finite":
        return "green" if material.of == "whole" else "shape"
    return "small" if strain == "small" else "turned"


def _relaxing_stress(material: Any, strain: str) -> solid_forces.Stress:
    """Return the relaxing part of the stress: by Hooke's law, or by differences of the energy at finite strain.

    Raises NoIndependentFormula.
    """
    E, nu = material.young, material.poisson
    mu, lam = E / (2.0 * (1.0 + nu)), 0.0 if nu == 0.5 else E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    if strain != "finite":
        hooke = solid_forces.small_strain_stress if strain == "small" else solid_forces.corotational_stress
        return hooke(mu, lam if material.of == "whole" else -2.0 / 3.0 * mu)
    part = material.finite_law() if material.of == "whole" else material.law.isochoric()
    if part is None:
        raise NoIndependentFormula(f"no part of the material {type(material.law).__name__} relaxes in finite strain")
    return EnergyStress(part.psi)


def with_history(made: Any, course: DisplacementHistory) -> Any:
    """Return the body `made` as a viscoelastic one with a deformation history."""
    cls = ViscoelasticMixedBody if isinstance(made, MixedBody) else ViscoelasticBody
    known = {f.name: getattr(made, f.name) for f in fields(made)}
    return cls(**known, course=course)


# ------------------------------------------------------------------ beams


def relaxed_strain(material: Any, displacement: Any, strains: Callable[[Any], Floats]) -> Floats:
    """Return the relaxed part (e, 6) of a beam's section strains (e, 6). Raises NoIndependentFormula.

    `strains` is a function that returns the section strains for a displacement field.
    """
    times, past = getattr(displacement, "times", None), getattr(displacement, "past", None)
    if times is None or past is None:
        raise NoIndependentFormula("the deformation history is not known")
    steps = [strains(moved) for moved in past]
    if len(steps) * steps[0].size > MOST:
        raise NoIndependentFormula(f"the history of {len(times)} steps is too long to be verified")
    shares, late = (np.array(column) for column in zip(*material.branches, strict=True))
    stretched = sheared = (shares, late)
    if material.of == "shape" and material.poisson < 0.5:
        stretched = hereditary_integral.series_of_youngs_modulus(shares, late, material.poisson)
    found = np.zeros_like(steps[0])
    for modes, (g, tau) in (([0, 4, 5], stretched), ([1, 2, 3], sheared)):
        left, before = 0.0, np.zeros_like(steps[0])
        for weight, now in zip(hereditary_integral.remaining_fractions(times, g, tau), steps, strict=True):
            left, before = left + weight * (now - before), now
        found[:, modes] = (float(g.sum()) * steps[-1] - left)[:, modes]
    return found
