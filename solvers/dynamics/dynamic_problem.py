"""A problem of dynamics: energies, mass, damping, supports, loads and their course in time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import TYPE_CHECKING, Protocol

import numpy as np
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics.integrator import Integrator
from softmark.solvers.dynamics.load_amplitudes import Constant, Course
from softmark.solvers.dynamics.trapezoidal_rule import Trapezoidal
from softmark.solvers.energies.energy import DynamicPatternEnergy, Floats, Ints
from softmark.solvers.linear.factorisations import factor

if TYPE_CHECKING:
    from softmark.solvers.dynamics.rotational_inertia import Turning
    from softmark.solvers.dynamics.viscoelastic_step import Remembering

CONSTANT = Constant()
BEGUN = 1e-6  # share of a way over which its direction is measured


class Way(Protocol):
    """How what is imposed comes to its full size, where that is not in proportion: turns about an axis."""

    def at(self, share: float) -> Floats:
        """What is imposed (c,), increments from rest, m, at a share of the whole."""


class StepLinearSolver(Protocol):
    """Solves one system after the other; may keep what it knows of a pattern from step to step."""

    def solve(self, K: sparse.csr_matrix, b: Floats, tolerance: float) -> Floats:
        """x with |K x - b| <= tolerance |b|. Raises linear.Singular where it cannot."""


@dataclass(frozen=True)
class Direct:
    """Factorises every matrix anew."""

    symmetric: bool = True

    def solve(self, K: sparse.csr_matrix, b: Floats, tolerance: float) -> Floats:
        """x with K x = b to rounding. Raises Singular."""
        return factor(K, symmetric=self.symmetric).solve(b)


@dataclass(frozen=True)
class Rayleigh:
    """Damping C = alpha M + beta K, `alpha` in 1/s, `beta` in s (Rayleigh 1877; Clough and Penzien 1993, section 12-5).

    A mode of angular frequency w gets the damping ratio alpha/(2 w) + beta w/2. K is the tangent, made positive
    semi-definite, so that damping never drives, in the state to which the velocity of the equations belongs: the
    end of the step, or its middle where that is the mean velocity. It is foreseen, and a step is made again where
    it was another one, so that its equations stay those of a minimum; capped steps keep that of their start, as
    programs with so few iterations do. alpha M brakes rigid
    motion as well; beta K does not touch translations, and slightly brakes the rotation of a stressed body.
    """

    alpha: float = 0.0
    beta: float = 0.0


@dataclass(frozen=True)
class Dynamics:
    """M a + C v + dE/dx = 0, E(x, t) = internal energies + sum_i courses_i(t) loads_i, from `rest` at time 0.

    A state is its own degrees of freedom (`VectorSpace`): displacements of solids or of particles; with `turning`
    also rotation vectors, which are counted anew from every accepted step (rotational_inertia.py). `mass` is a
    sparse matrix or its diagonal (dofs,), in kg. The degrees of freedom `fixed` are at rest + target *
    support_course(t); their velocities and accelerations are central differences of that course over one step,
    so that it is asked for times a step before 0 and a step after the end too. `assembly.loads` follow `courses`,
    one for each, by their means over each step (load_amplitudes.py); none means constant.

    A step is solved by Newton's method until the out-of-balance force is at most `tolerance` times the largest
    of the forces that balance each other: inertia, internal forces with the reactions of supports, loads, damping,
    now or at the start of the step; or until rounding is all that is left of it.

    With `lagged`, a step whose internal energies all offer it (`lagged.Lagging`), under a potential and dead loads, is
    first tried with one lagged tangent; to the same tolerance, sooner. Where that does not come to an end, Newton's
    method takes the step.

    `cap` is a number of iterations after which an implicit step is accepted although it is not solved, as many
    real-time codes do; the trajectory says which steps were and what residual was left. With cap = 1 and without
    `lagged` a step is the linearly implicit one (Baraff and Witkin 1998).

    The last `pulling` of the loads are muscle, whose work is told by itself.

    With `remembering`, internal energies are those that its memories make of every step.

    What `meets` are surfaces that both deform: they keep clear of each other at the end of every step
    (dynamic_contact.py).

    With a `way` supports are at rest + way.at(support_course(t)) instead.

    `sound` says whether a state may be accepted. A step that fails is halved, down to `shortest` times the step.
    """

    assembly: Assembly
    mass: sparse.csr_matrix | Floats
    rest: Floats  # (dofs,)
    velocity: Floats  # (dofs,)
    fixed: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))  # (c,)
    target: Floats = field(default_factory=lambda: np.zeros(0))  # (c,) m
    support_course: Course = CONSTANT
    courses: tuple[Course, ...] = ()
    damping: Rayleigh = Rayleigh()
    integrator: Integrator = field(default_factory=Trapezoidal)
    tolerance: float = 1e-8
    max_iterations: int = 20
    shortest: float = 2.0**-10
    linear: StepLinearSolver | None = None  # None: the one that suits
    lagged: bool = True
    cap: int | None = None
    sound: Callable[[Floats], bool] = field(default=lambda x: True)
    turning: Turning | None = None
    remembering: Remembering | None = None
    pulling: int = 0
    way: Way | None = None
    meets: tuple[DynamicPatternEnergy, ...] = ()

    @property
    def moves(self) -> bool:
        """Whether supports move."""
        return self.way is not None or bool(np.any(self.target))

    @property
    def direction(self) -> Floats:
        """Which way supports begin to move (c,), per share of their course."""
        return self.target if self.way is None else (self.way.at(BEGUN) - self.way.at(-BEGUN)) / (2.0 * BEGUN)

    def imposed(self, share: float) -> Floats:
        """What supports impose (c,), increments from rest, at a share of their full motion."""
        return share * self.target if self.way is None else self.way.at(share)

    def __post_init__(self) -> None:
        """Raises ValueError where the parts do not fit together."""
        if self.cap is not None and self.cap < 1:
            raise ValueError("a cap of less than one iteration")
        loads = len(self.assembly.loads)
        if self.courses and len(self.courses) != loads:
            raise ValueError(f"{len(self.courses)} courses for {loads} loads")
        if len(self.target) not in (0, len(self.fixed)):
            raise ValueError(f"{len(self.target)} targets for {len(self.fixed)} supports")
        dofs = self.assembly.dofs
        if self.mass.shape not in ((dofs,), (dofs, dofs)):
            raise ValueError(f"a mass of shape {self.mass.shape} for {dofs} degrees of freedom")
        if not self.integrator.explicit or self.mass.ndim == 1:
            return
        raise ValueError("an explicit integrator needs a lumped mass")
