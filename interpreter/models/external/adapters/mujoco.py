"""MuJoCo: a flex of linear tetrahedra for a body in motion, and one of edges for a rod (`mujoco_rod.py`).

Nodes, cells, lumped nodal masses, nodal forces and constraints are ours: a held component has no joint. Its law is that
of St Venant and Kirchhoff, mu tr(E^2) + lam/2 tr(E)^2 of Green strain E, exactly as ours of linear tetrahedra. Time
steps are its own: `discrete` solves one system in M + h D + h^2 K per step, with the forces at its start, by at most
100 iterations by default; `Euler`, semi-implicit, is used for explicit steps. Stiffness-proportional damping is in D;
joints of a flex may have none, so that mass-proportional damping is by actuators. The model is that of `dsl export --to
mujoco`, exporters/mujoco_exporter.py. Source: its documentation, Computation: Integrators, and XML reference:
flex/elasticity; Todorov, Erez and Tassa (2012).
"""

from __future__ import annotations

import sys
import time

import numpy as np

from softmark.interpreter.models.external.adapters import mujoco_rod, package_process
from softmark.interpreter.models.external.adapters.mujoco_steps import stepped
from softmark.interpreter.models.external.exporters.mujoco_exporter import deck
from softmark.interpreter.models.external.external_problem import Answer, NoAnswer, Problem

PACKAGE = package_process.Package("softmark.interpreter.models.external.adapters.mujoco", "mujoco", "mujoco", "mujoco")
install, version, places, refuses = PACKAGE.install, PACKAGE.version, PACKAGE.places, PACKAGE.refuses
write, command, read = PACKAGE.write, PACKAGE.command, PACKAGE.read


def solved(problem: Problem) -> Answer:
    """Return displacements after the requested steps. Raises NoAnswer."""
    return _moved(problem) if problem.section is None else mujoco_rod.solved(problem)


def _moved(problem: Problem) -> Answer:
    """Return the motion of a flex. Raises NoAnswer."""
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
        u[i][free] = data.qpos

    ready = time.perf_counter()
    steps, unsolved = stepped(model, data, motion, look)
    done = time.perf_counter()
    said = f"{unsolved} of {motion.count} steps reached the iteration limit" if unsolved else ""
    clocks = {"setup_s": ready - begin, "solve_s": done - ready}
    return Answer(u, not unsolved, None, clocks, said, steps_s=steps, unsolved=unsolved)


if __name__ == "__main__":
    sys.exit(package_process.main(solved))
