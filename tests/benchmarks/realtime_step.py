"""Implicit steps of a corotational beam let go under gravity: CPU time of each step of `march`, one core.

    python tests/benchmarks/realtime_step.py [--seconds 1] [--cells 1000 5000 20000] [--tolerance 1e-6]
        [--integrator implicit_euler]

The beam of 178 mm by 19 mm radius, E = 60 kPa, nu = 0.49, 1070 kg/m^3, lumped mass, clamped at one end, is let go
at t = 0; dt = 10 ms. Ways of taking the step:

* `lagged`: the default of `Dynamics`: one tangent with the pressures of earlier states, factorised once where the
  states lead;
* `newton`: Newton's method with exact tangents, to the same tolerance of the same residual;
* `linear`: `max_iterations = 1`: one Newton iteration from the last state, what most real-time codes do. It does not
balance
  the forces; the table says by how much.

Compilation, mesh and analysis of the pattern are left out, and so is the ledger of energies that `march` keeps. The
tip after 0.25 s is compared with the solution of the same equations to 1e-10. Columns: CPU milliseconds a step;
iterations, median and most; the largest residual; steps that fell back to Newton's method. A measurement, not a
test: nothing is asserted.
"""
# ruff: noqa: E402 - threads must be set before anything that reads their number is imported

from __future__ import annotations

import os

for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[name] = "1"

import argparse
from dataclasses import replace
from typing import Any

import numpy as np

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics import INTEGRATORS
from softmark.solvers.dynamics.dynamic_problem import Dynamics
from softmark.solvers.dynamics.integrator import Motion
from softmark.solvers.dynamics.time_integration import march
from softmark.solvers.dynamics.trajectory import Trajectory, summarize_timing
from softmark.solvers.elements.tet4 import Tet4
from softmark.solvers.energies.corotational_tets import CorotationalTets
from softmark.solvers.energies.energy import Floats
from softmark.solvers.energies.external_loads import DeadForces
from softmark.solvers.materials.corotational import Corotational
from softmark.solvers.mesh.cell_splitting import mesh_hexahedra
from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.structured_meshes import extrude, mesh_disc

L, R, E, NU, RHO, DOWN = 0.178, 0.019, 60e3, 0.49, 1070.0, 9.81
STEP = 0.01  # s
SIZES = {1000: (0.010, 18), 5000: (0.006, 32), 20000: (0.005, 48)}  # edges across (m), layers along
WAYS: dict[str, dict[str, Any]] = {
    "lagged": {},
    "newton": {"lagged": False},
    "linear": {"lagged": False, "cap": 1},
}


def beam(cells: int, integrator: str) -> tuple[Mesh, Dynamics]:
    """The mesh and the problem of the beam that is let go."""
    across, layers = SIZES[cells]
    mesh = mesh_hexahedra(*extrude(mesh_disc(R, across), L, L / layers), Tet4)
    mesh = Mesh(np.ascontiguousarray(mesh.points[:, [2, 0, 1]]), mesh.cells)  # the axis along x
    parts = integrate_cells(mesh)
    law = Corotational(E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU)))
    energy = CorotationalTets(mesh.cells, parts.dNdX, parts.w, law)
    nodal = np.bincount(mesh.cells.ravel(), np.repeat(0.25 * RHO * mesh.volumes, 4))
    weight = np.zeros(mesh.points.size)
    weight[2::3] = -DOWN * nodal
    fixed = np.flatnonzero(np.repeat(mesh.points[:, 0] < 1e-9, 3))
    assembly = Assembly(mesh.points.size, fixed, [energy], [DeadForces(weight)])
    still = np.zeros(mesh.points.size)
    chosen = INTEGRATORS[integrator]()
    return mesh, Dynamics(assembly, np.repeat(nodal, 3), still, still, fixed, integrator=chosen)


def let_go(mesh: Mesh, problem: Dynamics, seconds: float) -> tuple[Trajectory, Floats]:
    """The march, and the tip (n + 1, 3) in m."""
    tip = 3 * int(np.argmin(np.linalg.norm(mesh.points - [L, 0, 0], axis=1)))

    def observe(motion: Motion) -> Floats:
        return motion.x[tip : tip + 3].copy()

    path = march(problem, seconds, STEP, observe)
    return path, np.array(path.observed)


def row(name: str, path: Trajectory, tip: Floats, tight: Floats) -> str:
    """One line of the table."""
    cost = summarize_timing(1e3 * path.cpu)
    at = len(tight) - 1
    off = np.linalg.norm(tip[at] - tight[at]) / np.linalg.norm(tight[at])
    x, _, z = 1e3 * tip[at]
    return (
        f"{name:<10}{cost.median:>8.2f}{cost.p95:>8.2f}{cost.p99:>8.2f}{cost.worst:>8.2f}"
        f"{np.median(path.iterations):>6.0f}{path.iterations.max():>6}{path.residuals.max():>10.0e}"
        f"{path.fallbacks:>6}  {x:.3f} {z:.3f}, off by {off:.0e}"
    )


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seconds", type=float, default=1.0)
    parser.add_argument("--cells", type=int, nargs="+", default=list(SIZES), choices=list(SIZES))
    parser.add_argument("--tolerance", type=float, default=1e-6)
    parser.add_argument("--integrator", default="implicit_euler", choices=list(INTEGRATORS))
    options = parser.parse_args()
    small = beam(1000, options.integrator)
    for way in WAYS.values():
        let_go(small[0], replace(small[1], **way), 3 * STEP)  # compiles
    for cells in options.cells:
        mesh, problem = beam(cells, options.integrator)
        free = len(problem.assembly.free)
        print(f"\n{len(mesh.cells)} tetrahedra, {len(mesh.points)} nodes, {free} unknowns")
        print("CPU ms      median     p95     p99   worst   its  most  residual  back  tip at 0.25 s, mm")
        _, tight = let_go(mesh, replace(problem, tolerance=1e-10), min(0.25, options.seconds))
        for name, way in WAYS.items():
            path, tip = let_go(mesh, replace(problem, tolerance=options.tolerance, **way), options.seconds)
            print(row(name, path, tip, tight))


if __name__ == "__main__":
    main()
