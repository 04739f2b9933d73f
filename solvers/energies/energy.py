"""Interface of all energies, and of the configuration space in which a state moves.

To add an energy, derive a class from `Energy` or `LaggedTangentEnergy`, and override the members that differ from the
defaults.
"""

from __future__ import annotations

from typing import Any, ClassVar, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SLACK = 1e-6  # fraction of 1/mu added to 1/K when a mixed solid is factorised (linear/saddle_point.py)


def no_stencils() -> Ints:
    """Return empty stencils (0, 0), for an energy without a Hessian."""
    return np.zeros((0, 0), dtype=np.int64)


class Energy(Protocol):
    """Interface of an energy: value, gradient and Hessian over local stencils of degrees of freedom."""

    saddle: ClassVar[bool] = False  # unknowns include pressures, in which the energy is a maximum
    resists_rigid_motion: ClassVar[bool] = False  # it resists rigid-body motion
    integrates_cells: ClassVar[bool] = False  # it integrates a law over cells, with or without pressures
    reaction_nodes: Any = None  # nodes (n,) of its reaction, if the sum over all nodes vanishes; None: all
    not_proportional: ClassVar[bool] = False  # a load not proportional to its factor; its method `at` evaluates it

    @property
    def has_friction(self) -> bool:
        """True if the energy contains friction that depends on the present pressure, which has no potential.

        Its method `lagged` returns the energy with constant friction limits, which has a potential.
        """
        return False

    def interaction_state(self, x: Floats, before: Any) -> Any:
        """Return the `InteractionState` that the energy carries on from a solved state x; None if it has none.

        `before` is its state after the previous solved state, or None.
        """
        return None

    def resumed(self, state: Any, x: Floats) -> Self:
        """Return the same energy, continued from its `InteractionState` at the solved state x."""
        return self

    @property
    def conservative(self) -> bool:
        """False for follower loads, which have a force and a tangent but no value."""

    @property
    def stencils(self) -> Ints:
        """Degrees of freedom (n, k) of each local Hessian block; (0, 0) where there is none."""

    def value(self, x: Floats) -> float:
        """Return the energy, J; infinite outside the domain of the law."""

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the gradient: g (dofs,) += scale * dE/dx, in N (and N m for rotations)."""

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the Hessian: data (nnz,) += scale * d2E/dx2 at `slots` (n, k, k), skipping negative slots.

        `projected` makes every local block positive semi-definite first.
        """

    def rounding(self, x: Floats) -> float:
        """Return the norm of the rounding error in the gradient, N; a residual below it counts as zero."""


class DampedEnergy(Energy):
    """An energy with additional linear damping forces C v; C is constant and positive semi-definite."""

    @property
    def has_dashpots(self) -> bool:
        """True if any dashpots are present."""
        raise NotImplementedError(f"{type(self).__name__} does not say whether it has dashpots")

    def add_drag(self, v: Floats, f: Floats) -> None:
        """Add the damping forces: f (dofs,) += C v, N, for velocities v, m/s."""
        raise NotImplementedError(f"{type(self).__name__} has no dashpots")

    def add_damping(self, data: Floats, slots: Ints) -> None:
        """Add the damping matrix: data (nnz,) += C at the slots of the Hessian, N s/m."""
        raise NotImplementedError(f"{type(self).__name__} has no dashpots")


class DynamicPatternEnergy(Energy):
    """An energy whose sparsity pattern changes as bodies come into contact; it returns its own sparse Hessian.

    A straight path between two states may be inadmissible, because bodies would pass through each other. `limit`
    returns the admissible part.
    """

    @property
    def stencils(self) -> Ints:
        """Empty stencils: the coupled unknowns change from state to state."""
        return no_stencils()

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Do nothing: `matrix` returns the whole Hessian instead."""

    def matrix(self, x: Floats, projected: bool = False) -> Any:
        """Return the Hessian d2E/dx2 as a sparse matrix (dofs, dofs), N/m; positive semi-definite if `projected`."""
        raise NotImplementedError(f"{type(self).__name__} has no Hessian")

    def limit(self, x: Floats, d: Floats) -> float:
        """Return the largest admissible fraction, at most 1, of an increment d (dofs,) from the state x."""
        raise NotImplementedError(f"{type(self).__name__} does not know how far a way leads")

    @property
    def largest_support_step(self) -> float:
        """Largest admissible motion of supports, m, between two consecutive equilibrium solutions."""
        return np.inf


class LaggedTangentEnergy(Energy):
    """An energy whose tangent can take part of the stress from an earlier state.

    An example is the pressure of nearly incompressible cells. In an extrapolated state this pressure is wrong and makes
    the tangent indefinite. The lagged part of the stress is described by `lagged_size` values.
    """

    @property
    def lagged_size(self) -> int:
        """Number of values that describe the lagged part of the stress in one state."""
        raise NotImplementedError(f"{type(self).__name__} keeps nothing of a state")

    def has_no_inverted_cells(self, x: Floats) -> bool:
        """Return whether no cell is inverted in state x."""
        raise NotImplementedError(f"{type(self).__name__} does not know what is inside out")

    def add_gradient_and_lagged(self, x: Floats, g: Floats, traces: Floats) -> None:
        """Add the gradient, and write the lagged values of the state x into `traces` (lagged_size,)."""
        raise NotImplementedError(f"{type(self).__name__} keeps nothing of a state")

    def add_both_lagged(self, x: Floats, g: Floats, data: Floats, slots: Ints, traces: Floats) -> None:
        """Add the gradient and the Hessian, with the lagged part of the Hessian from `traces` (lagged_size,)."""
        raise NotImplementedError(f"{type(self).__name__} has no lagged tangent")


class Space(Protocol):
    """Interface of a configuration space: how an increment of the degrees of freedom changes a state."""

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom."""

    def move(self, x: Floats, d: Floats) -> Floats:
        """Return the state that follows from the state x by the increment d (dofs,)."""


@dataclass(frozen=True)
class VectorSpace:
    """Vector space of displacements: the state is the vector of degrees of freedom."""

    dofs: int

    def move(self, x: Floats, d: Floats) -> Floats:
        """Return x + d."""
        return x + d
