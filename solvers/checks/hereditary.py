"""What a past has left of stress, by the integral that defines it: from how the nodes have moved, and no recursion.

The stress that relaxes is int G(t - s) dS/ds ds with G = sum_i g_i exp(-(t - s) / tau_i). Between two times at which
the state is known S goes along a straight line, over which G is integrated exactly; every step is weighed by how long
ago it was.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace

import numpy as np

from softmark.records import dataclass
from softmark.solvers.checks.pressures import Pressed, Split
from softmark.solvers.checks.solids import CheckedBody, Floats, Ints, Stress, StressTerm, gradients, rule, shape


@dataclass(frozen=True)
class Course:
    """Nodes that were at displacements `states` (t, n, 3), m, at `times` (t,), s, and the stress that relaxes since.

    `part` is its law, `g` (k,) and `tau` (k,), s, its series; strains are `small`, or of Green.
    """

    times: Sequence[float]
    states: Sequence[Floats]
    part: Stress
    g: Floats
    tau: Floats
    small: bool
    depth: float = 0.0

    def weights(self) -> Floats:
        """What is left of each step's change of stress (t,): its share that relaxes times what G has become of it."""
        t = np.array(self.times)
        begin = np.concatenate([[0.0], t[:-1]])
        found = np.zeros(len(t))
        for g, tau in zip(self.g, self.tau, strict=True):
            width = (t - begin) / tau
            mean = np.where(width > 0.0, -np.expm1(-width) / np.where(width > 0.0, width, 1.0), 1.0)
            found += g * np.exp(-(t[-1] - t) / tau) * mean
        return found

    def held(self, points: Floats, cells: Ints, kind: str, centre: bool = False) -> Floats:
        """What that comes to at the points of a rule of some cells (m q, 3, 3), Pa: a second Piola-Kirchhoff stress."""
        xi, _ = rule(kind, centre)
        dNdX, _ = gradients(points, cells, kind, xi)
        weights, N = self.weights(), shape(kind, xi)
        found = before = np.zeros((dNdX.shape[0] * dNdX.shape[1], 3, 3))
        for weight, u in zip(weights, self.states, strict=True):
            F = np.einsum("mai,mqaJ->mqiJ", u[cells] - u[cells[:, :1]], dNdX) + np.eye(3)
            if self.depth:
                F[..., 2, 2] = 1.0 + (u[cells][:, :, 0] @ N.T) / (points[cells][:, :, 0] @ N.T)
            S = self.second(F.reshape(-1, 3, 3))
            found, before = found + weight * (S - before), S
        return found

    def second(self, F: Floats) -> Floats:
        """The stress that relaxes as second Piola-Kirchhoff's (n, 3, 3), Pa; where strains are small itself."""
        P = self.part(F)
        return P if self.small else np.linalg.inv(F) @ P

    def relaxed(self, whole: Stress, F: Floats, held: Floats) -> Floats:
        """P of a law of which the part has relaxed (n, 3, 3), Pa."""
        past = held if self.small else F @ held
        found: Floats = whole(F) - float(self.g.sum()) * self.part(F) + past
        return found


@dataclass(frozen=True)
class RememberingBody(CheckedBody):
    """A deformed mesh that remembers how it came there."""

    course: Course = field(kw_only=True)

    def _stress(self, cells: Ints, term: StressTerm, F: Floats) -> Floats:
        """P of the points of some cells (n, 3, 3), Pa."""
        return self.course.relaxed(term.stress, F, self.course.held(self.points, cells, self.kind, term.centre))


@dataclass(frozen=True)
class RememberingPressed(Pressed):
    """The same with pressures: stress of shape relaxes."""

    course: Course = field(kw_only=True)

    def _split(self, some: slice) -> Split:
        """With the stress of shape that is left."""
        course, whole = self.course, self.split.shape
        held = course.held(self.points, self.cells[some], self.kind)
        return replace(self.split, shape=lambda F: course.relaxed(whole, F, held))
