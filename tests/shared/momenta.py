"""Momenta of a motion, which no force within a body changes."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from softmark.solvers.dynamics.mass_matrices import multiply_mass
from softmark.solvers.energies.energy import Floats


def linear_momentum(mass: sparse.csr_matrix | Floats, v: Floats) -> Floats:
    """sum_a (M v)_a, (3,), kg m/s."""
    total: Floats = multiply_mass(mass, v).reshape(-1, 3).sum(axis=0)
    return total


def angular_momentum(mass: sparse.csr_matrix | Floats, positions: Floats, v: Floats) -> Floats:
    """sum_a x_a x (M v)_a about the origin, (3,), kg m^2/s, for current `positions` (n, 3)."""
    total: Floats = np.cross(positions, multiply_mass(mass, v).reshape(-1, 3)).sum(axis=0)
    return total
