"""State of a rod: its construction, its increments, and the positions of material points around its axis.

A state x (nodes * 7,) holds one row per node, in order along the rod: the position (3) and a unit quaternion (4, scalar
first). An increment d (nodes * 6,) holds, per node, a displacement in space and a rotation vector about the node's
material axes: x + d, q exp(d / 2). To add another way to apply increments, write a class next to `RodSpace` with the
members of `energy.Space`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.rod_kinematics import ElementRotations, RodElements, cached_elements
from softmark.solvers.energies.rod_rotation import (
    conjugate,
    exponential,
    interpolate_rotation,
    product,
    quaternion,
    rotation,
)


def chain_elements(nodes: int) -> Ints:
    """Return the elements (nodes - 1, 2) of one rod, each between a node and the next."""
    return np.stack([np.arange(nodes - 1), np.arange(1, nodes)], axis=1)


def lengths(rest: Floats, elements: Ints) -> Floats:
    """Return the undeformed lengths (n,) of the elements, m, measured along their chords."""
    X = rest.reshape(-1, 7)[:, :3][elements]
    return np.asarray(np.linalg.norm(X[:, 1] - X[:, 0], axis=1))


@dataclass(frozen=True)
class RodSpace:
    """Configuration space of rod nodes, in which positions and rotations move independently of each other."""

    nodes: int

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom, six per node."""
        return 6 * self.nodes

    def move(self, x: Floats, d: Floats) -> Floats:
        """Return the state with positions plus d, and quaternions times exp(d / 2), normalised."""
        old, step = x.reshape(-1, 7), d.reshape(-1, 6)
        q = product(old[:, 3:], exponential(step[:, 3:]))
        q = q / np.sqrt(np.einsum("em,em->e", q, q))[:, None]
        return np.concatenate([old[:, :3] + step[:, :3], q], axis=1).ravel()


def updated_axis_vectors(before: RodElements, step: Floats, turns: ElementRotations) -> Floats:
    """Return the vectors from node to node (n, 3), m, of elements whose strain changes linearly in a step.

    They are l R(new) (Gamma + dGamma . d), for the step d (n, 12) from the elements `before` to the rotations `turns`.
    """
    Gamma = before.strains[:, :3] + np.einsum("eij,ej->ei", before.gradients[:, :3], step)
    return np.asarray(np.einsum("eki,ei->ek", turns.middle, Gamma) * before.l[:, None])


def exceeds_half_turn(before: Floats, after: Floats, elements: Ints) -> bool:
    """Return whether an element's relative rotation has changed by more than 180 degrees between two states.

    Relative rotations between nodes are known only up to full turns. After such a step the rotation in the opposite
    sense is the shorter one, and twist or bending would be lost.
    """
    c, d = (ElementRotations.of(x.reshape(-1, 7)[:, 3:], elements).c for x in (before, after))
    return bool(np.any(np.einsum("em,em->e", c, d) < 0.0))


@dataclass(frozen=True)
class RodChain:
    """Configuration space of one rod in which stretch and shear change exactly to first order in the increment.

    `RodSpace` rotates frames by a finite angle but shifts nodes along straight lines. An element that rotates by phi
    then also stretches by phi^2 / 2 against its largest stiffness, so that Newton steps get shorter the more slender
    the rod is. Here the axis vector of each element becomes l R(new) (Gamma + dGamma . d), and the positions are summed
    from these vectors. The mixed integration point method (Magisano, Leonetti & Garcea 2017) gains the same with an
    independent normal force. The moves of both spaces agree to first order, and so do slopes in a line search.

    `held` (nodes, 3) marks position components that move by d only, such as supported ones. Between two of these the
    second-order correction is reduced to zero linearly along the rod.
    """

    rest: Floats
    held: NDArray[np.bool_]

    @cached_property
    def elements(self) -> Ints:
        """Elements (n, 2) of the rod, each between a node and the next."""
        return chain_elements(len(self.held))

    @cached_property
    def lengths(self) -> Floats:
        """Undeformed lengths of the elements (n,), m."""
        return lengths(self.rest, self.elements)

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom, six per node."""
        return 6 * len(self.held)

    def move(self, x: Floats, d: Floats) -> Floats:
        """Return the state after the increment d: the move of `RodSpace`, with corrected positions.

        The correction is of second order in d.
        """
        moved = RodSpace(len(self.held)).move(x, d)
        nodes, step = moved.reshape(-1, 7), d.reshape(-1, 6)
        turns = ElementRotations.of(nodes[:, 3:], self.elements)
        excess = np.zeros((len(self.held), 3))
        ends = np.concatenate([step[:-1], step[1:]], axis=1)
        axes = updated_axis_vectors(cached_elements(x, self.elements, self.lengths), ends, turns)
        np.cumsum(axes - (nodes[1:, :3] - nodes[:-1, :3]), axis=0, out=excess[1:])
        excess -= self._interpolated_correction(excess)
        nodes[:, :3] += excess
        cached_elements(moved, self.elements, self.lengths, turns)  # fill the cache: Newton needs it next
        return moved

    def has_rotation_jump(self, before: Floats, after: Floats) -> bool:
        """Return whether an element's relative rotation has changed by more than 180 degrees between two states."""
        return exceeds_half_turn(before, after, self.elements)

    def _interpolated_correction(self, excess: Floats) -> Floats:
        """Return the part (nodes, 3), m, of the position correction `excess` that must be subtracted from it.

        It equals the correction at held nodes and is linear between them. For a component that is held at no node, it
        is the mean of the correction.
        """
        below, above, part = self._held_neighbours
        drift = excess.take(below)
        drift += part * (excess.take(above) - drift)
        loose = ~self.held.any(axis=0)
        if loose.any():
            drift[:, loose] = excess[:, loose].mean(axis=0)
        return drift

    @cached_property
    def _held_neighbours(self) -> tuple[Ints, Ints, Floats]:
        """Neighbouring held components of each component (nodes, 3), and the interpolation weight between them.

        The held components before and after are given as flat indices.
        """
        s = np.concatenate([[0.0], np.cumsum(self.lengths)])
        below, above = np.zeros((2, *self.held.shape), dtype=np.int64)
        part = np.zeros(self.held.shape)
        for k, held in enumerate(self.held.T):
            places = np.flatnonzero(held)
            if not len(places):
                continue
            behind = np.searchsorted(places, np.arange(len(held)))
            low = places[np.maximum(behind - 1, 0)]
            high = places[np.minimum(behind, len(places) - 1)]
            below[:, k], above[:, k] = 3 * low + k, 3 * high + k
            apart = high > low
            part[apart, k] = (s[apart] - s[low[apart]]) / (s[high[apart]] - s[low[apart]])
        return below, above, part


