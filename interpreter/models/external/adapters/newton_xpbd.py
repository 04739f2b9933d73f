"""Newton: linear tetrahedra in motion by extended position based dynamics, on the CPU, through Warp.

Only the law and the solver differ from `newton_vbd.py`. A cell has two constraints: tr C - 3 with the compliance 1/mu,
and J - 1 with 1/lam. Their energies are mu/2 (tr C - 3)^2 and lam/2 (J - 1)^2. The first has no initial shear
stiffness, because tr C - 3 is quadratic in shear.
Source: Macklin, Mueller and Chentanez (2016), XPBD, Motion in Games; Newton's source code, solvers/xpbd/kernels.py.
"""

from __future__ import annotations

import sys

from softmark.interpreter.models.external.adapters import newton_vbd, package_process
from softmark.interpreter.models.external.external_problem import Answer, Problem

PACKAGE = package_process.Package(
    "softmark.interpreter.models.external.adapters.newton_xpbd", "newton", "newton", "newton"
)
install, version, places, refuses = PACKAGE.install, PACKAGE.version, PACKAGE.places, newton_vbd.refuses
write, command, read = PACKAGE.write, PACKAGE.command, PACKAGE.read

USUAL = 2  # iterations: default of the program


def solved(problem: Problem) -> Answer:
    """Return the displacements after the requested numbers of steps. Raises NoAnswer."""
    from newton.solvers import SolverXPBD

    count = USUAL if problem.motion is None else problem.motion.iterations or USUAL
    return newton_vbd.simulate(problem, count, lambda model: SolverXPBD(model, iterations=count), colours=False)


if __name__ == "__main__":
    sys.exit(package_process.main(solved))
