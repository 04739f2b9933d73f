"""Dynamic problem of a case: supports, amplitudes, damping and integrator as the scene declares them."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.models.procedures.case_amplitudes import check_amplitudes, support_amplitude
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics import INTEGRATORS, Integrator
from softmark.solvers.dynamics.dynamic_problem import Dynamics, Rayleigh
from softmark.solvers.dynamics.load_amplitudes import Amplitude
from softmark.solvers.energies.energy import Floats

if TYPE_CHECKING:
    from softmark.solvers.statics.static_equilibrium import Statics


def dynamic_problem_of(
    case: Case,
    assembly: Assembly,
    mass: Any,
    velocity: Floats,
    static: Statics,
    amplitudes: tuple[Amplitude, ...],
    **options: Any,
) -> Dynamics:
    """Return the dynamic problem of a case that starts from rest with a `velocity` (dofs,). Raises Fault.

    Supports are those of the `static` problem. `amplitudes` has one for each load of the `assembly`, and `options` are
    further fields of `Dynamics`.
    """
    analysis: Any = case.analysis
    check_amplitudes(case, analysis.duration)
    return Dynamics(
        assembly,
        mass,
        np.zeros(assembly.dofs),
        velocity,
        static.fixed,
        static.target,
        support_amplitude(case),
        amplitudes,
        Rayleigh(analysis.damping_mass, analysis.damping_stiffness),
        _integrator_of(analysis),
        analysis.tolerance,
        analysis.max_iterations,
        **options,
    )


def _integrator_of(analysis: Dynamic) -> Integrator:
    """Return the time integrator that an analysis selects, with its constants."""
    cls: Any = INTEGRATORS[analysis.integrator]
    known = {f.name for f in fields(cls)} & {"spectral_radius"}
    made: Integrator = cls(**{name: getattr(analysis, name) for name in known})
    return made


def initial_velocities(analysis: Dynamic, points: Floats, mass: Any) -> Floats:
    """Return initial nodal velocities (3 n,), m/s, from the velocity and spin about the centre of mass."""
    weights = (mass if mass.ndim == 1 else np.asarray(mass.sum(axis=1)).ravel())[::3]
    centre = weights @ points / weights.sum()
    v: Floats = np.array(analysis.velocity) + np.cross(np.array(analysis.spin), points - centre)
    return v.ravel()
