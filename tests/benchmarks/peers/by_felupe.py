"""FElupe: its ready-made neo-Hookean solid and Newton iteration, MKL Pardiso for symmetric matrices."""

from __future__ import annotations

import time

import felupe
import numpy as np
from protocol import CAP, Found, Problem, main, symmetric_pardiso, tolerance_at


def solve(problem: Problem, steps: int) -> Found:
    """The beam by FElupe."""
    if problem.quadratic:
        region = felupe.RegionQuadraticTetra(felupe.Mesh(problem.points, problem.cells, "tetra10"))
    else:
        region = felupe.RegionTetra(felupe.Mesh(problem.points, problem.cells, "tetra"))
    field = felupe.FieldContainer([felupe.Field(region, dim=3)])
    clamp = {"wall": felupe.Boundary(field[0], fx=0.0)}
    dof0, dof1 = felupe.dof.partition(field, clamp)
    law = felupe.NeoHookeCompressible(mu=problem.mu, lmbda=problem.lam)
    body, weight = felupe.SolidBody(law, field), felupe.SolidBodyForce(field)
    solver, iterations, ready = symmetric_pardiso(), 0, time.process_time()
    for step in range(1, steps + 1):
        part = step / steps
        weight.update(part * np.array([0.0, 0.0, -problem.density * problem.gravity]))
        found = felupe.newtonraphson(
            items=[body, weight],
            x0=field,
            dof0=dof0,
            dof1=dof1,
            ext0=felupe.dof.apply(field, clamp, dof0),
            solver=solver,
            tol=tolerance_at(part),
            maxiter=CAP,
            verbose=0,
        )
        iterations += found.iterations
    return Found(np.array(field[0].values), ready, iterations, steps, f"FElupe {felupe.__version__}")


if __name__ == "__main__":
    main(solve)
