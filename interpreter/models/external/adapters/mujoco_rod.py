"""MuJoCo's rod: a flex of edges in motion, a discrete elastic rod, which replaced the cable in version 4.

Nodes, nodal masses, bending and torsional stiffness, inertia about the axis and nodal forces are ours. Edges keep their
length, by constraints as stiff as possible, and sections stay normal to them: stiffness against stretch and shear, and
inertia about e2 and e3, are ignored. The bending energy at a node is EI |kb|^2 / (l0 + l1), with the curvature binormal
kb and the lengths of both edges. A clamped edge next to the held node has the length SHORT times that of the next edge,
so that the clamp is at the node. EI2, EI3 and GJ are given by a box section and two moduli, with the formulas of
MuJoCo's compiler. All vectors are in the axes of the section, so that the rod is along x. Steps are `discrete`.
Source: MuJoCo documentation, Modeling: Rods; Bergou, Wardetzky, Robinson, Audoly and Grinspun (2008), Discrete elastic
rods, ACM Trans. Graph. 27(3):63.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from softmark.interpreter.models.external.adapters.mujoco_steps import take_steps
from softmark.interpreter.models.external.adapters.rod_adapters import must_not_gain_energy, nodal_axes
from softmark.interpreter.models.external.exporters.mujoco_exporter import (
    SMALL,
    forces,
    joint_actuator,
    nodes,
    row,
    split_gravity,
)
from softmark.interpreter.models.external.external_problem import Answer, Floats, Motion, NoAnswer, Problem, Section

SHORT = 1e-3  # length of the edge that gives the direction of a clamp, relative to the adjacent edge
BOX = 1e-3  # m, half size of the box along e2; the moduli are chosen to match the stiffness
STIFF = 'solimp="0.9999 0.9999 0.001 0.5 2"'  # stiffness of the edge constraints: the largest allowed


def solved(problem: Problem) -> Answer:
    """Return displacements and section axes after the requested numbers of steps. Raises NoAnswer."""
    import mujoco

    begin = time.perf_counter()
    motion, section = problem.motion, problem.section
    if motion is None or section is None:
        raise NoAnswer("it computes rods in motion only")
    ends = held_ends(problem)
    model = mujoco.MjModel.from_xml_string(deck(problem, motion, section))
    data, count = mujoco.MjData(model), len(problem.points)
    first = 1 if ends[0] else 0  # of our nodes among its vertices, and of our segments among its edges
    u, turned = np.zeros((len(motion.after), count, 3)), np.tile(section.axes, (len(motion.after), count, 1, 1))
    energies = np.zeros(len(motion.after))
    twists = [model.joint(name).qposadr[0] for name in _twist_joint_names(count - 1, ends)]

    def look(i: int) -> None:
        """Store the displacements and section axes of state i."""
        mujoco.mj_forward(model, data)
        x = data.flexvert_xpos[first : first + count]
        u[i] = x @ section.axes.T + problem.points[0] - problem.points
        frames = np.array(data.plastic[: 6 * (count - 1 + sum(ends))]).reshape(-1, 2, 3)[first : first + count - 1]
        turned[i] = section.axes @ nodal_axes(_edge_axes(x, frames, data.qpos[twists]))
        turned[i][[0, -1]] = np.where(np.array(ends)[:, None, None], section.axes, turned[i][[0, -1]])
        energies[i] = data.energy[1]  # kinetic energy only, a lower bound because strain energy is not negative

    ready = time.perf_counter()
    steps, unsolved = take_steps(model, data, motion, look)
    done = time.perf_counter()
    must_not_gain_energy(energies, np.einsum("tni,ni->t", u, problem.forces), motion.step)
    said = f"{unsolved} of {motion.count} steps reached the iteration limit" if unsolved else ""
    clocks = {"setup_s": ready - begin, "solve_s": done - ready}
    return Answer(u, not unsolved, None, clocks, said, steps_s=steps, turned=turned, unsolved=unsolved)


def held_ends(problem: Problem) -> tuple[bool, bool]:
    """Return whether the first and the last node are clamped."""
    return bool(np.any(problem.held[:, 0] == 0)), bool(np.any(problem.held[:, 0] == len(problem.points) - 1))


def deck(problem: Problem, motion: Motion, section: Section) -> str:
    """Return the MJCF model of a rod along x.

    It has a body with slide joints for each node, and a body with a twisting joint for each edge.
    """
    X = (problem.points - problem.points[0]) @ section.axes
    ends, lengths = held_ends(problem), np.linalg.norm(np.diff(X, axis=0), axis=1)
    free = np.ones(X.shape, dtype=np.bool_)
    free[[0, -1]] = ~np.array(ends)[:, None]
    g, rest = split_gravity(problem.forces @ section.axes, motion.masses)
    *_, GJ, EI2, EI3 = section.stiffness.tolist()
    high, wide = BOX, BOX * (EI2 / EI3) ** 0.5  # half sizes along e2 and e3: I2 : I3 as the squares of wide and high
    young, shear = EI2 / (4.0 / 3.0 * wide**3 * high), GJ / torsion(high, wide)
    names, vertex, edges = _vertices(X, lengths, ends)
    twist, drag = section.inertia[0] * lengths, motion.damping_mass
    slowed = (
        joint_actuator(name, 0.0, drag * own)
        for name, own in zip(_twist_joint_names(len(lengths), ends), twist.tolist(), strict=True)
    )
    return f"""<mujoco>
