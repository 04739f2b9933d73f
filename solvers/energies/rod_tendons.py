"""Tendons of a rod: lines under tension that follow material points beside its axis, without friction.

A tendon under a tension T that its course gives is a weight on a cord over a pulley: its energy is T times its length,
whatever it touches on its way, so that forces and tangents follow from that. In material axes its direction is

    y = Gamma + K x a + a',   length = integral of |y| ds,   t = y / |y|

with Gamma (stretch and shears, e1 when straight) and K (twist and curvatures) of the rod, a(s) the arm from its axis.
It adds T t to the force and a x T t to the moment that sections carry. Source: Rucker and Webster (2011), IEEE Trans.
Robot. 27, 1033-1044, whose equations of balance are the derivative of that energy.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.local_blocks import OverElements, cross_matrix
from softmark.solvers.energies.rod_kinematics import Segments, segments_of
from softmark.solvers.energies.rod_state import lengths

SHORT = 1e-12  # of a segment: what is shorter has no direction


@dataclass(frozen=True)
class RodTendons(OverElements):
    """Tendons (k,) under `tension` (k,), N, at `arms` (k, m, 3), m, in the middles of elements (m, 2).

    E = sum of T l c |Gamma + K x a + a'|, less its value at rest, J, by the rule of one point that the rod has;
    `slopes` (k, m, 3) are a', and `shares` (k, m) which part c of each element a tendon runs along.
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
        """Both, on the same rod."""
        both = [(t.arms, t.slopes, t.shares, t.tension) for t in (self, other)]
        arms, slopes, shares, tension = (np.concatenate(pair) for pair in zip(*both, strict=True))
        return RodTendons(self.rest, self.elements, arms, slopes, shares, tension)

    def _ways(self, segments: Segments) -> tuple[Floats, Floats]:
        """y (k, m, 3) and |y| (k, m)."""
        y: Floats = (self._by @ segments.strains[:, :, None])[..., 0] + self.slopes
        return y, np.maximum(np.sqrt(np.einsum("kmi,kmi->km", y, y)), SHORT)

    @cached_property
    def _by(self) -> Floats:
        """dy by Gamma and K (k, m, 3, 6): the unit matrix, and -[a]x."""
        unit = np.broadcast_to(np.eye(3), (*self.arms.shape, 3))
        return np.concatenate([unit, -cross_matrix(self.arms)], axis=3)

    def paths(self, x: Floats) -> Floats:
        """The lengths of the tendons (k,) in a state, m."""
        found: Floats = (self.shares * self.lengths * self._ways(segments_of(x, self.elements, self.lengths))[1]).sum(1)
        return found

    @cached_property
    def at_rest(self) -> Floats:
        """The same undeformed."""
        return self.paths(self.rest)

    def nearest(self, x: Floats) -> Floats:
        """To which part of their distance at rest the nearest neighbours among its guides have come (k,)."""
        now, then = (self._ways(segments_of(s, self.elements, self.lengths))[1] for s in (x, self.rest))
        found: Floats = np.where(self.shares > 0.0, now / then, np.inf).min(axis=1)
        return found

    def value(self, x: Floats) -> float:
        """Potential, zero in the undeformed state, J."""
        return float(self.tension @ (self.paths(x) - self.at_rest))

    @cached_property
    def _weights(self) -> Floats:
        """T l c (k, m), N m."""
        return np.asarray(self.tension[:, None] * self.shares * self.lengths)

    def _carried(self, segments: Segments) -> Floats:
        """l times the forces and moments that tendons add in the middles of the elements (m, 6)."""
        y, size = self._ways(segments)
        pull = (self._weights / size)[:, :, None] * y
        found: Floats = (pull[:, :, None] @ self._by)[:, :, 0].sum(axis=0)
        return found

    def local_forces(self, x: Floats) -> Floats:
        """The gradient of each element (m, 12), N and N m."""
        segments = segments_of(x, self.elements, self.lengths)
        return segments.forces(self._carried(segments))

    def local_hessians(self, x: Floats) -> Floats:
        """Of each element (m, 12, 12): of |y| by the strains, (1 - t t^T) / |y|, and what strains are curved by."""
        segments = segments_of(x, self.elements, self.lengths)
        y, size = self._ways(segments)
        t = y / size[:, :, None]
        across = np.eye(3) - t[..., :, None] * t[..., None, :]
        weight = (self._weights / size)[:, :, None, None]
        D = (self._by.swapaxes(2, 3) @ (weight * (across @ self._by))).sum(axis=0)
        B = segments.gradients
        found: Floats = B.swapaxes(1, 2) @ D @ B
        return found + segments.hessians(self._carried(segments), np.zeros((len(self.lengths), 6)))

    def rounding(self, x: Floats) -> float:
        """Far below that of the rod."""
        return 0.0
