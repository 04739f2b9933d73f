"""Newton: linear tetrahedra in motion by vertex block descent, on the CPU, through Warp.

Nodes, cells, lumped nodal masses, nodal forces and fully held nodes are ours; held nodes have no mass. The law is
stable neo-Hookean without its logarithmic (origin) term, mu/2 tr C + (lam + mu)/2 (J - 1 - mu/(lam + mu))^2, with our
initial moduli.
Steps are implicit Euler in single precision, solved by a fixed number of iterations; Newton does not report their
residual. Mass-proportional damping is a nodal force that follows the velocity before a step.
Source: Chen, Liu, Yang and Yuksel (2024), Vertex Block Descent, ACM Trans. Graph. 43(4):116; Newton's source code.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np

from softmark.interpreter.models.external.adapters import package_process
from softmark.interpreter.models.external.external_problem import (
    Answer,
    ExternalNotConverged,
    Motion,
    NoAnswer,
    Problem,
)

PACKAGE = package_process.Package(
    "softmark.interpreter.models.external.adapters.newton_vbd", "newton", "newton", "newton"
)
install, version, places = PACKAGE.install, PACKAGE.version, PACKAGE.places
write, command, read = PACKAGE.write, PACKAGE.command, PACKAGE.read

USUAL = 10  # iterations: default of the program
RADIUS = 1e-4  # m, radius of a particle, which is never in contact


def refuses(problem: Problem) -> list[tuple[str, str]]:
    """Return unsupported features: damping by stiffness, explicit steps, and nodes with only some components held."""
    motion, found = problem.motion, []
    if motion is not None and motion.damping_stiffness:
        found.append(("damping_stiffness", "its damping of cells is defined differently"))
    if motion is not None and motion.explicit:
        found.append(("an explicit integrator", "it steps by implicit Euler"))
    _, counts = np.unique(problem.held[:, 0], return_counts=True)
    if np.any(counts != 3):
        found.append(("supports that hold single components", "it can hold only all components of a particle"))
    return found


def solved(problem: Problem) -> Answer:
    """Return the displacements after the requested numbers of steps. Raises NoAnswer."""
    from newton.solvers import SolverVBD

    count = USUAL if problem.motion is None else problem.motion.iterations or USUAL
    return simulate(problem, count, lambda model: SolverVBD(model, iterations=count), colours=True)


def simulate(problem: Problem, iterations: int, solver_of: Any, colours: bool) -> Answer:
    """Return the motion by a solver of Newton, after one untimed step that compiles its kernels. Raises NoAnswer.

    `solver_of` creates the solver for a model and a number of `iterations`.
    """
    begin = time.perf_counter()
    motion = problem.motion
    if motion is None:
        raise NoAnswer("it solves no static equilibrium")
    model = build_model(problem, motion, colours)
    solver_of(model).step(model.state(), model.state(), model.control(), None, motion.step)
    solver, now, then, control = solver_of(model), model.state(), model.state(), model.control()
    wanted = {int(n): i for i, n in enumerate(motion.after)}
    u, steps = np.zeros((len(motion.after), *problem.points.shape)), np.empty(motion.count)
    rest = now.particle_q.numpy().astype(np.float64)
    ready = time.perf_counter()
    for n in range(motion.count):
        before = time.perf_counter()
        now.particle_f.assign(problem.forces - motion.damping_mass * motion.masses[:, None] * now.particle_qd.numpy())
        solver.step(now, then, control, None, motion.step)
        now, then = then, now
        steps[n] = time.perf_counter() - before
        if n + 1 in wanted:
            u[wanted[n + 1]] = now.particle_q.numpy() - rest
            if not np.all(np.isfinite(u[wanted[n + 1]])):
                raise ExternalNotConverged(f"it becomes unstable before {(n + 1) * motion.step:.4g} s")
    done = time.perf_counter()
    u[:, problem.held[:, 0], problem.held[:, 1]] = 0.0  # to the last digit of single precision
    said = f"{iterations} iterations per step, without a reported residual"
    clocks = {"setup_s": ready - begin, "solve_s": done - ready}
    return Answer(u, False, iterations * motion.count, clocks, said, steps_s=steps, unsolved=motion.count)


def build_model(problem: Problem, motion: Motion, colours: bool) -> Any:
    """Return the Newton model of a problem: one particle for each node.

    Gravity is zero, because the weight is part of the nodal forces. `colours` requests a vertex colouring.
    """
    import newton
    import warp

    warp.config.quiet = True
    (stuff,) = problem.stuff
    lam, mu = stuff.lame
    masses = motion.masses.copy()
    masses[problem.held[:, 0]] = 0.0
    builder, count = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0)), len(masses)
    points, still = [warp.vec3(*X) for X in problem.points.tolist()], [warp.vec3(0.0, 0.0, 0.0)] * count
    builder.add_particles(pos=points, vel=still, mass=masses.tolist(), radius=[RADIUS] * count)
    for cell in problem.cells.tolist():
        builder.add_tetrahedron(*cell, k_mu=mu, k_lambda=lam, k_damp=0.0)
    if colours:
        builder.color()
    return builder.finalize(device="cpu")


if __name__ == "__main__":
    sys.exit(package_process.main(solved))