<option timestep="{motion.step!r}" integrator="discrete" gravity="{row(g)}">
<flag contact="disable" autoreset="disable" energy="enable"/></option>
<worldbody>{"".join(nodes(X, motion.masses, free))}{"".join(_edge_bodies(twist, ends))}</worldbody>
<deformable><flex name="rod" dim="1" body="{names}" vertex="{vertex}" element="{edges}">
<contact contype="0" conaffinity="0" selfcollide="none"/>
<elasticity young="{young!r}" shear="{shear!r}" section="box" sectionsize="{high!r} {wide!r}"/></flex></deformable>
<equality><flex flex="rod" solref="{2.0 * motion.step!r} 1" {STIFF}/></equality>
<actuator>{"".join(forces(rest, drag * motion.masses, free))}{"".join(slowed) if drag else ""}</actuator>
</mujoco>"""


def torsion(high: float, wide: float) -> float:
    """Return the torsion constant, m^4, of a box with these half widths, m, by the formula of MuJoCo's compiler."""
    b, a = sorted((high, wide))
    return a * b**3 * (16.0 / 3.0 - 3.36 * b / a * (1.0 - b**4 / a**4 / 12.0))


def _vertices(X: Floats, lengths: Floats, ends: tuple[bool, bool]) -> tuple[str, str, str]:
    """Return the bodies, positions and edges of the flex as text; it has a fixed node beyond each clamped end."""
    names, places = [f"n{i}" for i in range(len(X))], [np.zeros(3)] * len(X)
    if ends[0]:
        names, places = ["world", "world", *names[1:]], [X[0] - [SHORT * lengths[0], 0.0, 0.0], X[0], *places[1:]]
    if ends[1]:
        names = [*names[:-1], "world", "world"]
        places = [*places[:-1], X[-1], X[-1] + [SHORT * lengths[-1], 0.0, 0.0]]
    edges = " ".join(f"{i} {i + 1}" for i in range(len(names) - 1))
    return " ".join(names), " ".join(map(row, places)), edges


def _twist_joint_names(count: int, ends: tuple[bool, bool]) -> list[str]:
    """Return MuJoCo's names of the joints that twist the edges."""
    names = [f"rod_twist_{i + ends[0]}" for i in range(count)]
    return names if ends[1] else [*names[:-1], "rod_twist"]


def _edge_bodies(inertia: Floats, ends: tuple[bool, bool]) -> Iterator[str]:
    """Yield a body for each edge, with inertia (m,), kg m^2, about the axis and a joint for the section's twist."""
    for name, own in zip(_twist_joint_names(len(inertia), ends), inertia.tolist(), strict=True):
        about = f'<inertial pos="0 0 0" mass="{SMALL}" diaginertia="{own!r} {own!r} {own!r}"/>'
        yield f'<body name="{name}">{about}<joint name="{name}" axis="1 0 0"/></body>'


def _edge_axes(x: Floats, frames: Floats, angles: Floats) -> Floats:
    """Return the axes of the edges as columns (m, 3, 3), for nodes x (n, 3), m, and twist `angles`, rad.

    `frames` (m, 2, 3) are the tangent and a transverse direction of each edge in the previous step, which are
    transported in parallel.
    """
    t = np.diff(x, axis=0)
    t /= np.linalg.norm(t, axis=1)[:, None]
    before, u = frames[:, 0], frames[:, 1]
    across = np.cross(before, t)  # u goes with the turn that takes t from before to now
    u = u + np.cross(across, u) + np.cross(across, np.cross(across, u)) / (1.0 + (before * t).sum(axis=1))[:, None]
    v = np.cross(t, u)
    c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
    return np.stack([t, c * u + s * v, c * v - s * u], axis=2)
