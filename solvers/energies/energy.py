"""What every energy offers, and the space in which a state moves.

To add an energy: a class derived from `Energy`, or from `Lagging`, with its methods, and what of the rest is otherwise.
"""

from __future__ import annotations

from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SLACK = 1e-6  # of 1/mu: what a factor of a solid with pressures has for 1/K beyond its own (linear/saddle_point.py)


def no_stencils() -> Ints:
    """The stencils of an energy without a Hessian (0, 0)."""
    return np.zeros((0, 0), dtype=np.int64)


class Energy(Protocol):
    """A value, a gradient and a Hessian over local stencils of degrees of freedom."""

    saddle: ClassVar[bool] = False  # pressures are among its unknowns: of most energy in these
    grounded: ClassVar[bool] = False  # it feels a motion of the body as a whole
    cellular: ClassVar[bool] = False  # a law is integrated over cells, with or without pressures
    told: Any = None  # nodes (n,) whose forces are its reaction, where that of all adds up to nothing; None: all
    driven: ClassVar[bool] = False  # a load that is not in proportion to its share, and says what it is `at` one

    @property
    def rubs(self) -> bool:
        """Whether it has friction, which has an energy with what is `lagged`, and none without."""
        return False

    @property
    def conservative(self) -> bool:
        """False for follower loads, which have a force and a tangent but no value."""

    @property
    def stencils(self) -> Ints:
        """Degrees of freedom (n, k) of each local Hessian block; (0, 0) where there is none."""

    def value(self, x: Floats) -> float:
        """Energy in J; infinite outside the domain of the law."""

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """g (dofs,) += scale * dE/dx, in N (and N m for rotations)."""

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """data (nnz,) += scale * d2E/dx2 at `slots` (n, k, k), skipping negative slots.

        `projected` makes every local block positive semi-definite first.
        """

    def rounding(self, x: Floats) -> float:
        """Norm of what rounding leaves in the gradient, N: no state can be told from equilibrium below it."""


class Dashpots(Energy):
    """An energy beside which forces act in proportion to speeds, by a definite matrix that never changes."""

    @property
    def damps(self) -> bool:
        """Whether there are any."""
        raise NotImplementedError(f"{type(self).__name__} does not say whether it has dashpots")

    def add_drag(self, v: Floats, f: Floats) -> None:
        """f (dofs,) += C v, N, of velocities v, m/s."""
        raise NotImplementedError(f"{type(self).__name__} has no dashpots")

    def add_damping(self, data: Floats, slots: Ints) -> None:
        """data (nnz,) += C at the slots of the Hessian, N s/m."""
        raise NotImplementedError(f"{type(self).__name__} has no dashpots")


class Wandering(Energy):
    """An energy with a Hessian of its own, of unknowns that come to be coupled as bodies meet, and with states between
    which no straight way leads."""

    @property
    def stencils(self) -> Ints:
        """None: what is coupled changes."""
        return no_stencils()

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Nothing: `matrix` has it all."""

    def matrix(self, x: Floats, projected: bool = False) -> Any:
        """d2E/dx2, sparse (dofs, dofs), N/m; `projected` is positive semi-definite."""
        raise NotImplementedError(f"{type(self).__name__} has no Hessian")

    def limit(self, x: Floats, d: Floats) -> float:
        """The part of an increment d (dofs,) that can be gone, at most 1."""
        raise NotImplementedError(f"{type(self).__name__} does not know how far a way leads")

    @property
    def stride(self) -> float:
        """By how much supports may go on, m, before an equilibrium is sought."""
        return np.inf


class Lagging(Energy):
    """An energy whose tangent can take a part of its stress from earlier states.

    That part is one that an extrapolated state has wrong and that makes the tangent indefinite, such as the
    pressure of nearly incompressible cells; `kept` numbers describe it in a state.
    """

    @property
    def kept(self) -> int:
        """How many numbers describe the lagged part in a state."""
        raise NotImplementedError(f"{type(self).__name__} keeps nothing of a state")

    def sound(self, x: Floats) -> bool:
        """Whether no cell is inside out in a state."""
        raise NotImplementedError(f"{type(self).__name__} does not know what is inside out")

    def add_gradient_kept(self, x: Floats, g: Floats, traces: Floats) -> None:
        """`add_gradient` with scale 1, and the numbers of the state x into `traces` (kept,)."""
        raise NotImplementedError(f"{type(self).__name__} keeps nothing of a state")

    def add_both_lagged(self, x: Floats, g: Floats, data: Floats, slots: Ints, traces: Floats) -> None:
        """`add_gradient` and `add_hessian` at once, the lagged part of the tangent from `traces` (kept,)."""
        raise NotImplementedError(f"{type(self).__name__} has no lagged tangent")


class Space(Protocol):
    """How a state moves by an increment of its degrees of freedom."""

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom."""

    def move(self, x: Floats, d: Floats) -> Floats:
        """The state after the increment d (dofs,)."""


@dataclass(frozen=True)
class VectorSpace:
    """Displacements of points: a state is its own degrees of freedom."""

    dofs: int

    def move(self, x: Floats, d: Floats) -> Floats:
        """x + d."""
        return x + d
