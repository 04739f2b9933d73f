"""Tendons of a rod: lines under tension through material points off the rod axis, without friction.

A tendon under a prescribed tension T acts like a weight on a cord over a pulley. Its energy is T times its length, and
forces and tangents follow from that. In the material axes of a section, the direction of the tendon is

    y = Gamma + K x a + a',   length = integral of |y| ds,   t = y / |y|

with Gamma (stretch and shears, e1 when straight) and K (twist and curvatures) of the rod, and a(s) the arm from the rod
axis to the tendon. The tendon adds T t to the force and a x T t to the moment of the section.
Source: Rucker and Webster (2011), IEEE Trans. Robot. 27, 1033-1044, whose equilibrium equations are the derivative of
that energy.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.local_blocks import RodElementEnergy, cross_matrix
from softmark.solvers.energies.rod_kinematics import RodElements, cached_elements
from softmark.solvers.energies.rod_state import lengths

SHORT = 1e-12  # fraction of a segment: shorter vectors have no direction


@dataclass(frozen=True)
class RodTendons(RodElementEnergy):
    """Potential energy of k tendons along a rod of m two-node elements, each tendon under a prescribed tension.

    E = sum of T l c |Gamma + K x a + a'| over tendons and elements, minus its value at rest, J, by one-point quadrature
    as in the rod. `tension` (k,) is T, N, and l the length of an element, m. `arms` (k, m, 3) are the vectors a, m,
    from the rod axis to the tendon in the middle of each element, and `slopes` (k, m, 3) their derivatives a' along the
    axis. Gamma and K are the strains and curvatures of the rod. `shares` (k, m) are c, the fraction of each element
    along which the tendon runs.
    """

    rest: Floats
    elements: Ints
    arms: Floats
    slopes: Floats
    shares: Floats
    tension: Floats
    conservative: bool = True

    @cached_property
    def lengths(self) -> Floats:
        """Undeformed lengths (m,) of the elements, m."""
        return lengths(self.rest, self.elements)

    def joined(self, other: RodTendons) -> RodTendons:
        """Return the tendons of both sets as one energy; both must be on the same rod."""
        both = [(t.arms, t.slopes, t.shares, t.tension) for t in (self, other)]
        arms, slopes, shares, tension = (np.concatenate(pair) for pair in zip(*both, strict=True))
        return RodTendons(self.rest, self.elements, arms, slopes, shares, tension)

    def _directions_and_lengths(self, segments: RodElements) -> tuple[Floats, Floats]:
        """Return the direction vector y (k, m, 3) of each tendon in each element, and |y| (k, m).

        y = Gamma + K x a + a' is the derivative of the tendon's position along the rod.
        """
        y: Floats = (self._direction_derivatives @ segments.strains[:, :, None])[..., 0] + self.slopes
        return y, np.maximum(np.sqrt(np.einsum("kmi,kmi->km", y, y)), SHORT)

    @cached_property
    def _direction_derivatives(self) -> Floats:
        """Derivative (k, m, 3, 6) of the tendon direction y by the rod's strains Gamma and curvatures K.

        With the arm a from the rod axis to the tendon, y = Gamma + K x a + a'. The derivative by Gamma is the unit
        matrix, and the derivative by K is the matrix of -a x.
        """
        unit = np.broadcast_to(np.eye(3), (*self.arms.shape, 3))
        return np.concatenate([unit, -cross_matrix(self.arms)], axis=3)

    def tendon_lengths(self, x: Floats) -> Floats:
        """Return the lengths of the tendons (k,) in state x, m."""
        found: Floats = (
            self.shares
            * self.lengths
            * self._directions_and_lengths(cached_elements(x, self.elements, self.lengths))[1]
        ).sum(1)
        return found

    @cached_property
    def at_rest(self) -> Floats:
        """Lengths of the tendons (k,) in the undeformed state, m."""
        return self.tendon_lengths(self.rest)

    def nearest(self, x: Floats) -> Floats:
        """Return the smallest ratio of current to initial distance between neighbouring points of each tendon (k,)."""
        now, then = (
            self._directions_and_lengths(cached_elements(s, self.elements, self.lengths))[1] for s in (x, self.rest)
        )
        found: Floats = np.where(self.shares > 0.0, now / then, np.inf).min(axis=1)
        return found

    def value(self, x: Floats) -> float:
        """Return the potential, zero in the undeformed state, J."""
        return float(self.tension @ (self.tendon_lengths(x) - self.at_rest))

    @cached_property
    def _tension_weights(self) -> Floats:
        """Products T l c of tension, element length and fraction (k, m), N m."""
        return np.asarray(self.tension[:, None] * self.shares * self.lengths)

    def _tendon_resultants(self, segments: RodElements) -> Floats:
        """Return the section forces and moments that the tendons add in each element, times its length (m, 6)."""
        y, size = self._directions_and_lengths(segments)
        pull = (self._tension_weights / size)[:, :, None] * y
        found: Floats = (pull[:, :, None] @ self._direction_derivatives)[:, :, 0].sum(axis=0)
        return found

    def local_forces(self, x: Floats) -> Floats:
        """Return the gradient of each element (m, 12), N and N m."""
        segments = cached_elements(x, self.elements, self.lengths)
        return segments.forces(self._tendon_resultants(segments))

    def local_hessians(self, x: Floats) -> Floats:
        """Return the Hessian of each element (m, 12, 12).

        It contains (1 - t t^T) / |y| and the second derivatives of the strains.
        """
        segments = cached_elements(x, self.elements, self.lengths)
        y, size = self._directions_and_lengths(segments)
        t = y / size[:, :, None]
        across = np.eye(3) - t[..., :, None] * t[..., None, :]
        weight = (self._tension_weights / size)[:, :, None, None]
        D = (self._direction_derivatives.swapaxes(2, 3) @ (weight * (across @ self._direction_derivatives))).sum(axis=0)
        B = segments.gradients
        found: Floats = B.swapaxes(1, 2) @ D @ B
        return found + segments.hessians(self._tendon_resultants(segments), np.zeros((len(self.lengths), 6)))

    def rounding(self, x: Floats) -> float:
        """Return zero: the rounding error of this load is far below that of the rod."""
        return 0.0
