"""Setup of the direct stiffness method: makes the frame structure of a case."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.theories.tendon_theory_setup import section_stiffness
from softmark.interpreter.problem.theories.theory_setup import TheorySetup
from softmark.interpreter.vocabulary.loads.body_force import BodyForce
from softmark.interpreter.vocabulary.loads.line_force import LineForce
from softmark.interpreter.vocabulary.loads.point_force import PointLoad
from softmark.interpreter.vocabulary.loads.torque import MomentLoad
from softmark.interpreter.vocabulary.supports.pinned_points import Pinned
from softmark.interpreter.vocabulary.supports.support import UniformSupport
from softmark.references.straight_cantilever import Disc, NotApplicable, Rectangle, Ring
from softmark.solvers.mesh.frame_shapes import Network
from softmark.solvers.mesh.shape import transverse

if TYPE_CHECKING:
    import numpy as np

    from softmark.references.frame_theory import Frame, FrameMember
    from softmark.solvers.mesh.frame_shapes import Member
    from softmark.solvers.mesh.mesh import Floats
else:
    from softmark.solvers.runtime.lazy_modules import np

HELD = 16  # parts of a member that is held all along, at whose ends the theory holds it
NEAR = 1e-9  # relative to the diagonal: places this near are one
TAKES = "use gravity, forces and line loads on axes, and torques at points"


class FrameSetup(TheorySetup):
    """Makes the problem of a frame of beams under small loads."""

    def problem_from(self, reference: Declared, case: Case) -> Callable[[], Frame]:
        network = case.shape
        if not isinstance(network, Network):
            raise NotApplicable(
                f"`{case.body.name}` is not a network of beams", "use `network(...)`, or the theory of a single beam"
            )
        for load in case.loads:
            if not isinstance(load.thing.action, BodyForce | PointLoad | LineForce | MomentLoad):
                raise NotApplicable(f"the theory does not include the load `{load.name}`", TAKES)
        for support in case.supports:
            if not isinstance(support.thing, UniformSupport | Pinned):
                raise NotApplicable(
                    f"the theory does not include the support `{support.name}`", "use clamps and hinges"
                )
            if any(len(_interior_selection_values(member, network, support)) == 2 for member in network.members):
                raise NotApplicable(f"`{support.name}` holds a part of a member", "hold points or whole members")
        return lambda: _FrameBuilder(case, network).build_frame()


def _interior_selection_values(member: Member, network: Network, support: Declared) -> set[bool]:
    """Return the set of truth values of a support's condition at sample points between the ends of a member.

    Both values in the set mean that the support selects only a part of the member.
    """
    places = (member.centre(k / HELD * member.length) for k in range(1, HELD))
    return {bool(support.thing.where.holds(*place, network.diagonal)) for place in places}


class _FrameBuilder:
    """Builder of a frame, which divides members at point forces and at the ends of line loads."""

    def __init__(self, case: Case, network: Network) -> None:
        self.case, self.network, self.near = case, network, NEAR * network.diagonal
        self.nodes = list(network.points)
        self.cuts = [self._division_stations(member) for member in network.members]

    def _division_stations(self, member: Member) -> list[float]:
        """Return the distances from the start of a member, m, at which the member is divided, including both ends."""
        found = {0.0, 0.5 * member.length, member.length}  # in its middle, as a member may buckle by itself
        for load in self.case.loads:
            action = load.thing.action
            places = [action.at] if isinstance(action, PointLoad) else []
            places += [action.begin, action.end] if isinstance(action, LineForce) else []
            found |= {s for s in (self._station_of_point(member, p) for p in places) if s is not None}
        if any(True in _interior_selection_values(member, self.network, support) for support in self.case.supports):
            found |= {k / HELD * member.length for k in range(1, HELD)}
        kept = [s for s in sorted(found) if self.near < s < member.length - self.near]
        return [0.0, *kept, member.length]

    def _station_of_point(self, member: Member, point: Any) -> float | None:
        """Return the distance of a point from the start of a member, m; None if the point is not on its axis."""
        s, u, v = member.section_coordinates(point)
        return s if math.hypot(u, v) <= self.near and -self.near <= s <= member.length + self.near else None

    def _find_or_add_node(self, point: Any) -> int:
        """Return the number of the node at a point, m; a new node is added if there is none."""
        for i, known in enumerate(self.nodes):
            if math.dist(known, point) <= self.near:
                return i
        self.nodes.append(tuple(point))
        return len(self.nodes) - 1

    def build_frame(self) -> Frame:
        """Return the frame with its divided members, constraints and nodal forces."""
        from softmark.references.frame_theory import Frame

        members, starts, own = [], [], []
        for number, (member, cuts) in enumerate(zip(self.network.members, self.cuts, strict=True)):
            for a, b in pairwise(cuts):
                members.append(self._build_member(member, a, b))
                starts.append(a)
                own.append(number)
        held, imposed = self._support_constraints()
        forces = self._nodal_forces()
        pieces = np.array(own), np.array(starts)
        return Frame(
            np.array(self.nodes),
            forces,
            tuple(members),
            held,
            imposed,
            lambda X: self._nearest_piece_numbers(X, *pieces),
        )

    def _build_member(self, member: Member, a: float, b: float) -> FrameMember:
        """Return the part of a member between the stations a and b, m, with stiffness and distributed load."""
        from softmark.references.frame_theory import FrameMember

        ends = self._find_or_add_node(member.centre(a)), self._find_or_add_node(member.centre(b))
        lines = [
            load.thing.action
            for load in self.case.loads
            if isinstance(load.thing.action, LineForce)
            and self._is_under_line_load(member, load.thing.action, 0.5 * (a + b))
        ]
        along = np.sum([line.force for line in lines], axis=0) if lines else np.zeros(3)
        material = self.case.material
        weight = material.density * np.array(self.case.gravity)
        areas = _section_property_from_station(a, member, lambda section: section.area)
        stiffness = _section_property_from_station(
            a, member, lambda section: section_stiffness(section, material.young, material.poisson)
        )

        def load(s: Floats) -> Floats:
            found: Floats = areas(s)[:, None] * weight + along
            return found

        return FrameMember(ends, b - a, member.frame(0.0), stiffness, load)

    def _is_under_line_load(self, member: Member, line: LineForce, s: float) -> bool:
        """Return whether a line load acts on a member at station s, m."""
        ends = [self._station_of_point(member, p) for p in (line.begin, line.end)]
        known = [e for e in ends if e is not None]
        return len(known) == 2 and min(known) < s < max(known)

    def _nodal_forces(self) -> Floats:
        """Return the nodal forces and moments (n, 6), N and N m."""
        found = np.zeros((len(self.nodes), 6))
        for load in self.case.loads:
            match load.thing.action:
                case PointLoad(at=at, force=force):
                    found[self._find_or_add_node(at), :3] += force
                case MomentLoad(moment=moment) as action:
                    found[self._selected_nodes(action)[0], 3:] += moment
        return found

    def _selected_nodes(self, thing: Any) -> list[int]:
        """Return the numbers of the nodes that the `where` of a support or load selects, joints first."""
        return [i for i, node in enumerate(self.nodes) if thing.where.holds(*node, self.network.diagonal)]

    def _support_constraints(self) -> tuple[Floats, Floats]:
        """Return the matrix of linear constraints by supports (c, 6 n), and the prescribed values (c,), m and rad."""
        rows, imposed, taken = [], [], set()
        for support in self.case.supports:
            thing = support.thing
            turns = np.eye(3) if thing.hinge_axis is None else np.array(transverse(thing.hinge_axis))
            for i in self._selected_nodes(thing):
                ways = [(np.eye(3)[c], 0, thing.displacement[c]) for c in thing.components]
                ways += [(way, 3, 0.0) for way in turns] if thing.carries_moments else []
                for way, first, value in ways:
                    if (key := (i, first, *np.round(way, 9).tolist())) not in taken:
                        taken.add(key)
                        row = np.zeros((len(self.nodes), 6))
                        row[i, first : first + 3] = way
                        rows.append(row.ravel())
                        imposed.append(value)
        return np.array(rows).reshape(-1, 6 * len(self.nodes)), np.array(imposed, dtype=np.float64)

    def _nearest_piece_numbers(self, X: Floats, own: Any, starts: Floats) -> Any:
        """Return the numbers (n,) of the member parts nearest to points X (n, 3), m.

        `own` (p,) is the member of each part, and `starts` (p,), m, the station at which the part begins.
        """
        whole, found = self.network.nearest(X), np.zeros(len(X), dtype=np.int64)
        for number in np.unique(whole).tolist():
            here, pieces = whole == number, np.flatnonzero(own == number)
            s = self.network.members[number].stations(X[here])
            found[here] = pieces[np.clip(np.searchsorted(starts[pieces], s, side="right") - 1, 0, None)]
        return found


def _section_property_from_station(
    a: float, member: Member, of: Callable[[Disc | Ring | Rectangle], Any]
) -> Callable[[Floats], Floats]:
    """Return a section property as a function of the distances (n,), m, from station `a` of a member.

    `of` computes the property of one cross-section. For a constant section it is called only once.
    """
    if member.tapered:
        return lambda s: np.array([of(_cross_section_at(member, a + t)) for t in s.tolist()])
    same = np.array(of(_cross_section_at(member, a)))
    return lambda s: np.broadcast_to(same, (len(s), *same.shape))


def _cross_section_at(member: Member, s: float) -> Disc | Ring | Rectangle:
    """Return the cross-section of a member at station s, m, with dimensions interpolated between both ends."""
    t = min(max(s / member.length, 0.0), 1.0)
    names = [name for name in ("radius", "inner", "width", "height") if hasattr(member.ends[0], name)]
    at = {name: (1.0 - t) * getattr(member.ends[0], name) + t * getattr(member.ends[1], name) for name in names}
    if "width" in at:
        return Rectangle(height=at["height"], width=at["width"])
    return Ring(at["radius"], at["inner"]) if "inner" in at else Disc(at["radius"])
