"""MuJoCo: a flex of linear tetrahedra, of a body in motion.

Of ours are nodes, cells, masses lumped at the nodes, the forces on them and what is held: a component that is held has
no joint. Its law is St Venant's and Kirchhoff's: mu tr(E^2) + lam/2 tr(E)^2 of Green's strain E, exactly as ours of
linear tetrahedra. Steps are its own: `discrete`, one solve in M + h D + h^2 K a step, with the forces at its start, by
iterations, of which 100 are most where none are asked for; `Euler`, semi-implicit, where explicit steps are. Damping in
proportion to the stiffness is in D; joints of a flex may have none, so that in proportion to the mass is a force on
nodes, by the velocity before a step.
Source: its documentation, Computation: Integrators, and XML reference: flex/elasticity; Todorov, Erez and Tassa (2012).
"""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np

from softmark.interpreter.models.outside.adapters import packaged
from softmark.interpreter.models.outside.problem import Answer, Motion, NoAnswer, NotSettled, Problem

PACKAGE = packaged.Package("softmark.interpreter.models.outside.adapters.mujoco", "mujoco", "mujoco", "mujoco")
install, version, places, refuses = PACKAGE.install, PACKAGE.version, PACKAGE.places, PACKAGE.refuses
write, command, read = PACKAGE.write, PACKAGE.command, PACKAGE.read

AXES = ("1 0 0", "0 1 0", "0 0 1")
SMALL = 1e-9  # kg m^2: inertia of a node that never turns, which its compiler wants


def solved(problem: Problem) -> Answer:
    """Displacements after the steps that are asked for. Raises NoAnswer."""
    import mujoco

    begin = time.perf_counter()
    motion = problem.motion
    if motion is None:
        raise NoAnswer("it knows no state of rest")
    model = mujoco.MjModel.from_xml_string(deck(problem, motion))
    data = mujoco.MjData(model)
    free = ~problem.is_held
    forces = problem.forces[free]  # of joints, in their order: node by node
    drag = motion.damping_mass * np.repeat(motion.masses, 3).reshape(-1, 3)[free]
    u, wanted = np.zeros((len(motion.after), *free.shape)), {int(n): i for i, n in enumerate(motion.after)}
    steps, warned = np.empty(motion.count), mujoco.mjtWarning
    bad = [int(w) for w in (warned.mjWARN_BADQPOS, warned.mjWARN_BADQVEL, warned.mjWARN_BADQACC)]
    short, unsolved = data.warning[int(warned.mjWARN_INERTIA)], 0
    ready = time.perf_counter()
    for n in range(motion.count):
        before = time.perf_counter()
        data.qfrc_applied[:] = forces - drag * data.qvel
        mujoco.mj_step(model, data)
        steps[n] = time.perf_counter() - before
        unsolved, short.number = unsolved + bool(short.number), 0
        if any(data.warning[w].number for w in bad) or not np.all(np.isfinite(data.qpos)):
            raise NotSettled(f"it is unstable after {(n + 1) * motion.step:.4g} s, with steps of {motion.step:g} s")
        if n + 1 in wanted:
            u[wanted[n + 1]][free] = data.qpos
    done = time.perf_counter()
    said = f"{unsolved} of {motion.count} steps ran out of iterations" if unsolved else ""
    clocks = {"setup_s": ready - begin, "solve_s": done - ready}
    return Answer(u, not unsolved, None, clocks, said, steps_s=steps, unsolved=unsolved)


def deck(problem: Problem, motion: Motion) -> str:
    """The model in its own language: a body with slides for every node, without gravity, for the weight is a force."""
    (stuff,) = problem.stuff
    names = " ".join(f"n{i}" for i in range(len(problem.points)))
    cells = " ".join(map(str, problem.cells.ravel().tolist()))
    integrator = "Euler" if motion.explicit else "discrete"
    iterations = "" if motion.iterations is None else f' iterations="{motion.iterations}"'
    return f"""<mujoco>
<option timestep="{motion.step!r}" integrator="{integrator}" gravity="0 0 0"{iterations}>
<flag contact="disable" autoreset="disable"/></option>
<worldbody>{"".join(nodes(problem, motion))}</worldbody>
<deformable><flex name="body" dim="3" radius="0" body="{names}" vertex="{"0 0 0 " * len(problem.points)}"
element="{cells}"><contact contype="0" conaffinity="0" selfcollide="none"/>
<elasticity young="{stuff.constants["young"]!r}" poisson="{stuff.constants["poisson"]!r}"
damping="{motion.damping_stiffness!r}"/></flex></deformable>
</mujoco>"""


def nodes(problem: Problem, motion: Motion) -> Any:
    """A body for every node, with a slide for each component that is free."""
    free = ~problem.is_held
    for i, (X, mass) in enumerate(zip(problem.points.tolist(), motion.masses.tolist(), strict=True)):
        slides = "".join(f'<joint type="slide" axis="{axis}"/>' for k, axis in enumerate(AXES) if free[i, k])
        inertia = f'<inertial pos="0 0 0" mass="{mass!r}" diaginertia="{SMALL} {SMALL} {SMALL}"/>'
        yield f'<body name="n{i}" pos="{X[0]!r} {X[1]!r} {X[2]!r}">{inertia}{slides}</body>'


if __name__ == "__main__":
    sys.exit(packaged.main(solved))
