"""Dynamics: time integrators, and the time integration that uses them.

The equations of motion M a + C v + dE/dx (x, t) = 0 (see dynamic_problem.py) are integrated from time 0 to a duration
(time_integration.py) by one of INTEGRATORS. To add an integrator: one file with a class that has the members of
`integrator.Integrator`, and one line here.
"""

from __future__ import annotations

from softmark.solvers.dynamics.bdf2 import BDF2
from softmark.solvers.dynamics.central_differences import CentralDifferences
from softmark.solvers.dynamics.generalized_alpha import GeneralizedAlpha
from softmark.solvers.dynamics.implicit_euler import ImplicitEuler
from softmark.solvers.dynamics.implicit_midpoint import Midpoint
from softmark.solvers.dynamics.integrator import Integrator
from softmark.solvers.dynamics.newmark import Newmark
from softmark.solvers.dynamics.trapezoidal_rule import Trapezoidal

__all__ = ["INTEGRATORS", "Integrator"]

INTEGRATORS: dict[str, type[Integrator]] = {
    "implicit_euler": ImplicitEuler,
    "newmark": Newmark,
    "trapezoidal": Trapezoidal,
    "generalized_alpha": GeneralizedAlpha,
    "bdf2": BDF2,
    "midpoint": Midpoint,
    "central_differences": CentralDifferences,
}
