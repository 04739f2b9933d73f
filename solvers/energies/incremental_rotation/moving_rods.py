"""Rod energies in dynamics, over nodal displacements and rotation vectors counted from the start of a time step.

Within a step the unknowns of a node are its displacement from rest and a rotation vector theta about its own axes: the
rotation is q = q0 exp(theta / 2). `RodChart` holds q0 and updates it when a step is accepted. So theta stays below the
rotation of one step, a rod may rotate without limit, and rotations are never added as vectors. Forces are nodal forces,
with moments about the nodes' own axes; their tangent is the derivative by the unknowns.

To add an energy, write a class like `MovingRod`.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats, Ints, no_stencils
from softmark.solvers.energies.geometrically_exact_rod import RodElastic
from softmark.solvers.energies.incremental_rotation import moving_rod_kernels
from softmark.solvers.energies.local_blocks import add_blocks, cross_matrix, project_semidefinite

# empty arguments that switch off parts of the kernel
NO_SLOTS: Any = np.zeros((0, 12, 12), dtype=np.int32)  # same type as in a sparsity pattern
Rotated = tuple[Floats, Floats, Floats]  # positions (n, 3), rotations (n, 4), d(turn)/d(unknowns) (n, 3, 3)
NO_FORCES, NO_DATA = np.zeros((0, 6)), np.zeros(0)


class RodChart:
    """Rotation chart of a rod: the reference rotations q0 (nodes, 4) from which rotation vectors are counted.

    q0 are the rotations at the start of the current time step. `rest` (nodes * 7,) is the undeformed state.
    """

    def __init__(self, rest: Floats) -> None:
        nodes = rest.reshape(-1, 7)
        self.X = np.ascontiguousarray(nodes[:, :3])
        self._q_rest = np.ascontiguousarray(nodes[:, 3:])
        count = len(nodes)
        self.at, self.q, self.T = np.empty((count, 3)), np.empty((count, 4)), np.empty((count, 3, 3))
        self.reset()

    def reset(self) -> None:
        """Set the reference rotations to those of the undeformed state."""
        self.q0 = self._q_rest.copy()
        self._known = b""  # bytes of the unknowns to which `at`, `q` and `T` belong (fast to compare)
        self._state: Floats | None = None  # cached state of the same unknowns

    def positions_and_rotations(self, x: Floats) -> Rotated:
        """Return positions, rotations and rotation derivatives of the nodes for unknowns x (nodes * 6,).

        Positions (n, 3), m, and unit quaternions (n, 4) are followed by the derivatives (n, 3, 3) of rotations about
        the nodes' own axes by the rotation vectors. The arrays are overwritten by the next call.
        """
        if (known := x.tobytes()) != self._known:
            moving_rod_kernels.update_rotations(x.reshape(-1, 6), self.X, self.q0, self.at, self.q, self.T)
            self._known, self._state = known, None
        return self.at, self.q, self.T

    def state(self, x: Floats) -> Floats:
        """Return the state (nodes * 7,), positions and quaternions, for unknowns x (nodes * 6,)."""
        at, q, _ = self.positions_and_rotations(x)
        if self._state is None:
            self._state = np.concatenate([at, q], axis=1).ravel()
        return self._state

    def rebase(self, x: Floats) -> Floats:
        """Make the rotations in state x the reference rotations, and return x with zero rotation vectors."""
        q = self.positions_and_rotations(x)[1]
        self.q0 = q / np.linalg.norm(q, axis=1, keepdims=True)  # rounding would change the unit length
        self._known = b""
        new = x.reshape(-1, 6).copy()
        new[:, 3:] = 0.0
        return new.ravel()


@dataclass(frozen=True)
class MovingRod(Energy):
    """Strain energy of an `elastic` rod over the unknowns of a chart.

    The rod has a potential, but its nodal forces are not the gradient by rotation vectors. So `conservative` is False,
    and Newton steps are judged by the residual.
    """

    chart: RodChart
    elastic: RodElastic
    conservative: bool = False

    @property
    def stencils(self) -> Ints:
        """Stencils of the static rod energy."""
        return self.elastic.stencils

    @cached_property
    def _kernel_arrays(self) -> Any:
        """Elements, lengths, stiffnesses and rest strains, as arrays for the kernel."""
        rod = self.elastic
        C = np.array(np.broadcast_to(rod.stiffness.diagonal, rod.rest_strains.shape))  # a copy: views are read-only
        return np.ascontiguousarray(rod.elements), rod.lengths, C, rod.rest_strains - rod.offset

    def _assemble_rod(
        self, turned: Rotated, scale: float, g: Floats = NO_FORCES, slots: Any = NO_SLOTS, data: Floats = NO_DATA
    ) -> float:
        """Return the energy, J, and add `scale` times the forces to `g` and the tangent to `data`, if given."""
        at, q, T = turned
        elements, l, C, rest = self._kernel_arrays
        return float(moving_rod_kernels.assemble_rod(at, q, T, elements, l, C, rest, scale, g, slots, data))

    def value(self, x: Floats) -> float:
        """Return the strain energy, J."""
        return self._assemble_rod(self.chart.positions_and_rotations(x), 1.0)

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the nodal forces, N, and the moments about the nodes' own axes, N m."""
        self._assemble_rod(self.chart.positions_and_rotations(x), scale, g.reshape(-1, 6))

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent of the forces, or if `projected` a positive semi-definite one.

        The latter is the projected symmetric part of the tangent by own-axis rotations.
        """
        if projected:
            self._add_semidefinite_tangent(x, data, slots, scale)
        else:
            self._assemble_rod(self.chart.positions_and_rotations(x), scale, NO_FORCES, slots, data)

    def _add_semidefinite_tangent(self, x: Floats, data: Floats, slots: Ints, scale: float) -> None:
        """Add the symmetric part of the tangent by own-axis rotations, with negative eigenvalues set to zero."""
        at, q, T = self.chart.positions_and_rotations(x)
        own = np.zeros((len(self.elastic.elements), 12, 12))
        places = np.arange(own.size, dtype=slots.dtype).reshape(own.shape)
        plain = np.tile(np.eye(3), (len(T), 1, 1))
        self._assemble_rod((at, q, plain), 1.0, NO_FORCES, places, own.ravel())
        add_blocks(scale * project_semidefinite(0.5 * (own + own.swapaxes(1, 2))), slots, data)

    def rounding(self, x: Floats) -> float:
        """Return the rounding error of the forces, N, due to rounding of positions."""
        return self.elastic.rounding(self.chart.state(x))


@dataclass(frozen=True)
class MovingRodForces(Energy):
    """Dead nodal forces (nodes, 3), N, over displacements and rotation vectors."""

    forces: Floats
    conservative: bool = True

    @property
    def stencils(self) -> Ints:
        """Empty stencils: this load has no Hessian."""
        return no_stencils()

    def value(self, x: Floats) -> float:
        """Return the potential, zero in the undeformed state, J."""
        return -float(np.sum(self.forces * x.reshape(-1, 6)[:, :3]))

    @cached_property
    def _nodal_forces(self) -> Floats:
        """Forces as a vector over all unknowns (nodes * 6,), with zero moments."""
        return np.concatenate([self.forces, np.zeros_like(self.forces)], axis=1).ravel()

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Subtract the forces from the displacement entries: g -= scale f."""
        g -= scale * self._nodal_forces

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Do nothing: the forces are constant."""

    def rounding(self, x: Floats) -> float:
        """Return zero: the forces are constant."""
        return 0.0


@dataclass(frozen=True)
class MovingRodLoad(Energy):
    """A load of static rod analysis, expressed in the unknowns of a chart.

    `energy` is the load over positions and quaternions. Its stencils are the rotations of single nodes. Its Hessian is
    the second derivative along geodesics. By rotations about a node's own axes, the tangent of forces g about these
    axes is that Hessian plus [g]x / 2.
    """

    chart: RodChart
    energy: Energy
    conservative: bool = False

    @cached_property
    def stencils(self) -> Ints:
        """Stencils of the load. Raises ValueError if they are not the rotations of single nodes."""
        found = self.energy.stencils
        if found.size and not (found.shape[1] == 3 and np.array_equal(found, found[:, :1] // 6 * 6 + [3, 4, 5])):
            raise ValueError("the load does not act on the rotations of single nodes")
        return found

    def value(self, x: Floats) -> float:
        """Return the potential of the load, J."""
        return self.energy.value(self.chart.state(x))

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Subtract the forces, N, and the moments about the nodes' own axes, N m, from g."""
        self.energy.add_gradient(self.chart.state(x), g, scale)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent of the forces; if `projected`, the projected tangent of the static load."""
        state = self.chart.state(x)
        if projected:
            self.energy.add_hessian(state, data, slots, scale, True)
            return
        g, local = np.zeros(len(x)), np.zeros((*self.stencils.shape, 3))
        self.energy.add_gradient(state, g)
        self.energy.add_hessian(state, local.reshape(-1), np.arange(local.size).reshape(local.shape))
        local += cross_matrix(0.5 * g[self.stencils])
        add_blocks(scale * local @ self.chart.positions_and_rotations(x)[2][self.stencils[:, 0] // 6], slots, data)

    def rounding(self, x: Floats) -> float:
        """Return the rounding error of the load forces, N."""
        return self.energy.rounding(self.chart.state(x))
