"""Tendons of a rod in dynamics, over displacements and rotation vectors."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.incremental_rotation import moving_rod_kernels
from softmark.solvers.energies.incremental_rotation.moving_rods import NO_DATA, NO_FORCES, NO_SLOTS, RodChart
from softmark.solvers.energies.rod_tendons import RodTendons


@dataclass(frozen=True)
class MovingRodTendons(Energy):
    """Tendons of a rod over the unknowns of a chart, compiled in one loop over the elements.

    `tendons` is the energy of the same tendons in static analysis.
    """

    chart: RodChart
    tendons: RodTendons
    conservative: bool = False

    @property
    def stencils(self) -> Ints:
        """Stencils of the tendons."""
        return self.tendons.stencils

    @cached_property
    def _kernel_arrays(self) -> Any:
        """Elements, lengths, arms, slopes and tensions, as arrays for the kernel."""
        own = self.tendons
        arrays = (own.arms, own.slopes, own.tension[:, None] * own.shares)
        return np.ascontiguousarray(own.elements), own.lengths, *(np.ascontiguousarray(a) for a in arrays)

    def _assemble_tendons(
        self, x: Floats, scale: float, g: Floats = NO_FORCES, slots: Any = NO_SLOTS, data: Floats = NO_DATA
    ) -> float:
        """Return the energy, J, and add `scale` times the forces to `g` and the tangent to `data`, if given."""
        at, q, T = self.chart.positions_and_rotations(x)
        elements, l, arms, slopes, pulls = self._kernel_arrays
        return float(
            moving_rod_kernels.assemble_tendons(at, q, T, elements, l, arms, slopes, pulls, scale, g, slots, data)
        )

    def value(self, x: Floats) -> float:
        """Return the potential, zero in the undeformed state, J."""
        return self._assemble_tendons(x, 1.0) - float(self.tendons.tension @ self.tendons.at_rest)

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Subtract the tendon forces, N, and their moments about the nodes' own axes, N m, from g."""
        self._assemble_tendons(x, scale, g.reshape(-1, 6))

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent of the forces; if `projected`, the projected tangent of the static tendon energy."""
        if projected:
            self.tendons.add_hessian(self.chart.state(x), data, slots, scale, True)
        else:
            self._assemble_tendons(x, scale, NO_FORCES, slots, data)

    def rounding(self, x: Floats) -> float:
        """Return zero: the rounding error of this load is far below that of the rod."""
        return 0.0
