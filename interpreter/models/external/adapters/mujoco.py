"""MuJoCo: a flex of linear tetrahedra of a body in motion, and one of edges, its rod (`mujoco_rod.py`).

Of ours are nodes, cells, masses lumped at the nodes, the forces on them and what is held: a component that is held has
no joint. Its law is St Venant's and Kirchhoff's: mu tr(E^2) + lam/2 tr(E)^2 of Green's strain E, exactly as ours of
linear tetrahedra. Steps are its own: `discrete`, one solve in M + h D + h^2 K a step, with the forces at its start, by
iterations, of which 100 are most where none are asked for; `Euler`, semi-implicit, where explicit steps are. Damping in
proportion to the stiffness is in D; joints of a flex may have none, so that in proportion to the mass is of actuators.
What is stepped is what `dsl export --to mujoco` writes, exporters/mujoco_exporter.py.
Source: its documentation, Computation: Integrators, and XML reference: flex/elasticity; Todorov, Erez and Tassa (2012).
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
    """A flex. Raises NoAnswer."""
    import mujoco

    begin = time.perf_counter()
    motion = problem.motion
    if motion is None:
        raise NoAnswer("it knows no state of rest")
    model = mujoco.MjModel.from_xml_string(deck(problem, motion))
    data = mujoco.MjData(model)
    free = ~problem.is_held
    u = np.zeros((len(motion.after), *free.shape))

    def look(i: int) -> None:
        u[i][free] = data.qpos

    ready = time.perf_counter()
    steps, unsolved = stepped(model, data, motion, look)
    done = time.perf_counter()
    said = f"{unsolved} of {motion.count} steps ran out of iterations" if unsolved else ""
    clocks = {"setup_s": ready - begin, "solve_s": done - ready}
    return Answer(u, not unsolved, None, clocks, said, steps_s=steps, unsolved=unsolved)


if __name__ == "__main__":
    sys.exit(package_process.main(solved))
