"""Nodal forces and moments of a beam, or of the points of a frame, in static equilibrium."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.postprocessing.nodal_forces import NodalForces
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.geometrically_exact_rod import RodElastic
from softmark.solvers.energies.rod_rotation import rotation
from softmark.solvers.statics.residual_forces import residual_without_rounding
from softmark.solvers.statics.static_problem import Statics


def nodal_forces_of_beam(problem: Statics, x: Floats, loads: Sequence[tuple[Declared, Energy]]) -> NodalForces:
    """Return the nodal forces in a state x (nodes * 7,), with moments about the material axes."""
    nodes, start = x.reshape(-1, 7), problem.rest.reshape(-1, 7)
    energy = sum(_strain_energy(e, x) for e in problem.assembly.internal if isinstance(e, RodElastic))
    return nodal_forces_of_rods(problem, x, loads, float(energy), start[:, :3], nodes[:, :3], rotation(nodes[:, 3:]))


def nodal_forces_of_rods(
    problem: Statics, x: Floats, loads: Sequence[tuple[Declared, Energy]], energy: float, X: Floats, now: Floats,
    frames: Floats,
) -> NodalForces:  # fmt: skip
    """Return the nodal forces of rods in a state x whose strain energy is `energy`, J.

    X (n, 3), m, are the undeformed positions of nodes or points, `now` (n, 3), m, the deformed ones, and `frames`
    (n, 3, 3) the axes, as columns, that moments refer to.
    """
    left = residual_without_rounding(problem, x).reshape(-1, 6)
    own = {load.name: _load_forces(e, x, len(X)) for load, e in loads}
    work = {load.name: -e.value(x) if e.conservative else None for load, e in loads}
    written = problem.assembly.gradient(x, 1.0).reshape(-1, 6)
    return NodalForces(X, now - X, now, left, own, energy, work, frames, written=written)


def forces_in_space(
    loads: Sequence[tuple[Declared, Energy]], x: Floats, frames: Floats
) -> list[tuple[Declared, Floats]]:
    """Return each load with its forces and moments in space (n, 6), N and N m; `frames` are the nodes' axes."""
    found = ((load, _load_forces(energy, x, len(frames))) for load, energy in loads)
    return [(load, np.hstack([f[:, :3], np.einsum("nij,nj->ni", frames, f[:, 3:])])) for load, f in found]


def _load_forces(load: Energy, x: Floats, count: int) -> Floats:
    """Return forces and moments (n, 6) of a load in a state x, with moments about the axes of the nodes or points."""
    g = np.zeros(6 * count)
    load.add_gradient(x, g)
    return -g.reshape(-1, 6)


def _strain_energy(elastic: RodElastic, x: Floats) -> float:
    """Return the strain energy, J, of a rod in a state x (dofs,).

    Shear or axial strain that the scene switches off is a constraint and contributes nothing.
    """
    modes = elastic.mode_energies(x)
    modes[list(elastic.stiffness.rigid)] = 0.0
    return float(modes.sum())
