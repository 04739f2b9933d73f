"""PyElastica: a Cosserat rod with explicit time steps.

Nodes, lengths, the six stiffnesses of the section, its rotary inertia, nodal masses and forces are ours. PyElastica
determines the rest: rotations, which belong to segments rather than nodes; the law, in which sections keep their volume
when stretched; damping of velocities in closed form; and steps by position Verlet. A clamp holds the node at an end and
the rotation of the segment there. Compilation of the kernels counts as set-up.
Source: Gazzola, Dudte, McCormick and Mahadevan (2018), Forward and inverse problems in the mechanics of soft filaments.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np

from softmark.interpreter.models.external.adapters import package_process
from softmark.interpreter.models.external.adapters.rod_adapters import must_not_gain_energy, nodal_axes
from softmark.interpreter.models.external.external_problem import (
    Answer,
    ExternalNotConverged,
    Floats,
    NoAnswer,
    Problem,
)

PACKAGE = package_process.Package(
    "softmark.interpreter.models.external.adapters.pyelastica", "elastica", "pyelastica", "pyelastica"
)
install, version, places, refuses = PACKAGE.install, PACKAGE.version, PACKAGE.places, PACKAGE.refuses
write, command, read = PACKAGE.write, PACKAGE.command, PACKAGE.read


def solved(problem: Problem) -> Answer:
    """Return displacements and section axes after the requested numbers of steps. Raises NoAnswer."""
    begin = time.perf_counter()
    elastica = import_elastica()
    motion = problem.motion
    if motion is None or problem.section is None:
        raise NoAnswer("it computes rods in motion only")
    stepper, dt = elastica.PositionVerlet(), np.float64(motion.step)
    simulator, _ = build_simulator(problem)
    stepper.step(simulator, np.float64(0.0), dt)  # which compiles
    simulator, rod = build_simulator(problem)
    wanted = {int(n): i for i, n in enumerate(motion.after)}
    u = np.zeros((len(wanted), *problem.points.shape))
    turned = np.tile(problem.section.axes, (len(wanted), len(problem.points), 1, 1))
    steps, energies, now = np.empty(motion.count), np.zeros(len(wanted)), np.float64(0.0)
    ready = time.perf_counter()
    for n in range(motion.count):
        before = time.perf_counter()
        with np.errstate(all="ignore"):
            now = stepper.step(simulator, now, dt)
        steps[n] = time.perf_counter() - before
        if not (np.all(np.isfinite(rod.position_collection)) and np.all(np.isfinite(rod.director_collection))):
            raise ExternalNotConverged(
                f"it becomes unstable after {(n + 1) * motion.step:.4g} s with steps of {motion.step:g} s"
            )
        if n + 1 in wanted:
            u[wanted[n + 1]] = rod.position_collection.T - problem.points
            turned[wanted[n + 1]] = sections(rod.director_collection)
            energies[wanted[n + 1]] = energy(rod)
    must_not_gain_energy(energies, np.einsum("tni,ni->t", u, problem.forces), motion.step)
    clocks = {"setup_s": ready - begin, "solve_s": time.perf_counter() - ready}
    return Answer(u, None, None, clocks, steps_s=steps, turned=turned)


def energy(rod: Any) -> float:
    """Return the kinetic plus strain energy of a rod, J; the strain energy is a lower bound.

    PyElastica's own strain energy, S e^2 / 2, ignores that sections become thinner when stretched, which divides
    forces by the stretch and couples by its third power. In tension the forces do less work than that energy; in
    compression they do no less.
    """
    motion = rod.compute_translational_energy() + rod.compute_rotational_energy()
    strain, bending = rod.sigma - rod.rest_sigma, rod.kappa - rod.rest_kappa
    shear = np.einsum("in,ijn,jn,n->n", strain, rod.shear_matrix, strain, rod.rest_lengths)
    bend = np.einsum("in,ijn,jn,n->n", bending, rod.bend_matrix, bending, rod.rest_voronoi_lengths)
    thin, thinner = np.maximum(rod.dilatation, 1.0), np.maximum(rod.voronoi_dilatation, 1.0)
    return float(motion + 0.5 * (shear / thin).sum() + 0.5 * (bend / thinner**3).sum())


def import_elastica() -> Any:
    """Return the imported package `elastica`, which has no type annotations."""
    import elastica

    return elastica


def build_simulator(problem: Problem) -> tuple[Any, Any]:
    """Return the simulator of a problem, and the rod in it."""
    elastica = import_elastica()

    parts = (elastica.BaseSystemCollection, elastica.Constraints, elastica.Forcing, elastica.Damping)
    simulator, rod, motion = type("Simulator", parts, {})(), rod_of(problem), problem.motion
    simulator.append(rod)
    assert motion is not None
    for node, segment in ((0, 0), (len(problem.points) - 1, len(problem.cells) - 1)):
        if node in problem.held[:, 0]:
            simulator.constrain(rod).using(
                elastica.FixedConstraint, constrained_position_idx=(node,), constrained_director_idx=(segment,)
            )
    simulator.add_forcing_to(rod).using(dead_force_class(elastica), forces=np.ascontiguousarray(problem.forces.T))
    if motion.damping_mass:
        simulator.dampen(rod).using(
            elastica.AnalyticalLinearDamper, uniform_damping_constant=motion.damping_mass, time_step=motion.step
        )
    simulator.finalize()
    return simulator, rod


def dead_force_class(elastica: Any) -> Any:
    """Return a PyElastica class of constant nodal forces (3, n), N."""

    def init(self: Any, forces: Floats) -> None:
        """Store the nodal forces (3, n), N."""
        elastica.NoForces.__init__(self)
        self.forces = forces

    def apply_forces(self: Any, system: Any, time: float = 0.0) -> None:
        """Add the stored nodal forces to the external forces of the rod."""
        system.external_forces += self.forces

    return type("Dead", (elastica.NoForces,), {"__init__": init, "apply_forces": apply_forces})


def rod_of(problem: Problem) -> Any:
    """Return a PyElastica rod that has softmark's stiffnesses and inertia, not those of a circular section."""
    elastica = import_elastica()
    section, (stuff,) = problem.section, problem.stuff
    assert section is not None
    X, (along, across, _) = problem.points, section.axes.T
    lengths = np.linalg.norm(np.diff(X, axis=0), axis=1)
    radius = float(np.sqrt(section.area / np.pi))
    rod = elastica.CosseratRod.straight_rod(
        len(lengths), X[0].copy(), along.copy(), across.copy(), float(lengths.sum()), radius, stuff.density,
        youngs_modulus=stuff.constants["young"], shear_modulus=stuff.lame[1], position=X.T.copy(),
    )  # fmt: skip
    EA, GA2, GA3, GJ, EI2, EI3 = section.stiffness.tolist()
    rod.shear_matrix[:] = np.diag([GA2, GA3, EA])[:, :, None]  # its axes are e2, e3, e1
    rod.bend_matrix[:] = np.diag([EI2, EI3, GJ])[:, :, None]
    about1, about2, about3 = section.inertia
    inertia = np.diag([about2, about3, about1])
    rod.mass_second_moment_of_inertia[:] = inertia[:, :, None] * lengths
    rod.inv_mass_second_moment_of_inertia[:] = np.linalg.inv(inertia)[:, :, None] / lengths
    return rod


def sections(directors: Floats) -> Floats:
    """Return the section axes e1, e2, e3 at nodes as columns (n, 3, 3).

    `directors` (3, 3, n - 1) are those of PyElastica's segments, whose rows d1, d2, d3 are e2, e3, e1.
    """
    return nodal_axes(np.transpose(directors, (2, 1, 0))[:, :, [2, 0, 1]])


if __name__ == "__main__":
    sys.exit(package_process.main(solved))
