"""Export for MuJoCo (.xml, MJCF of version 4): a flex of linear tetrahedra in motion, in SI units.

The adapter integrates this model. Each node is a body with slide joints for its free components. Weight is `gravity`;
the remaining nodal forces and mass-proportional damping are actuators with bias F - a m v. MJCF cannot state the
duration of a motion: a comment states the number of steps. MJCF also has no exact counterpart of the time integrator:
`discrete` solves one system per step, `Euler` none.
Source: MuJoCo documentation, XML reference: flex/elasticity, actuator/general; Computation: Integrators.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from softmark.interpreter.models.external.exporters.named_parts import NamedParts
    from softmark.interpreter.models.external.external_problem import Floats, Motion, Problem

Bools = NDArray[np.bool_]
FILE = "model.xml"
LAW = "st_venant_kirchhoff"
AXES = ("1 0 0", "0 1 0", "0 0 1")
SMALL = 1e-9  # kg m^2: inertia of a node that never rotates, which MuJoCo's compiler requires
ROUNDING = 1e-12  # of the largest force: a smaller remainder after the weight counts as zero


def refuses(problem: Problem) -> list[tuple[str, str]]:
    """Return features of a problem that MuJoCo does not have, or defines differently."""
    found = [] if problem.element == "tet4" else [(problem.element, "its solids use linear tetrahedra")]
    if problem.strain != "finite":
        found.append((f"strain = {problem.strain}", "its solids use finite strain"))
    if len(problem.stuff) > 1:
        found.append(("several materials", "a flex has one material"))
    laws = dict.fromkeys(stuff.law for stuff in problem.stuff if stuff.law != LAW)
    return [*found, *((law, f"a flex has Young's modulus, Poisson's ratio and one law, {LAW}") for law in laws)]


def export(problem: Problem, named: NamedParts, folder: Path) -> list[str]:
    """Write the MuJoCo model into a folder, and return the names of the written files."""
    assert problem.motion is not None
    (folder / FILE).write_text(deck(problem, problem.motion) + "\n", encoding="ascii")
    return [FILE]


def deck(problem: Problem, motion: Motion) -> str:
    """Return the text of the MJCF model."""
    (stuff,) = problem.stuff
    count, free = len(problem.points), ~problem.is_held
    g, rest = split_gravity(problem.forces, motion.masses)
    names = " ".join(f"n{i}" for i in range(count))
    cells = " ".join(map(str, problem.cells.ravel().tolist()))
    integrator = "Euler" if motion.explicit else "discrete"
    iterations = "" if motion.iterations is None else f' iterations="{motion.iterations}"'
    return f"""<mujoco>
<!-- units: m, kg, s; the motion has {motion.count} steps -->
<option timestep="{motion.step!r}" integrator="{integrator}" gravity="{row(g)}"{iterations}>
<flag contact="disable" autoreset="disable"/></option>
<worldbody>{"".join(nodes(problem.points, motion.masses, free))}</worldbody>
<deformable><flex name="body" dim="3" radius="0" body="{names}" vertex="{"0 0 0 " * count}"
element="{cells}"><contact contype="0" conaffinity="0" selfcollide="none"/>
<elasticity young="{stuff.constants["young"]!r}" poisson="{stuff.constants["poisson"]!r}"
damping="{motion.damping_stiffness!r}"/></flex></deformable>
<actuator>{"".join(forces(rest, motion.damping_mass * motion.masses, free))}</actuator>
</mujoco>"""


def split_gravity(forces: Floats, masses: Floats) -> tuple[Floats, Floats]:
    """Return the gravity (3,), m/s^2, of most nodes, and the nodal forces (n, 3), N, in addition to their weight."""
    g = np.median(forces / masses[:, None], axis=0)
    rest = forces - masses[:, None] * g
    rest[np.abs(rest) <= ROUNDING * np.abs(forces).max(initial=0.0)] = 0.0
    return g, rest


def row(values: Floats) -> str:
    """Return numbers separated by spaces, with all digits."""
    return " ".join(map(repr, values.tolist()))


def nodes(points: Floats, masses: Floats, free: Bools) -> Iterator[str]:
    """Yield a body for every node, with a slide joint for each free component, marked by `free` (n, 3)."""
    for i, (X, mass) in enumerate(zip(points, masses.tolist(), strict=True)):
        slides = "".join(
            f'<joint name="n{i}{"xyz"[k]}" type="slide" axis="{axis}"/>' for k, axis in enumerate(AXES) if free[i, k]
        )
        inertia = f'<inertial pos="0 0 0" mass="{mass!r}" diaginertia="{SMALL} {SMALL} {SMALL}"/>'
        yield f'<body name="n{i}" pos="{row(X)}">{inertia}{slides}</body>'


def forces(rest: Floats, drag: Floats, free: Bools) -> Iterator[str]:
    """Yield actuators for nodal forces other than weight `rest` (n, 3), N, and for damping `drag` (n,), N s/m."""
    for i, k in np.argwhere(free & ((rest != 0.0) | (drag != 0.0)[:, None])).tolist():
        yield joint_actuator(f"n{i}{'xyz'[k]}", float(rest[i, k]), float(drag[i]))


def joint_actuator(joint: str, force: float, drag: float) -> str:
    """Return an actuator that applies a constant force, N, and damping, N s/m, to a joint."""
    return f'<general joint="{joint}" gainprm="0" biastype="affine" biasprm="{force!r} 0 {-drag!r}"/>'
