"""What becomes of a solid: where it comes to rest, and how it moves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.api.elastic_solid import Solid
from softmark.solvers.api.solid_supports import Clamp, held
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics import INTEGRATORS
from softmark.solvers.dynamics import time_integration as marching
from softmark.solvers.dynamics.dynamic_problem import Dynamics, Rayleigh
from softmark.solvers.dynamics.load_amplitudes import Course
from softmark.solvers.dynamics.trajectory import Trajectory
from softmark.solvers.energies.energy import Energy, Floats, VectorSpace
from softmark.solvers.materials.polar_decomposition import least_stretch
from softmark.solvers.statics import static_equilibrium as statics

FLAT = 0.25  # of a length: a corotational state with cells squeezed below it is none to start from


@dataclass(frozen=True)
class AtRest:
    """A solid at rest: displacements of its nodes (n, 3), m, and how they were `found`."""

    solid: Solid
    displacement: Floats
    found: statics.Equilibrium

    def at(self, X: Any, beyond: float = 0.0) -> Floats:
        """Displacements (p, 3) at points X (p, 3) of the undeformed body, m; see `Solid.at`. Raises ValueError."""
        return self.solid.at(X, self.displacement, beyond)


@dataclass(frozen=True)
class InMotion:
    """A solid in motion: `times` (t,) in s, displacements of its nodes (t, n, 3), m, and how they were `found`."""

    solid: Solid
    times: Floats
    displacement: Floats
    found: Trajectory

    def at(self, X: Any, beyond: float = 0.0) -> Floats:
        """Displacements (t, p, 3) at points X (p, 3) of the undeformed body, m; see `Solid.at`. Raises ValueError."""
        return np.array([self.solid.at(X, u, beyond) for u in self.displacement])


def equilibrium(
    solid: Solid,
    clamps: Sequence[Clamp],
    loads: Sequence[Energy],
    tolerance: float = 1e-8,
    max_iterations: int = 50,
) -> AtRest:
    """Where a solid comes to rest: stable, without inverted cells, to a relative out-of-balance force `tolerance`.

    Raises NotConverged, which has the history, and ValueError where clamps leave a rigid motion, or nothing to deform.
    """
    fixed, target = held(solid, clamps)
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
    courses: Sequence[Course] = (),
    tolerance: float = 1e-6,
) -> InMotion:
    """The motion of a solid from its undeformed shape, for `duration` in steps of `step`, s.

    `integrator` is a key of INTEGRATORS; `damping` are a (1/s) and b (s) of C = a M + b K; `velocity` is that of the
    start, of all nodes (3,) or of each (n, 3), m/s. `courses` say how each load grows in time: in full from the start
    without them. An explicit integrator has a lumped mass. Raises NotConverged, Diverged, StepTooLong, and ValueError.
    """
    if integrator not in INTEGRATORS:
        raise ValueError(f"no integrator is called {integrator!r}: there are {', '.join(INTEGRATORS)}")
    fixed, target = held(solid, clamps, free=True)
    size, way = solid.points.size, INTEGRATORS[integrator]()
    problem = Dynamics(
        Assembly(size, fixed, [solid.energy(solid.strain)], list(loads)),
        solid.mass(lumped=way.explicit),
        np.zeros(size),
        np.broadcast_to(np.asarray(velocity, dtype=np.float64), solid.points.shape).ravel(),
        fixed,
        target,
        courses=tuple(courses),
        damping=Rayleigh(*damping),
        integrator=way,
        tolerance=tolerance,
        sound=solid.sound,
    )
    found = marching.march(problem, duration, step, lambda motion: motion.x.copy())
    return InMotion(solid, found.times, np.array(found.observed).reshape(len(found.times), -1, 3), found)
