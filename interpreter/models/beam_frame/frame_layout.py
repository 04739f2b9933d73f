"""Layout of a frame: nodes of members, the points that join members, and the supports of these points."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.beam.rigid_motions import AXES, rigid_motion_rows
from softmark.interpreter.models.beam.tapered_sections import inertia, integrate_at_nodes
from softmark.interpreter.models.beam_frame import frame_selection
from softmark.interpreter.models.shared.support_constraints import Constraints
from softmark.interpreter.problem.body_case import Case
from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.rod_joints import Joints
from softmark.solvers.energies.rod_rotation import rotation
from softmark.solvers.energies.rod_state import chain_elements, rod_from_frames
from softmark.solvers.mesh.frame_shapes import Network
from softmark.solvers.mesh.shape import transverse

ALIGNED = 1e-9  # distance of unit vectors: nearer hinge axes count as one


@dataclass(frozen=True)
class Layout:
    """Nodes and points of a frame whose members have equal numbers of segments.

    Points of the network come first, followed by points within members.
    """

    case: Case
    network: Network
    segments: int

    @staticmethod
    def of(case: Case, segments: int) -> Layout:
        """Return the layout of the network of a case. Raises TypeError if its body is no network."""
        if not isinstance(case.shape, Network):
            raise TypeError(f"`{case.body.name}` is not a network")
        return Layout(case, case.shape, segments)

    # ------------------------------------------------------------------ nodes and points

    def nodes(self, member: int) -> slice:
        """Return the slice of nodes of a member, counted from 0."""
        count = self.segments + 1
        return slice(member * count, (member + 1) * count)

    def stations(self, member: int) -> Floats:
        """Return the stations of the nodes of a member (segments + 1,), m from its first point."""
        found: Floats = np.linspace(0.0, self.network.members[member].length, self.segments + 1)
        return found

    @cached_property
    def rest(self) -> Floats:
        """Undeformed positions and quaternions of all nodes (n * 7,)."""
        parts = []
        for member, pair in zip(self.network.members, self.network.pairs, strict=True):
            begin, end = (np.array(self.network.points[i - 1]) for i in pair)
            X = begin + np.linspace(0.0, 1.0, self.segments + 1)[:, None] * (end - begin)
            X[-1] = end
            parts.append(rod_from_frames(X, np.tile(np.array(member.frame(0.0)).T, (len(X), 1, 1))))
        return np.concatenate(parts)

    @cached_property
    def elements(self) -> Ints:
        """Nodes of each element (e, 2), member by member."""
        own = chain_elements(self.segments + 1)
        return np.concatenate([own + m * (self.segments + 1) for m in range(len(self.network.members))])

    @cached_property
    def point_of_node(self) -> Ints:
        """Index of the point that each node belongs to (n,)."""
        inner, first = self.segments - 1, len(self.network.points)
        found = []
        for m, (a, b) in enumerate(self.network.pairs):
            found += [a - 1, *range(first + m * inner, first + (m + 1) * inner), b - 1]
        return np.array(found, dtype=np.int64)

    @property
    def count(self) -> int:
        """Number of points: those of the network, and those between the segments of its members."""
        return len(self.network.points) + (self.segments - 1) * len(self.network.pairs)

    @cached_property
    def first(self) -> Ints:
        """Index of one node at each point (p,)."""
        found = np.zeros(self.count, dtype=np.int64)
        found[self.point_of_node[::-1]] = np.arange(len(self.point_of_node))[::-1]
        return found

    @cached_property
    def X(self) -> Floats:
        """Positions of the points (p, 3), m."""
        found: Floats = self.rest.reshape(-1, 7)[self.first, :3]
        return found

    @cached_property
    def joints(self) -> Joints:
        """Rigid connection of nodes to points."""
        return Joints.of(self.rest, self.point_of_node, self.axes)

    def frames(self, x: Floats) -> Floats:
        """Return the axes of the points, as columns (p, 3, 3), in a state x (n * 7,) of the nodes."""
        q = x.reshape(-1, 7)[self.first, 3:]
        found: Floats = np.einsum("pik,pjk->pij", rotation(q), self.joints.turns[self.first])
        return found

    # ------------------------------------------------------------------ mass

    @cached_property
    def _nodal_mass_and_inertia(self) -> tuple[Floats, Floats]:
        """Mass of each node (n,), kg, and moments of inertia about the node's own axes (n, 3), kg m^2."""
        found = [
            integrate_at_nodes(member, self.stations(number), inertia)
            for number, member in enumerate(self.network.members)
        ]
        whole = self.case.material.density * np.concatenate(found)
        return whole[:, 0], whole[:, 1:]

    @cached_property
    def axes(self) -> Floats:
        """Axes of the points as columns (p, 3, 3): the principal axes of inertia, or first the axis of a hinge."""
        frames = rotation(self.rest.reshape(-1, 7)[:, 3:])
        found: Floats = frames[self.first].copy()
        own = np.zeros((self.count, 3, 3))
        np.add.at(
            own, self.point_of_node, np.einsum("nik,nk,njk->nij", frames, self._nodal_mass_and_inertia[1], frames)
        )
        several = np.bincount(self.point_of_node) > 1
        found[several] = np.linalg.eigh(own[several])[1]
        found[several, :, 0] *= np.sign(np.linalg.det(found[several]))[:, None]
        for i, axis in self.hinges.items():
            found[i] = np.array([axis, *transverse(axis)]).T
        return found

    def mass(self) -> Floats:
        """Masses of the points and moments of inertia about their axes (6 p,), kg and kg m^2."""
        mass, turning = self._nodal_mass_and_inertia
        found = np.zeros((self.count, 6))
        np.add.at(
            found,
            self.point_of_node,
            np.concatenate([np.repeat(mass[:, None], 3, 1), self._inertia_about_point_axes(turning)], axis=1),
        )
        return found.ravel()

    def _inertia_about_point_axes(self, turning: Floats) -> Floats:
        """Return moments of inertia about the points' axes (n, 3) from those about the nodes' axes (n, 3)."""
        Q = self.joints.turns
        found: Floats = np.einsum("nik,nk,nik->ni", Q, turning, Q)
        return found

    # ------------------------------------------------------------------ supports

    @cached_property
    def hinges(self) -> dict[int, tuple[float, float, float]]:
        """Axis of the hinge at each hinged point, by point; the first hinge counts if there are several."""
        found: dict[int, tuple[float, float, float]] = {}
        for support in self.case.supports:
            if (axis := support.thing.hinge_axis) is not None:
                for i in self.held_points(support).tolist():
                    found.setdefault(i, axis)
        return found

    def held_points(self, support: Declared) -> Ints:
        """Return the indices of the points that a support holds (k,)."""
        points, whole, _ = frame_selection.select_points_and_members(support.thing.where, self.network)
        inner = [self.point_of_node[self.nodes(m)] for m in whole]
        return np.unique(np.concatenate([np.array(points, dtype=np.int64), *inner]))

    def holds(self, support: Declared) -> NDArray[np.bool_]:
        """Return a mask of the degrees of freedom of points that a support holds (p, 6)."""
        found = np.zeros((self.count, 6), dtype=np.bool_)
        for i in self.held_points(support).tolist():
            found[i, list(support.thing.components)] = True
            found[i, [3 + t for t in self._prevented_rotation_axes(support, i)]] = True
        return found

    def _prevented_rotation_axes(self, support: Declared, point: int) -> tuple[int, ...]:
        """Return the axes of a held point, as indices, about which the support prevents rotation."""
        axis = support.thing.hinge_axis
        if axis is None:
            return (0, 1, 2) if support.thing.carries_moments else ()
        same = np.cross(axis, self.hinges[point])
        return (1, 2) if np.linalg.norm(same) <= ALIGNED else (0, 1, 2)

    def held(self) -> tuple[Ints, Floats]:
        """Return held degrees of freedom of the points (c,), and their imposed values (c,), m. Raises Fault."""
        size = self.network.diagonal
        held = Constraints(self.case, size, self.X.mean(axis=0), 6 * self.count)
        for support in self.case.supports:
            mask = self.holds(support)
            moved = support.thing.displacement
            for i in np.flatnonzero(mask.any(axis=1)).tolist():
                components = tuple(np.flatnonzero(mask[i, :3]).tolist())
                held.rows.append(rigid_motion_rows(self.X[i : i + 1] - held.centre, components))
                turns = np.flatnonzero(mask[i, 3:])
                held.rows.append(np.hstack([np.zeros((len(turns), 3)), self.axes[i].T[turns]]) * size)
                for c in components:
                    held.impose(6 * i + c, moved[c], support, self.X[i], AXES[c])
                for t in turns.tolist():
                    held.impose(6 * i + 3 + t, 0.0, support, self.X[i], AXES[int(np.abs(self.axes[i][:, t]).argmax())])
        return held.held_dofs_and_values()
