"""The critical step of central differences: what is computed against the edge that is measured.

    python tests/benchmarks/critical_step.py [--loaded]

Each body is given velocities at random, far too small to deform it, and marched for STEPS steps of one length without
the integrator's own refusal. Below the edge its energy stays of the size that it had, beyond the edge it grows by a
factor in every step: bisection between the two finds the edge to 0.1 %. The computed step is what `Frequencies` says,
2/w (sqrt(1 + z^2) - z) with w from Lanczos iteration; the last column is measured over computed. States under load are
stretched or compressed by their supports. A measurement; tests/solvers/test_critical_step.py asserts a part of it.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics.central_differences import CentralDifferences
from softmark.solvers.dynamics.dynamic_problem import Dynamics, Rayleigh
from softmark.solvers.dynamics.dynamic_system import DynamicSystem
from softmark.solvers.dynamics.integrator import Motion, StepFailed
from softmark.solvers.dynamics.mass_matrices import lumped_mass, mass_shapes_and_volumes
from softmark.solvers.energies.corotational_tets import CorotationalTets
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.spring_energy import Springs, stiffness_from_modulus
from softmark.solvers.materials import MATERIALS, law_for
from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.mesh_distortion import distort
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.mesh.spring_edges import build_spring_network

STEPS = 400  # at 0.3 % beyond the edge each multiplies by 1.08 where nothing damps
SPEED = 1e-7  # m in a step: strains stay so small that the body is linear, and far above rounding


@dataclass(frozen=True)
class Configuration:
    """A body of 2 x 1 x 1 and its state."""

    kind: str = "tet4"  # tet4, tet10, hex8, springs
    strain: str = "corotational"  # or finite
    young: float = 1e5  # Pa
    density: float = 1e3  # kg/m^3
    alpha: float = 0.0  # 1/s, times the critical step at rest without damping
    beta: float = 0.0  # s, the same
    mesh: str = "even"  # even, graded, distorted
    stretch: float = 1.0  # along x
    poisson: float = 0.3

    @property
    def words(self) -> str:
        """All of it on a line."""
        damped = f"a h = {self.alpha:g}, b/h = {self.beta:g}"
        return (
            f"{self.kind:8}{self.strain:13}{self.mesh:10}E {self.young:.0e}  rho {self.density:.0e}  "
            f"nu {self.poisson:<6g} stretch {self.stretch:<5g}{damped}"
        )


def mesh_of(some: Configuration) -> Mesh:
    """An even mesh; one whose cells grow threefold along x; one whose worst cell has the quality 0.05."""
    kind = "hex8" if some.kind == "springs" else some.kind
    mesh = Box((2.0, 1.0, 1.0)).mesh(kind, 0.5)
    if some.mesh == "graded":
        points = mesh.points.copy()
        points[:, 0] = 2.0 * (points[:, 0] / 2.0) ** 1.8
        mesh = Mesh(points, mesh.cells, mesh.kind)
    return distort(mesh, 0.05) if some.mesh == "distorted" else mesh


def energy_of(some: Configuration, mesh: Mesh) -> Any:
    """Springs of the material, or its law over the mesh."""
    if some.kind == "springs":
        net = build_spring_network(mesh, "all")
        D = mesh.points[net.edges[:, 1]] - mesh.points[net.edges[:, 0]]
        return Springs(net.edges, D, stiffness_from_modulus(some.young, net.weight, np.linalg.norm(D, axis=1)))
    law = law_for(MATERIALS["neo_hookean"](some.young, some.poisson, some.density), some.strain)
    parts = integrate_cells(mesh)
    corotational = some.strain == "corotational" and some.kind == "tet4"
    return (CorotationalTets if corotational else Elastic)(mesh.cells, parts.dNdX, parts.w, law)


def problem_of(some: Configuration) -> Dynamics:
    """The body, held at x = 0 and, where it is stretched, at x = 2."""
    mesh = mesh_of(some)
    x = mesh.points[:, 0]
    ends = x < 1e-9 if some.stretch == 1.0 else (x < 1e-9) | (x > 2.0 - 1e-9)
    fixed = (3 * np.flatnonzero(ends)[:, None] + np.arange(3)).ravel()
    N, w = mass_shapes_and_volumes(mesh.points, mesh.cells, mesh.element)
    rest = np.zeros_like(mesh.points)
    rest[:, 0] = (some.stretch - 1.0) * x
    state = rest.ravel()
    energy = energy_of(some, mesh)
    state = settled(energy, state, fixed)
    return Dynamics(
        Assembly(state.size, fixed, [energy], []),
        lumped_mass(mesh.cells, N, w, some.density),
        state,
        np.zeros(state.size),
        fixed,
        integrator=CentralDifferences(safety=1e9),
    )


def settled(energy: Any, x: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """Equilibrium of the free degrees of freedom near x, by Newton's method."""
    if not np.any(x):
        return x
    from softmark.solvers.energies.energy import VectorSpace
    from softmark.solvers.statics.static_equilibrium import Statics, equilibrium

    assembly = Assembly(x.size, fixed, [energy], [])
    return np.asarray(equilibrium(Statics(assembly, VectorSpace(x.size), np.zeros(x.size), fixed, x[fixed], 1e-9)).x)


