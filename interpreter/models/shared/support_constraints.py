"""Constraints imposed by supports: held nodes, imposed values, conflicts, and rigid motions left free."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.beam.rigid_motions import AXES, free_motions, rigid_motion_rows
from softmark.interpreter.problem.body_case import Case, Fault, describe_extent, fault
from softmark.interpreter.problem.symmetry_planes import must_lie_in_plane
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.supports.support import UndefinedMotion
from softmark.solvers.energies.energy import Floats, Ints

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.rotating_supports import RotationPath
    from softmark.solvers.mesh.mesh import Mesh
    from softmark.solvers.statics.winding_number import CellChain


SAME = 1e-12  # relative difference of imposed values that rounding may cause


def selected_nodes(case: Case, owner: Declared, mesh: Mesh) -> np.ndarray:
    """Return which nodes of a mesh (n,) a support holds. Raises Fault if it holds none.

    With `case.wide`, the support holds all nodes of cells that the border of its selection cuts.
    """
    from softmark.interpreter.models.shared.support_selection import (
        select_support,
    )  # imported here because beams use this module without a mesh

    own = select_support(owner.thing.where, mesh)
    if not own.nodes.any():
        spans = describe_extent(mesh.points.min(axis=0).tolist(), mesh.points.max(axis=0).tolist())
        raise fault(
            "E302",
            owner.at("where"),
            f"`{owner.name}` selects no point of the mesh of `{case.body.name}`",
            "selects nothing",
            f"the mesh spans {spans}; a thin selection may lie between its nodes",
        )
    return own.wide if case.wide else own.nodes


@dataclass
class Constraints:
    """Values that supports impose on degrees of freedom, with constraint rows that restrict rigid motions.

    Each row (6,) gives one held displacement component in terms of three translations and three rotations about
    `centre`.
    """

    case: Case
    extent: float  # m, of the body: makes rotations comparable with displacements
    centre: Floats = field(default_factory=lambda: np.zeros(3))
    unknowns: int = -1  # number of degrees of freedom, if holding all of them is an error
    values: dict[int, tuple[float, Declared]] = field(default_factory=dict)
    rows: list[Floats] = field(default_factory=lambda: [np.zeros((0, 6))])
    nodes: list[Ints] = field(default_factory=lambda: [np.zeros(0, dtype=np.int64)])  # of each row; -1: of any piece

    def add_rows(self, nodes: Ints, rows: Floats) -> None:
        """Add constraint rows (r, 6) on rigid motions, each at the node with an index in `nodes` (r,)."""
        self.nodes.append(nodes)
        self.rows.append(rows)

    def of(self, piece: NDArray[np.bool_]) -> Floats:
        """Return the constraint rows (r, 6) at nodes of one piece of the body, given as a mask (n,)."""
        nodes = np.concatenate(self.nodes)
        found: Floats = np.concatenate(self.rows)[piece[nodes] | (nodes < 0)]
        return found

    def impose(self, dof: int, value: float, support: Declared, place: Floats, along: str, angle: bool = False) -> None:
        """Impose a value, m or rad, on a degree of freedom.

        Raises Fault if another support imposes a different value. `place`, `along` and `angle` describe the degree of
        freedom in the message.
        """
        known, owner = self.values.setdefault(dof, (value, support))
        if self.case.wide:  # nodes beyond the selection belong to the first support
            return
        if abs(known - value) > SAME * max(abs(known), abs(value)):
            raise conflict((owner, known), (support, value), place, along, units.ANGLE if angle else units.LENGTH)

    def turns(self, fixed: Ints, target: Floats, points: Floats, per_node: int) -> RotationPath | None:
        """Return the path of imposed values if a support rotates, else None.

        `points` (n, 3), m, are the nodes, each with `per_node` degrees of freedom.
        """
        if not any(support.thing.rotates for support in self.case.supports):
            return None
        from softmark.interpreter.models.shared.rotating_supports import rotation_path

        owners = {dof: owner for dof, (_, owner) in self.values.items()}
        return rotation_path(owners, fixed, points, per_node, target)

    def held_dofs_and_values(self) -> tuple[Ints, Floats]:
        """Return the held degrees of freedom (c,), sorted, and their imposed values (c,).

        Raises Fault if no degree of freedom is free, or if a static body without contacts is free to move.
        """
        if len(self.values) == self.unknowns:
            raise self._no_free_node_fault()
        if not (isinstance(self.case.analysis, Dynamic) or self.case.contacts):  # contact may hold the body
            must_be_held(self.case, np.concatenate(self.rows), self.centre, self.extent)
        fixed = sorted(self.values)
        return np.array(fixed, dtype=np.int64), np.array([self.values[dof][0] for dof in fixed])

    def _no_free_node_fault(self) -> Fault:
        """Return the Fault for supports that leave no node free to deform."""
        last = self.case.named_supports[-1]
        return fault(
            "E303",
            last.at("where"),
            f"`{last.name}` leaves no node of the mesh of `{self.case.body.name}` free",
            "selects everything",
            "select a part of the body, leave components free, or use a finer mesh",
        )


def solid_supports(case: Case, mesh: Mesh, measured: Mapping[str, Any]) -> tuple[Ints, Floats, RotationPath | None]:
    """Return held degrees of freedom (c,), their values (c,), m, and the path of rotating supports. Raises Fault.

    `measured` has the tracked points that supports may follow, by name of the reference.
    """
    held = _constraints_at_fraction(case, mesh, measured, 1.0)
    fixed, target = held.held_dofs_and_values()
    way = held.turns(fixed, target, mesh.points, 3)
    if way is not None:
        _constraints_at_fraction(case, mesh, measured, way.early)  # supports must also agree at smaller load fractions
        way = replace(way, chains=_chains(case, mesh))
    return fixed, target, way


def _chains(case: Case, mesh: Mesh) -> tuple[CellChain, ...]:
    """Return chains of cells that connect supports which prevent rotation: rotating supports and full clamps."""
    from softmark.solvers.statics.winding_number import RotationSupport, find_cell_chains

    grips = [
        RotationSupport(np.nonzero(selected_nodes(case, support, mesh))[0], support.thing.rotation)
        for support in case.supports
        if support.thing.prevents_rotation(bool(case.planar))
    ]
    return find_cell_chains(mesh.points, mesh.cells, grips)


def build_constraints(case: Case, mesh: Mesh, measured: Mapping[str, Any]) -> Constraints:
    """Return the constraints of a body on a mesh. Raises Fault."""
    return _constraints_at_fraction(case, mesh, measured, 1.0)


def remaining_rigid_motions(held: Constraints, piece: NDArray[np.bool_], more: list[Floats]) -> list[str]:
    """Return descriptions of the rigid motions that remain free for a piece of the body.

    `piece` (n,) marks the nodes of the piece. `held` are the constraints of supports, and `more` are further constraint
    rows (r, 6) about the same centre.
    """
    return free_motions(
        _scale_rotations(np.concatenate([held.of(piece), *more]), held.extent), held.centre, held.extent
    )


def held_values(case: Case, mesh: Mesh, measured: Mapping[str, Any]) -> dict[int, tuple[float, Declared]]:
    """Return, by held degree of freedom, the imposed value, m, and the support that imposes it. Raises Fault."""
    return _constraints_at_fraction(case, mesh, measured, 1.0).values


def _constraints_at_fraction(case: Case, mesh: Mesh, measured: Mapping[str, Any], share: float) -> Constraints:
    """Return the constraints of a body on a mesh at a fraction `share` of the support motions. Raises Fault."""
    held = Constraints(case, mesh.extent, mesh.points.mean(axis=0), mesh.points.size)
    if case.depth:  # a body of revolution can only move rigidly along its axis: other motions stretch rings
        held.add_rows(np.full(5, -1), np.delete(np.eye(6), 1, axis=0))
    if case.beds:
        from softmark.interpreter.models.shared import foundation_setup

        for own, seen in foundation_setup.constraint_rows(case, mesh, held.centre):
            held.add_rows(own, seen)
    for support in case.supports:
        nodes = np.nonzero(selected_nodes(case, support, mesh))[0]
        must_lie_in_plane(case, support, mesh, nodes)
        rows = rigid_motion_rows(mesh.points[nodes] - held.centre, support.thing.components)
        held.add_rows(np.repeat(nodes, len(support.thing.components)), rows)
        places = mesh.points[nodes] * (1.0, 1.0, 0.0) if case.planar else mesh.points[nodes]  # all z move as one
        moved = displacements(support, places, measured, share)
        for c in support.thing.components:
            for node, value in zip(nodes.tolist(), moved[:, c].tolist(), strict=True):
                held.impose(3 * node + c, value, support, mesh.points[node], AXES[c])
    return held


def join_motions(words: list[str]) -> str:
    """Return descriptions of motions joined into one phrase."""
    return " and to ".join((", to ".join(words[:-1]), words[-1])) if len(words) > 1 else words[0]


def _scale_rotations(rows: Floats, extent: float) -> Floats:
    """Return constraint rows with rotations divided by `extent`, m, so that they compare with translations."""
    scaled: Floats = rows / extent ** np.array([0, 0, 0, 1, 1, 1])
    return scaled


def displacements(support: Declared, X: Floats, measured: Mapping[str, Any], share: float = 1.0) -> Floats:
    """Return the displacements (n, 3), m, that a support imposes on points X (n, 3), m. Raises Fault.

    `share` is the fraction of the full motion.
    """
    try:
        moved: Floats = support.thing.prescribed_displacements(X, share, measured)
    except UndefinedMotion as undefined:
        field, problem, label, help = undefined.reason
        raise fault(undefined.code, support.at(field), f"`{support.name}` {problem}", label, help) from None
    return moved


def conflict(first: tuple[Declared, float], second: tuple[Declared, float], place: Floats, along: str,
             unit: units.Dimension = units.LENGTH) -> Fault:  # fmt: skip
    """Return the Fault for two supports that impose different values, m or rad, on one degree of freedom.

    `place` (3,), m, is the point and `along` names the component.
    """
    (one, known), (other, value) = first, second
    at = units.format_vector(place.tolist(), units.LENGTH) if np.any(place) else "(0, 0, 0) mm"
    by = [f"{units.format_value(v, unit)} along {along}" if v else f"0 along {along}" for v in (known, value)]
    found = fault(
        "E305",
        other.at("where"),
        f"`{one.name}` and `{other.name}` prescribe different values at the same points",
        "contradicts the other",
        f"select other points, or remove {along} from one of them: `components = ({_other_components(along)})`",
    )
    span = one.at("where").span
    line = f" (line {span.line})" if span is not None else ""
    note = f"at {at} `{one.name}`{line} prescribes {by[0]}, `{other.name}` {by[1]}"
    return Fault(replace(found.diagnostic, notes=(note,)))


def _other_components(along: str) -> str:
    """Return the names of the other two components of a vector."""
    return ", ".join(axis for axis in AXES if axis != along)


def must_be_held(case: Case, rows: Floats, centre: Floats, extent: float) -> None:
    """Raise Fault if the supports leave a rigid motion free."""
    motions = free_motions(_scale_rotations(rows, extent), centre, extent)
    if not motions:
        return
    raise unsupported_fault(case, "it", motions)


def unsupported_fault(case: Case, what: str, motions: list[str]) -> Fault:
    """Return the Fault for supports that leave a body free to move.

    `what` names the body or the part of it that is free, and `motions` are descriptions of the free motions.
    """
    at = case.named_supports[0].at() if case.named_supports else case.body.at()
    return fault(
        "E306",
        at,
        f"the supports of `{case.body.name}` leave {what} free to {join_motions(motions)}",
        "not enough supports",
        "hold more components, or more of the body",
    )
