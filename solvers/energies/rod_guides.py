"""Tendons of a rod that run straight between guides (discs or eyelets along the rod), without friction.

The energy is the tension times the length, as in `rod_tendons`. The length is that of the chords between the guides,
which are material points p = x + R a of sections. With t = (p_j - p_i) / |p_j - p_i|, each of the two chords at a guide
pulls it with the force T t, and the section also takes the moment of this force about its node. Tangents are second
derivatives along geodesics, as in `rod_loads`.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.local_blocks import RodElementEnergy, cross_matrix
from softmark.solvers.energies.rod_rotation import rotation

SHORT = 1e-300  # m


@dataclass(frozen=True)
class GuidedTendon(RodElementEnergy):
    """Tendon under `tension` T, N, that runs straight between guides.

    The guides are at offsets `arms` (g, 3), m, from `nodes` (g,), in the order of the tendon. E = T sum of |p_j - p_i|,
    minus its value at rest, J.
    """

    rest: Floats
    nodes: Ints
    arms: Floats
    tension: float
    conservative: bool = True

    @cached_property
    def elements(self) -> Ints:
        """Nodes of every pair of neighbouring guides (g - 1, 2)."""
        return np.stack([self.nodes[:-1], self.nodes[1:]], axis=1)

    def _chord_kinematics(self, x: Floats) -> tuple[Floats, Floats, Floats]:
        """Return rotations of the sections (g, 3, 3), chord directions (g - 1, 3) and chord lengths (g - 1,), m."""
        own = x.reshape(-1, 7)[self.nodes]
        R = rotation(own[:, 3:])
        p = own[:, :3] + (R @ self.arms[:, :, None])[:, :, 0]
        r = np.diff(p, axis=0)
        size = np.maximum(np.sqrt(np.einsum("ci,ci->c", r, r)), SHORT)
        return R, r / size[:, None], size

    @cached_property
    def _rest_chord_lengths(self) -> Floats:
        return self._chord_kinematics(self.rest)[2]

    def value(self, x: Floats) -> float:
        """Return the potential, zero in the undeformed state, J."""
        return self.tension * float((self._chord_kinematics(x)[2] - self._rest_chord_lengths).sum())

    def nearest(self, x: Floats) -> Floats:
        """Return the smallest ratio of current to initial distance between neighbouring guides (1,)."""
        found: Floats = (self._chord_kinematics(x)[2] / self._rest_chord_lengths).min(keepdims=True)
        return found

    def _chord_end_derivatives(self, R: Floats) -> Floats:
        """Return the derivatives of the two ends of each chord by their sections (2, g - 1, 3, 6): 1 and -R [a]x."""
        by = np.empty((len(R), 3, 6))
        by[:, :, :3] = np.eye(3)
        by[:, :, 3:] = -R @ cross_matrix(self.arms)
        return np.stack([by[:-1], by[1:]])

    def local_forces(self, x: Floats) -> Floats:
        """Return the gradient of each chord (g - 1, 12), N and N m."""
        R, t, _ = self._chord_kinematics(x)
        first, second = (self.tension * t[:, None] @ by for by in self._chord_end_derivatives(R))
        return np.concatenate([-first, second], axis=2)[:, 0]

    def local_hessians(self, x: Floats) -> Floats:
        """Return the Hessian of each chord (g - 1, 12, 12)."""
        R, t, size = self._chord_kinematics(x)
        first, second = self._chord_end_derivatives(R)
        J = np.concatenate([-first, second], axis=2)
        across = (self.tension / size)[:, None, None] * (np.eye(3) - t[:, :, None] * t[:, None])
        found: Floats = J.swapaxes(1, 2) @ across @ J
        for side, own, sign in ((slice(None, -1), slice(3, 6), -1.0), (slice(1, None), slice(9, 12), 1.0)):
            F = sign * self.tension * (t[:, None] @ R[side])[:, 0]  # force that pulls the end back, in material axes
            a = self.arms[side]
            both = F[:, :, None] * a[:, None]
            found[:, own, own] += 0.5 * (both + both.swapaxes(1, 2))
            found[:, own, own] -= np.einsum("ci,ci->c", F, a)[:, None, None] * np.eye(3)
        return found

    def rounding(self, x: Floats) -> float:
        """Return zero: the rounding error of this load is far below that of the rod."""
        return 0.0