def rod_at_rest(points: Floats, up: Floats | None = None) -> Floats:
    """Return the state (n * 7,) of an undeformed rod through `points` (n, 3), m, with e1 along its tangent.

    e3 is `up` made perpendicular to e1; by default `up` is the coordinate axis farthest from every tangent. The tangent
    bisects the angle between neighbouring chords. At an end, it mirrors the tangent of the next node in the end chord.
    Both are exact on an evenly divided circle. Raises ValueError for fewer than two points, repeated ones, or a tangent
    along `up`.
    """
    X = np.asarray(points, dtype=np.float64)
    t = _tangents(X)
    axis = np.eye(3)[np.argmin(np.max(np.abs(t), axis=0))] if up is None else np.asarray(up, dtype=np.float64)
    e2 = np.cross(axis, t)
    sine = np.linalg.norm(e2, axis=1, keepdims=True) / np.linalg.norm(axis)
    if not np.all(sine > 1e-6):
        raise ValueError("the rod is parallel to its reference direction somewhere")
    e2 /= np.linalg.norm(e2, axis=1, keepdims=True)
    return rod_from_frames(X, np.stack([t, e2, np.cross(t, e2)], axis=2))


def rod_from_frames(points: Floats, frames: Floats) -> Floats:
    """Return the undeformed state (n * 7,) of a rod at `points` (n, 3), m, with the axes of its sections.

    `frames` (n, 3, 3) hold the axes e1, e2 and e3 as columns.
    """
    return np.concatenate([points, quaternion(frames)], axis=1).ravel()


def _tangents(X: Floats) -> Floats:
    """Return unit tangents (n, 3) of the polyline X (n, 3)."""
    chords = np.diff(X, axis=0)
    size = np.linalg.norm(chords, axis=1, keepdims=True)
    if len(X) < 2 or not np.all(size > 0.0):
        raise ValueError("a rod needs two points or more, each apart from the next")
    chords /= size
    t = np.concatenate([chords[:1], chords[:-1] + chords[1:], chords[-1:]])
    t /= np.linalg.norm(t, axis=1, keepdims=True)
    if len(X) > 2:
        for end, near in ((0, 1), (-1, -2)):
            t[end] = 2 * (t[end] @ t[near]) * t[end] - t[near]
    return np.asarray(t)


def displacement_at(x: Floats, rest: Floats, X: Floats, along: Callable[[Floats], Floats] | None = None) -> Floats:
    """Return displacements (m, 3), m, of material points X (m, 3), m, around a rod.

    u = x(s) + R(s) R_rest(s)^T (X - X(s)) - X, with s the coordinate of X along the axis. Positions are linear between
    nodes, rotations follow the geodesic, and cross-sections are rigid. Points beyond an end follow that end rigidly.
    `along` returns coordinates along the undeformed axis (k,), m, of points (k, 3); by default the axis must be
    straight. Raises ValueError if it is not.
    """
    start, now = rest.reshape(-1, 7), x.reshape(-1, 7)
    s_nodes, s = _axis_coordinates(start[:, :3], X) if along is None else (along(start[:, :3]), along(X))
    a = np.clip(np.searchsorted(s_nodes, s, side="right") - 1, 0, len(s_nodes) - 2)
    t = np.clip((s - s_nodes[a]) / (s_nodes[a + 1] - s_nodes[a]), 0.0, 1.0)
    foot, Q = _interpolate_nodes(start, a, t)
    y, q = _interpolate_nodes(now, a, t)
    turned = np.einsum("mki,mi->mk", rotation(product(q, conjugate(Q))), X - foot)
    return np.asarray(y + turned - X)


def _axis_coordinates(nodes: Floats, X: Floats) -> tuple[Floats, Floats]:
    """Return coordinates along the straight undeformed axis, m, of the nodes (n,) and of the points X (m,)."""
    axis = nodes[-1] - nodes[0]
    length = np.linalg.norm(axis)
    e1 = axis / length
    s = (nodes - nodes[0]) @ e1
    if np.max(np.abs(nodes - nodes[0] - s[:, None] * e1)) > 1e-9 * length:
        raise ValueError("the undeformed rod is not straight")
    return s, (X - nodes[0]) @ e1


def _interpolate_nodes(nodes: Floats, a: Ints, t: Floats) -> tuple[Floats, Floats]:
    """Return positions (m, 3) and quaternions (m, 4) at the fraction t of the way from node a to the next."""
    ends = nodes[:, :3]
    position = (1 - t)[:, None] * ends[a] + t[:, None] * ends[a + 1]
    return position, interpolate_rotation(nodes[a, 3:], nodes[a + 1, 3:], t)
