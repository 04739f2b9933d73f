"""FElupe: its regions, laws and Newton iteration (SciPy's SuperLU); load steps are reduced if the iteration fails.

Nodes, cells, constraints and nodal forces are ours. The stopping criterion is also ours, because that of FElupe treats
forces below 1e-3 of its unit as zero, which in SI is a millinewton. The following laws of FElupe agree exactly with
ours:
    linear_elastic          LinearElastic        small strain
    neo_hookean             NeoHookeCompressible psi = mu/2 tr C - mu ln J + lam/2 (ln J)^2
    neo_hookean_isochoric   NeoHooke             psi = mu/2 (J^(-2/3) tr C - 3) + K/2 (J - 1)^2
The St Venant-Kirchhoff law is not supported: FElupe has it only by automatic differentiation, which needs another
package.
Source: Dutzler, FElupe (2025), doi:10.5281/zenodo.4817406.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np

from softmark.interpreter.models.external.adapters import package_process
from softmark.interpreter.models.external.external_problem import Answer, NoAnswer, Problem

PACKAGE = package_process.Package("softmark.interpreter.models.external.adapters.felupe", "felupe", "felupe", "felupe")
install, version, places, refuses = PACKAGE.install, PACKAGE.version, PACKAGE.places, PACKAGE.refuses
write, command, read = PACKAGE.write, PACKAGE.command, PACKAGE.read

# its cells are named as meshio's, and numbered as ours; its quadrature has as many points as we take
REGIONS = {
    "tet4": "RegionTetra",
    "tet10": "RegionQuadraticTetra",
    "hex8": "RegionHexahedron",
    "hex20": "RegionQuadraticHexahedron",
    "hex27": "RegionTriQuadraticHexahedron",
}
SHORTEST = 1.0 / 512.0  # of the load: smallest load step
MOST = 16  # largest number of iterations of a step


def solved(problem: Problem) -> Answer:
    """Return the displacements at each requested load fraction. Raises NoAnswer."""
    begin = time.perf_counter()
    newton = Newton(problem)
    ready = time.perf_counter()
    states, at = [], 0.0
    for share in problem.shares:
        newton.raise_load(at, share)
        states.append(newton.u.copy())
        at = share
    done = time.perf_counter()
    clocks = {"setup_s": ready - begin, "solve_s": done - ready}
    return Answer(
        np.array(states),
        True,
        newton.iterations,
        clocks,
        f"{newton.steps} {'step' if newton.steps == 1 else 'steps'} of the load",
    )


def law(problem: Problem) -> Any:
    """Return the FElupe law of the material of a problem."""
    import felupe

    (stuff,) = problem.stuff
    E, nu = stuff.constants["young"], stuff.constants["poisson"]
    lam, mu = stuff.lame
    if problem.strain == "small":
        return felupe.LinearElastic(E, nu)
    if stuff.law == "neo_hookean":
        return felupe.NeoHookeCompressible(mu=mu, lmbda=lam)
    return felupe.NeoHooke(mu=mu, bulk=E / (3.0 * (1.0 - 2.0 * nu)))


class Newton:
    """Newton iteration for a body at a fraction of the load."""

    def __init__(self, problem: Problem) -> None:
        """Create the field, the solid body and the boundary conditions of a problem in FElupe."""
        import felupe

        from softmark.solvers.elements import element_of

        region = REGIONS[problem.element]
        mesh = felupe.Mesh(problem.points, problem.cells, element_of(problem.element).meshio)
        self.problem = problem
        self.field = felupe.FieldContainer([felupe.Field(getattr(felupe, region)(mesh), dim=3)])
        self.load = felupe.PointLoad(self.field, np.arange(len(problem.points)), np.zeros_like(problem.forces))
        self.items = [felupe.SolidBody(law(problem), self.field), self.load]
        fixed = 3 * problem.held[:, 0] + problem.held[:, 1]
        self.order = np.argsort(fixed)
        self.dof0 = fixed[self.order]
        self.dof1 = np.setdiff1d(np.arange(problem.points.size), self.dof0)
        self.iterations = self.steps = 0

    @property
    def u(self) -> Any:
        """Present nodal displacements (n, 3), m."""
        return self.field[0].values

    def raise_load(self, at: float, to: float) -> None:
        """Raise the load fraction from `at` to `to` in one step, or in several if that fails. Raises NoAnswer."""
        step = to - at
        while at < to:
            before = self.u.copy()
            share = to if at + step >= to - 1e-12 else at + step
            if self._solve_at_load(share):
                at, step, self.steps = share, 2.0 * step, self.steps + 1
                continue
            self.u[:] = before
            step *= 0.5
            if step < SHORTEST:
                raise NoAnswer(f"its Newton iteration stops at {100.0 * at:.4g} % of the load")

    def _solve_at_load(self, share: float) -> bool:
        """Solve at a load fraction and return whether the iteration has converged."""
        import felupe

        self.load.update(share * self.problem.forces)
        known: dict[str, Any] = {"dof0": self.dof0, "dof1": self.dof1, "maxiter": MOST, "verbose": 0}
        try:
            with np.errstate(all="ignore"):
                felupe.newtonraphson(
                    items=self.items, x0=self.field, ext0=share * self.problem.values[self.order],
                    check=self._test_convergence, tol=self.problem.tolerance, **known,
                )  # fmt: skip
        except (ValueError, ArithmeticError, RuntimeError, np.linalg.LinAlgError):  # its own errors are ValueErrors
            return False
        return bool(np.all(np.isfinite(self.u)))

    def _test_convergence(self, dx: Any, x: Any, f: Any, ftol: float, **others: Any) -> tuple[float, float, bool]:
        """Return the norm of the correction, the residual forces relative to the loads, and whether both are small.

        Residual forces are compared with the larger of loads and reactions.
        """
        self.iterations += 1
        forces = np.asarray(f).ravel()
        largest = max(float(np.linalg.norm(self.load.values)), float(np.linalg.norm(forces[self.dof0])))
        left = float(np.linalg.norm(forces[self.dof1])) / (largest or 1.0)
        return float(np.linalg.norm(dx)), left, left <= ftol


if __name__ == "__main__":
    sys.exit(package_process.main(solved))
