"""Static and dynamic analysis of a solid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.api.elastic_solid import Solid
from softmark.solvers.api.solid_supports import Clamp, merge_clamps
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics import INTEGRATORS
from softmark.solvers.dynamics import time_integration as marching
from softmark.solvers.dynamics.dynamic_problem import Dynamics, Rayleigh
from softmark.solvers.dynamics.load_amplitudes import Amplitude
from softmark.solvers.dynamics.trajectory import Trajectory
from softmark.solvers.energies.energy import Energy, Floats, VectorSpace
from softmark.solvers.materials.polar_decomposition import least_stretch
from softmark.solvers.statics import static_equilibrium as statics

FLAT = 0.25  # relative length: corotational states with flatter cells are not used as a start


@dataclass(frozen=True)
class AtRest:
    """Static result of a solid: nodal displacements (n, 3), m.

    `found` is the solver's record of the equilibrium.
    """

    solid: Solid
    displacement: Floats
    found: statics.Equilibrium

    def at(self, X: Any, beyond: float = 0.0) -> Floats:
        """Return the displacements (p, 3), m, at points X (p, 3), m, of the undeformed body; see `Solid.at`.

        Raises ValueError.
        """
        return self.solid.at(X, self.displacement, beyond)


@dataclass(frozen=True)
class InMotion:
    """Dynamic result of a solid: nodal displacements (t, n, 3), m, at `times` (t,), s.

    `found` is the solver's record of the motion.
    """

    solid: Solid
    times: Floats
    displacement: Floats
    found: Trajectory

    def at(self, X: Any, beyond: float = 0.0) -> Floats:
        """Return the displacements (t, p, 3), m, at points X (p, 3), m, of the undeformed body; see `Solid.at`.

        Raises ValueError.
        """
        return np.array([self.solid.at(X, u, beyond) for u in self.displacement])


def equilibrium(
    solid: Solid,
    clamps: Sequence[Clamp],
    loads: Sequence[Energy],
    tolerance: float = 1e-8,
    max_iterations: int = 50,
) -> AtRest:
    """Return a stable equilibrium of a solid without inverted cells.

    `tolerance` bounds the out-of-balance force relative to the loads and reactions. Raises NotConverged, with the
    iteration history. Raises ValueError if the clamps leave a rigid motion free, or leave no node free.
    """
    fixed, target = merge_clamps(solid, clamps)
    size = solid.points.size
    assembly = Assembly(size, fixed, [solid.energy(solid.strain)], list(loads), solid.points)
    twin = assembly.with_internal([solid.energy("corotational")]) if solid.strain == "finite" else None
    found = statics.equilibrium(
        statics.Statics(
            assembly,
            VectorSpace(size),
            np.zeros(size),
            fixed,
            target,
            tolerance,
            max_iterations,
            twin,
            sound=solid.sound,
            near=lambda x: least_stretch(solid.elastic.F(x)) > FLAT,
            convex=solid.strain == "small" and assembly.conservative,
            extent=solid.mesh.extent,
        )
    )
    return AtRest(solid, found.x.reshape(-1, 3), found)


def march(
    solid: Solid,
    clamps: Sequence[Clamp],
    loads: Sequence[Energy],
    duration: float,
    step: float,
    integrator: str = "trapezoidal",
    damping: tuple[float, float] = (0.0, 0.0),
    velocity: Floats | tuple[float, float, float] = (0.0, 0.0, 0.0),
    amplitudes: Sequence[Amplitude] = (),
    tolerance: float = 1e-6,
) -> InMotion:
    """Return the motion of a solid from its undeformed shape, for `duration`, s, in time steps of `step`, s.

    `integrator` is a key of INTEGRATORS. `damping` is the pair a (1/s), b (s) of Rayleigh damping C = a M + b K.
    `velocity` is the initial velocity, m/s, of all nodes (3,) or of each node (n, 3). `amplitudes` scale the loads in
    time, one for each load; by default loads act fully from the start. An explicit integrator uses a lumped mass
    matrix. Raises NotConverged, Diverged, StepTooLong, and ValueError.
    """
    if integrator not in INTEGRATORS:
        raise ValueError(f"unknown integrator {integrator!r}; available: {', '.join(INTEGRATORS)}")
    fixed, target = merge_clamps(solid, clamps, free=True)
    size, way = solid.points.size, INTEGRATORS[integrator]()
    problem = Dynamics(
        Assembly(size, fixed, [solid.energy(solid.strain)], list(loads)),
        solid.mass(lumped=way.explicit),
        np.zeros(size),
        np.broadcast_to(np.asarray(velocity, dtype=np.float64), solid.points.shape).ravel(),
        fixed,
        target,
        amplitudes=tuple(amplitudes),
        damping=Rayleigh(*damping),
        integrator=way,
        tolerance=tolerance,
        sound=solid.sound,
    )
    found = marching.march(problem, duration, step, lambda motion: motion.x.copy())
    return InMotion(solid, found.times, np.array(found.observed).reshape(len(found.times), -1, 3), found)
