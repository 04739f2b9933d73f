"""Definition of a dynamic problem: energies, mass, damping, supports, loads and their amplitudes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import TYPE_CHECKING, Protocol

import numpy as np
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics.integrator import Integrator
from softmark.solvers.dynamics.load_amplitudes import Amplitude, Constant
from softmark.solvers.dynamics.trapezoidal_rule import Trapezoidal
from softmark.solvers.energies.energy import DynamicPatternEnergy, Floats, Ints
from softmark.solvers.linear.factorisations import factor

if TYPE_CHECKING:
    from softmark.solvers.dynamics.rotational_inertia import RotationalInertia
    from softmark.solvers.dynamics.viscoelastic_step import ViscoelasticStep

CONSTANT = Constant()
BEGUN = 1e-6  # share of a way over which its direction is measured


class SupportPath(Protocol):
    """Path of prescribed displacements that is not proportional to their final values, such as a rotation."""

    def at(self, share: float) -> Floats:
        """Return the prescribed increments from rest (c,), m, at a fraction `share` of the full motion."""


class StepLinearSolver(Protocol):
    """Interface of a linear solver for a sequence of systems; it may cache data of the sparsity pattern."""

    def solve(self, K: sparse.csr_matrix, b: Floats, tolerance: float) -> Floats:
        """Return x with |K x - b| <= tolerance |b|. Raises linear.Singular if this fails."""


@dataclass(frozen=True)
class DirectStepSolver:
    """Direct solver that factorises every matrix."""

    symmetric: bool = True

    def solve(self, K: sparse.csr_matrix, b: Floats, tolerance: float) -> Floats:
        """Return x with K x = b to rounding. Raises Singular."""
        return factor(K, symmetric=self.symmetric).solve(b)


@dataclass(frozen=True)
class Rayleigh:
    """Rayleigh damping C = alpha M + beta K, `alpha` in 1/s, `beta` in s (Clough and Penzien 1993, 12-5).

    A mode of angular frequency w gets the damping ratio alpha/(2 w) + beta w/2. K is the tangent stiffness, made
    positive semidefinite so that damping never adds energy. It is evaluated in the state to which the velocity in the
    equations belongs: the end of the step, or its middle if this velocity is the mean. The state is predicted, and the
    step is repeated if the prediction was wrong, so that the equations remain those of a minimum. Steps with a cap on
    iterations keep the K of their start, as programs with so few iterations do. The term alpha M also damps rigid
    motion. The term beta K does not affect translations, and slightly damps the rotation of a stressed body.
    """

    alpha: float = 0.0
    beta: float = 0.0


@dataclass(frozen=True)
class Dynamics:
    """Dynamic problem M a + C v + dE/dx = 0, E(x, t) = internal energies + sum_i amplitudes_i(t) loads_i.

    The motion starts from `rest` at time 0.

    A state is its own vector of degrees of freedom (`VectorSpace`): displacements of solids or of particles; with
    `turning` also rotation vectors, counted from every accepted step (rotational_inertia.py). `mass` is a sparse matrix
    or its diagonal (dofs,), in kg. The degrees of freedom `fixed` are at rest + target * support_amplitude(t); their
    velocities and accelerations are central differences over one step, so the amplitude is evaluated one step before 0
    and one step after the end too. `assembly.loads` follow `amplitudes`, one for each, by their means over
    each step (load_amplitudes.py); by default they are constant.

    A step is solved by Newton's method until the residual is at most `tolerance` times the largest of the forces that
    balance each other (inertia, internal forces with support reactions, loads, damping, now or at the start of the
    step), or until only rounding error is left.

    With `lagged`, a step whose internal energies are all `LaggedTangentEnergy`, under a potential and dead loads, is
    first tried with one lagged tangent: same tolerance, faster. If that does not converge, Newton's method takes the
    step.

    `cap` is a number of iterations after which an implicit step is accepted although it has not converged, as many
    real-time codes do; the trajectory records such steps and their residuals. With max_iterations = 1 and without
    `lagged` a step is linearly implicit (Baraff and Witkin 1998).

    The last `pulling` of the loads are muscle, whose work is reported separately. With `remembering`, its viscoelastic
    histories supply the internal energies of every step. `meets` are contacts between deformable surfaces, which stay
    apart at the end of every step (dynamic_contact.py). With a `way`, supports are at rest +
    way.at(support_amplitude(t)) instead. `sound` returns whether a state may be accepted. A step that fails is halved,
    down to `shortest` times the step.
    """

    assembly: Assembly
    mass: sparse.csr_matrix | Floats
    rest: Floats  # (dofs,)
    velocity: Floats  # (dofs,)
    fixed: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))  # (c,)
    target: Floats = field(default_factory=lambda: np.zeros(0))  # (c,) m
    support_amplitude: Amplitude = CONSTANT
    amplitudes: tuple[Amplitude, ...] = ()
    damping: Rayleigh = Rayleigh()
    integrator: Integrator = field(default_factory=Trapezoidal)
    tolerance: float = 1e-8
    max_iterations: int = 20
    shortest: float = 2.0**-10
    linear: StepLinearSolver | None = None  # None: the one that suits
    lagged: bool = True
    cap: int | None = None
    sound: Callable[[Floats], bool] = field(default=lambda x: True)
    turning: RotationalInertia | None = None
    remembering: ViscoelasticStep | None = None
    pulling: int = 0
    way: SupportPath | None = None
    meets: tuple[DynamicPatternEnergy, ...] = ()

    @property
    def has_moving_supports(self) -> bool:
        """True if the supports move."""
        return self.way is not None or bool(np.any(self.target))

    @property
    def direction(self) -> Floats:
        """Initial direction (c,) of the support motion, per unit of the support amplitude."""
        return self.target if self.way is None else (self.way.at(BEGUN) - self.way.at(-BEGUN)) / (2.0 * BEGUN)

    def imposed(self, share: float) -> Floats:
        """Return the prescribed increments (c,) from rest at a fraction `share` of the full support motion."""
        return share * self.target if self.way is None else self.way.at(share)

    def __post_init__(self) -> None:
        """Check consistency. Raises ValueError if the parts do not fit together."""
        if self.cap is not None and self.cap < 1:
            raise ValueError("the iteration limit must be at least one")
        loads = len(self.assembly.loads)
        if self.amplitudes and len(self.amplitudes) != loads:
            raise ValueError(f"{len(self.amplitudes)} amplitudes for {loads} loads")
        if len(self.target) not in (0, len(self.fixed)):
            raise ValueError(f"{len(self.target)} targets for {len(self.fixed)} supports")
        dofs = self.assembly.dofs
        if self.mass.shape not in ((dofs,), (dofs, dofs)):
            raise ValueError(f"a mass of shape {self.mass.shape} for {dofs} degrees of freedom")
        if not self.integrator.explicit or self.mass.ndim == 1:
            return
        raise ValueError("an explicit integrator needs a lumped mass")
