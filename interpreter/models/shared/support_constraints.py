"""How supports hold a body: selections, values on degrees of freedom, conflicts, and motions left free."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.beam.rigid_motions import AXES, free_motions, point_rows
from softmark.interpreter.problem.body_case import Case, Fault, fault, reach
from softmark.interpreter.problem.symmetry_planes import must_lie_in_plane
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.solvers.energies.energy import Floats, Ints

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.rotating_supports import Turns
    from softmark.solvers.mesh.mesh import Mesh
    from softmark.solvers.statics.winding import Chain


SAME = 1e-12  # relative difference of imposed values that rounding may make


def selected(case: Case, owner: Declared, mesh: Mesh) -> np.ndarray:
    """Which nodes of a mesh (n,) a support holds: all that it selects, as `case.wide` has it. Raises Fault if none."""
    from softmark.interpreter.models.shared.support_selection import grip  # beams, which know no meshes, come here too

    own = grip(owner.thing.where, mesh)
    if not own.nodes.any():
        spans = reach(mesh.points.min(axis=0).tolist(), mesh.points.max(axis=0).tolist())
        raise fault(
            "E302",
            owner.at("where"),
            f"`{owner.name}` selects no point of the mesh of `{case.body.name}`",
            "selects nothing",
            f"the mesh spans {spans}, and a thin selection may lie between its points",
        )
    return own.wide if case.wide else own.nodes


@dataclass
class Held:
    """Values that supports impose on degrees of freedom, and what they do to rigid motions about a centre."""

    case: Case
    extent: float  # m, of the body: makes rotations comparable with displacements
    centre: Floats = field(default_factory=lambda: np.zeros(3))
    unknowns: int = -1  # how many degrees of freedom there are, where holding them all is refused
    values: dict[int, tuple[float, Declared]] = field(default_factory=dict)
    rows: list[Floats] = field(default_factory=lambda: [np.zeros((0, 6))])
    nodes: list[Ints] = field(default_factory=lambda: [np.zeros(0, dtype=np.int64)])  # of each row; -1: of any piece

    def see(self, nodes: Ints, rows: Floats) -> None:
        """Note what is seen of rigid motions by rows (r, 6), each at a node (r,)."""
        self.nodes.append(nodes)
        self.rows.append(rows)

    def of(self, piece: NDArray[np.bool_]) -> Floats:
        """The rows (r, 6) of a piece of the body, of these nodes (n,)."""
        nodes = np.concatenate(self.nodes)
        found: Floats = np.concatenate(self.rows)[piece[nodes] | (nodes < 0)]
        return found

    def impose(self, dof: int, value: float, support: Declared, place: Floats, along: str, angle: bool = False) -> None:
        """Hold a degree of freedom of a point. Raises Fault where another support holds it to another value."""
        known, owner = self.values.setdefault(dof, (value, support))
        if self.case.wide:  # nodes beyond the selection are the first's that asks
            return
        if abs(known - value) > SAME * max(abs(known), abs(value)):
            raise conflict((owner, known), (support, value), place, along, units.ANGLE if angle else units.LENGTH)

    def turns(self, fixed: Ints, target: Floats, points: Floats, per_node: int) -> Turns | None:
        """How these come there, `per_node` at each of the nodes (n, 3), m, where some of them turn."""
        if not any(support.thing.turns for support in self.case.supports):
            return None
        from softmark.interpreter.models.shared.rotating_supports import turns_of

        owners = {dof: owner for dof, (_, owner) in self.values.items()}
        return turns_of(owners, fixed, points, per_node, target)

    def finished(self) -> tuple[Ints, Floats]:
        """The degrees of freedom in order, and their values. Raises Fault where a body at rest is free to move."""
        if len(self.values) == self.unknowns:
            raise self._rigid()
        if not (isinstance(self.case.analysis, Dynamic) or self.case.contacts):  # which touch may hold
            must_be_held(self.case, np.concatenate(self.rows), self.centre, self.extent)
        fixed = sorted(self.values)
        return np.array(fixed, dtype=np.int64), np.array([self.values[dof][0] for dof in fixed])

    def _rigid(self) -> Fault:
        """Nothing is left to deform."""
        last = self.case.named_supports[-1]
        return fault(
            "E303",
            last.at("where"),
            f"`{last.name}` leaves no point of the mesh of `{self.case.body.name}` free",
            "selects everything",
            "nothing would be left to deform; select a part of the body, leave components free, or use a finer mesh",
        )


def solid_supports(case: Case, mesh: Mesh, measured: Mapping[str, Any]) -> tuple[Ints, Floats, Turns | None]:
    """Held degrees of freedom of a mesh (c,), their displacements (c,), m, and how they come there. Raises Fault.

    `measured` has the tracked points that supports may follow, by the name of their reference.
    """
    held = _solid_held(case, mesh, measured, 1.0)
    fixed, target = held.finished()
    way = held.turns(fixed, target, mesh.points, 3)
    if way is not None:
        _solid_held(case, mesh, measured, way.early)  # on the way there supports must agree too
        way = replace(way, chains=_chains(case, mesh))
    return fixed, target, way


def _chains(case: Case, mesh: Mesh) -> tuple[Chain, ...]:
    """Chains of cells between the supports that hold rotations: those that turn, and those of all components."""
    from softmark.solvers.statics.winding import Grip, chains

    holds = range(2 if case.planar else 3)
    grips = [
        Grip(np.nonzero(selected(case, support, mesh))[0], support.thing.rotation)
        for support in case.supports
        if support.thing.turns or (support.thing.tracked is None and set(holds) <= set(support.thing.components))
    ]
    return chains(mesh.points, mesh.cells, grips)


def held_of(case: Case, mesh: Mesh, measured: Mapping[str, Any]) -> Held:
    """How supports hold a body on a mesh. Raises Fault."""
    return _solid_held(case, mesh, measured, 1.0)


def left_free(held: Held, piece: NDArray[np.bool_], more: list[Floats]) -> list[str]:
    """Rigid motions of a piece of the body, of these nodes (n,), that supports, and `more` rows (r, 6) about the same
    centre, leave free, in words."""
    return free_motions(_scaled(np.concatenate([held.of(piece), *more]), held.extent), held.centre, held.extent)


def held_values(case: Case, mesh: Mesh, measured: Mapping[str, Any]) -> dict[int, tuple[float, Declared]]:
    """Of every held degree of freedom what it is moved by, m, and the support that moves it. Raises Fault."""
    return _solid_held(case, mesh, measured, 1.0).values


def _solid_held(case: Case, mesh: Mesh, measured: Mapping[str, Any], share: float) -> Held:
    """What supports hold at a share of their motions. Raises Fault."""
    held = Held(case, mesh.extent, mesh.points.mean(axis=0), mesh.points.size)
    if case.depth:  # of a body of revolution only the way along its axis is free: all else stretches rings
        held.see(np.full(5, -1), np.delete(np.eye(6), 1, axis=0))
    if case.beds:
        from softmark.interpreter.models.shared import foundation_setup

        for own, seen in foundation_setup.rows(case, mesh, held.centre):
            held.see(own, seen)
    for support in case.supports:
        nodes = np.nonzero(selected(case, support, mesh))[0]
        must_lie_in_plane(case, support, mesh, nodes)
        rows = point_rows(mesh.points[nodes] - held.centre, support.thing.components)
        held.see(np.repeat(nodes, len(support.thing.components)), rows)
        places = mesh.points[nodes] * (1.0, 1.0, 0.0) if case.planar else mesh.points[nodes]  # all z move as one
        moved = displacements(support, places, measured, share)
        for c in support.thing.components:
            for node, value in zip(nodes.tolist(), moved[:, c].tolist(), strict=True):
                held.impose(3 * node + c, value, support, mesh.points[node], AXES[c])
    return held


def listed(words: list[str]) -> str:
    """Motions in words, one after the other."""
    return " and to ".join((", to ".join(words[:-1]), words[-1])) if len(words) > 1 else words[0]


def _scaled(rows: Floats, extent: float) -> Floats:
    """Rows with turns in units of 1 / extent."""
    scaled: Floats = rows / extent ** np.array([0, 0, 0, 1, 1, 1])
    return scaled


def displacements(support: Declared, X: Floats, measured: Mapping[str, Any], share: float = 1.0) -> Floats:
    """What a support imposes on points X (n, 3) of the undeformed body (n, 3), m, at a share. Raises Fault."""
    if support.thing.tracked is not None:
        return share * _followed(support, X, measured)
    moved: Floats = support.thing.moved(X, share)
    return moved


def _followed(support: Declared, X: Floats, measured: Mapping[str, Any]) -> Floats:
    """Displacements (n, 3) of tracked points near the points X, interpolated by thin plate splines."""
    from scipy.interpolate import RBFInterpolator
    from scipy.spatial import cKDTree

    thing = support.thing
    if thing.of not in measured:
        at, problem = support.at("of"), f"`{support.name}` follows `{thing.of}`, which could not be read"
        raise fault("E406", at, problem, help="the report of the reference says why")
    data = measured[thing.of]
    near = cKDTree(X).query(data.X)[0] <= thing.reach
    points = data.X[near]
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) if len(points) > 3 else np.zeros(3)
    if len(points) < 4 or spread[1] < 1e-6 * spread[0]:
        raise fault(
            "E302",
            support.at("reach"),
            f"`{support.name}` finds {len(points)} tracked points near the part that it moves",
            "too few to tell how it moves",
            "use a larger `reach`, or another `where`",
        )
    # nearly in one plane, as a layer of beads is, only their place within the plane says anything
    centre, axes = points.mean(axis=0), np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    flat = spread[2] < 0.1 * spread[1]
    frame = axes[: 2 if flat else 3].T
    try:
        spline = RBFInterpolator((points - centre) @ frame, data.u[near], kernel="thin_plate_spline")
    except np.linalg.LinAlgError:
        raise fault(
            "E302",
            support.at("reach"),
            f"`{support.name}` finds tracked points that lie above one another",
            "no one motion of the part that it moves",
            "use a smaller `reach`, so that one layer is left",
        ) from None
    u: Floats = spline((X - centre) @ frame)
    return u


def conflict(first: tuple[Declared, float], second: tuple[Declared, float], place: Floats, along: str,
             unit: units.Dimension = units.LENGTH) -> Fault:  # fmt: skip
    """Two supports that move one point in one direction, or turn it, by different amounts, m or rad."""
    (one, known), (other, value) = first, second
    at = units.show_all(place.tolist(), units.LENGTH) if np.any(place) else "(0, 0, 0) mm"
    by = [f"{units.show(v, unit)} along {along}" if v else f"0 along {along}" for v in (known, value)]
    found = fault(
        "E305",
        other.at("where"),
        f"`{one.name}` and `{other.name}` hold the same points to different values",
        "contradicts the other",
        f"select other points, or leave {along} out of one of them: `components = ({_others(along)})`",
    )
    span = one.at("where").span
    line = f" (line {span.line})" if span is not None else ""
    note = f"at {at} `{one.name}`{line} wants {by[0]}, `{other.name}` {by[1]}"
    return Fault(replace(found.diagnostic, notes=(note,)))


def _others(along: str) -> str:
    return ", ".join(axis for axis in AXES if axis != along)


def must_be_held(case: Case, rows: Floats, centre: Floats, extent: float) -> None:
    """Raise a Fault where the supports leave a rigid motion."""
    motions = free_motions(_scaled(rows, extent), centre, extent)
    if not motions:
        return
    raise loosely(case, "it", motions)


def loosely(case: Case, what: str, motions: list[str]) -> Fault:
    """That supports leave a body, or `what` of it, free to do so."""
    at = case.named_supports[0].at() if case.named_supports else case.body.at()
    return fault(
        "E306",
        at,
        f"the supports of `{case.body.name}` leave {what} free to {listed(motions)}",
        "not held enough",
        "hold more components, or more of the body",
    )
