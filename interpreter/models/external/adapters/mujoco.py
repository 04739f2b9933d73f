"""MuJoCo: a flex of linear tetrahedra for a body in motion, or a flex of edges for a rod (`mujoco_rod.py`).

Nodes, cells, lumped nodal masses, nodal forces and constraints are ours: a held component has no joint. The law of
MuJoCo is that of St Venant and Kirchhoff, mu tr(E^2) + lam/2 tr(E)^2 of Green strain E, exactly as our law of linear
tetrahedra. Time integration is MuJoCo's: `discrete` solves one system in M + h D + h^2 K per step, with the forces at
the start of the step, by at most 100 iterations by default; `Euler`, semi-implicit, is used for explicit steps.
Stiffness-proportional damping is part of D. Joints of a flex cannot have damping, so mass-proportional damping is
applied by actuators. The model is the one that `dsl export --to mujoco` writes (exporters/mujoco_exporter.py).
Source: MuJoCo documentation, Computation: Integrators, and XML reference: flex/elasticity; Todorov, Erez and Tassa
(2012).
"""

from __future__ import annotations

import sys
import time

import numpy as np

from softmark.interpreter.models.external.adapters import mujoco_rod, package_process
from softmark.interpreter.models.external.adapters.mujoco_steps import take_steps
from softmark.interpreter.models.external.exporters.mujoco_exporter import deck
from softmark.interpreter.models.external.external_problem import Answer, NoAnswer, Problem

PACKAGE = package_process.Package("softmark.interpreter.models.external.adapters.mujoco", "mujoco", "mujoco", "mujoco")
install, version, places, refuses = PACKAGE.install, PACKAGE.version, PACKAGE.places, PACKAGE.refuses
write, command, read = PACKAGE.write, PACKAGE.command, PACKAGE.read


def solved(problem: Problem) -> Answer:
    """Return the displacements after the requested numbers of steps. Raises NoAnswer."""
    return _simulate_flex(problem) if problem.section is None else mujoco_rod.solved(problem)


def _simulate_flex(problem: Problem) -> Answer:
    """Return the motion of a flex of tetrahedra. Raises NoAnswer."""
    import mujoco

    begin = time.perf_counter()
    motion = problem.motion
    if motion is None:
        raise NoAnswer("it solves no static equilibrium")
    model = mujoco.MjModel.from_xml_string(deck(problem, motion))
    data = mujoco.MjData(model)
    free = ~problem.is_held
    u = np.zeros((len(motion.after), *free.shape))

    def look(i: int) -> None:
        """Store the nodal displacements at state i."""
        u[i][free] = data.qpos

    ready = time.perf_counter()
    steps, unsolved = take_steps(model, data, motion, look)
    done = time.perf_counter()
    said = f"{unsolved} of {motion.count} steps reached the iteration limit" if unsolved else ""
    clocks = {"setup_s": ready - begin, "solve_s": done - ready}
    return Answer(u, not unsolved, None, clocks, said, steps_s=steps, unsolved=unsolved)


if __name__ == "__main__":
    sys.exit(package_process.main(solved))