def damped(some: Configuration, problem: Dynamics) -> Dynamics:
    """With Rayleigh damping in units of the critical step that there would be without."""
    if not (some.alpha or some.beta):
        return problem
    h = DynamicSystem(problem, 1.0).frequencies.critical_step(problem.rest, 0.0)
    return replace(problem, damping=Rayleigh(some.alpha / h, some.beta * h))


def computed(problem: Dynamics) -> float:
    """What the integrator takes for critical, s."""
    return DynamicSystem(problem, 1.0).frequencies.critical_step(problem.rest, 0.0)


def grows(problem: Dynamics, step: float) -> bool:
    """Whether steps of this length blow up what they start from."""
    system = DynamicSystem(problem, step)
    free, rng = system.forces.free, np.random.default_rng(7)
    v = np.zeros(problem.rest.size)
    v[free] = SPEED * rng.standard_normal(len(free)) / step
    factors = system.forces.factors(0.0)
    motion = Motion(0.0, problem.rest, v, system.start().a, factors)
    first = float(problem.mass @ v**2)
    for _ in range(STEPS):
        system.damping.compute_matrix(motion.x)
        end = motion.time + step
        half = motion.v + 0.5 * step * motion.a
        x = motion.x + step * half
        try:
            a, v = system.final_acceleration_and_velocity(motion, x, half, end, factors)
        except StepFailed:
            return True
        motion = Motion(end, x, v, a, factors)
        energy = float(problem.mass @ v**2)
        if not energy < 1e3 * first:
            return True
    return False


def measured(problem: Dynamics, about: float) -> float:
    """The edge between steps that keep and steps that grow, s, within 20 % of a guess; not a number where it is not."""
    low, high = 0.8 * about, 1.2 * about
    if grows(problem, low) or not grows(problem, high):
        return float("nan")
    while high / low > 1.001:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if grows(problem, middle) else (middle, high)
    return 0.5 * (low + high)


def edge(some: Configuration) -> tuple[float, float]:
    """The critical step computed and measured, s."""
    problem = damped(some, problem_of(some))
    about = computed(problem)
    return about, measured(problem, about)


def at_rest() -> list[Configuration]:
    """Undeformed bodies."""
    solids = [
        Configuration(kind, strain) for kind in ("tet4", "tet10", "hex8") for strain in ("corotational", "finite")
    ]
    kinds = [*solids, Configuration("springs", "-")]
    found = list(kinds)
    for alpha, beta in ((1.0, 0.0), (0.0, 0.05), (0.0, 0.5), (0.5, 0.2)):
        found += [replace(c, alpha=alpha, beta=beta) for c in kinds]
    found += [replace(c, mesh=mesh) for c in kinds for mesh in ("graded", "distorted")]
    for young, density in ((1e2, 1e3), (1e11, 1e3), (1e5, 1.0), (1e5, 2e4)):
        found += [replace(c, young=young, density=density) for c in kinds[1::2]]
    found += [replace(c, poisson=poisson) for c in solids[1::2] for poisson in (0.0, 0.49, 0.499)]
    return found


def loaded() -> list[Configuration]:
    """Bodies in finite strain and springs, stretched and compressed."""
    kinds = [Configuration(kind, "finite") for kind in ("tet4", "tet10", "hex8")]
    some = [replace(c, stretch=stretch) for c in kinds for stretch in (0.7, 1.5, 2.5)]
    some += [replace(c, stretch=1.5, beta=0.2) for c in kinds]
    return [*some, Configuration("springs", "-", stretch=1.5)]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--loaded", action="store_true", help="only bodies under load")
    chosen = loaded() if parser.parse_args().loaded else [*at_rest(), *loaded()]
    worst = 0.0
    for some in chosen:
        h, found = edge(some)
        worst = max(worst, abs(found / h - 1.0)) if np.isfinite(found) else np.inf
        print(f"{some.words:100} computed {h:.4e} s  measured {found:.4e} s  {found / h:.4f}", flush=True)
    print(f"{len(chosen)} configurations, worst difference {100 * worst:.2f} %")


if __name__ == "__main__":
    main()
