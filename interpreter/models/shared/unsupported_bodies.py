"""Bodies that supports leave free and only contact can hold: stabilization, and motions that remain free.

Each piece of a body is checked separately, under the assumption that everything it touches is fixed.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.beam.rigid_motions import rigid_motion_rows
from softmark.interpreter.models.shared.support_constraints import (
    Constraints,
    build_constraints,
    join_motions,
    remaining_rigid_motions,
    unsupported_fault,
)
from softmark.interpreter.problem.body_case import Case
from softmark.records import dataclass
from softmark.solvers.contact.tie_constraint import TieConstraint
from softmark.solvers.energies.energy import DynamicPatternEnergy
from softmark.solvers.energies.stabilization_spring import StabilizationSpring
from softmark.solvers.statics.free_body_stabilization import GONE

if TYPE_CHECKING:
    from softmark.solvers.energies.energy import Floats
    from softmark.solvers.mesh.element_interpolation import IntegrationPoints
    from softmark.solvers.mesh.mesh import Mesh

Bools = NDArray[np.bool_]
WEAKEST = 1e-6  # of Young's modulus times size: a negligible stiffness with which the tangent can still be factorized


@dataclass(frozen=True)
class UnsupportedBody:
    """Body that supports leave free: its constraints, and the spring that stabilizes it until it is in contact.

    `pieces` (k, n) marks the nodes of each free piece; `whole` is true if the body has only one piece.
    """

    held: Constraints
    spring: StabilizationSpring
    pieces: Bools
    whole: bool

    def warnings_and_motions(
        self, declared: Declared, contacts: Mapping[str, Any], u: Floats
    ) -> tuple[tuple[Diagnostic, ...], str]:
        """Return warnings about free pieces of a body in a state u (3 n,), m, and a description of their free motions.

        A warning names the contacts that hold the piece. It has no numbers of the state, so that equal warnings of
        several states can be merged. The description is empty if contacts hold all pieces.
        """
        each = [self._warning_and_motions(declared, contacts, u, piece) for piece in self.pieces]
        return tuple(note for note, _ in each), ", and to ".join(adrift for _, adrift in each if adrift)

    def _warning_and_motions(
        self, declared: Declared, contacts: Mapping[str, Any], u: Floats, piece: Bools
    ) -> tuple[Diagnostic, str]:
        """Return the warning and the remaining free motions of one piece, whose nodes `piece` (n,) marks."""
        pressing = {
            name: rows
            for name, contact in contacts.items()
            if len(rows := self._contact_constraint_rows(contact, u, piece))
        }
        left = remaining_rigid_motions(self.held, piece, [*pressing.values()])
        adrift = join_motions(left) if left else ""
        by = " and ".join(f"`{name}`" for name in pressing)
        body = f"`{self.held.case.body.name}`"
        what = body if self.whole else f"a piece of {body}"
        problem = f"supports leave {what} free to {join_motions(remaining_rigid_motions(self.held, piece, []))}: "
        problem += f"only {by} {'hold' if len(pressing) > 1 else 'holds'} it" if by else "nothing touches it"
        stays = f"; it is still free to {adrift} and stays at its initial position there" if adrift else ""
        remedy = "only an artificial spring holds it in place: move the body or surface that should touch it closer"
        if by:
            remedy = "an artificial spring held it during the solution; at the end the spring carries less than "
            remedy += f"{GONE:.0e} of the forces{stays}"
        label = "held only by contact" if by else "not held"
        return diagnostic("W613", declared.at(), problem, label, remedy), adrift

    def _contact_constraint_rows(self, contact: Any, u: Floats, piece: Bools) -> Floats:
        """Return the constraint rows (r, 6) that a contact adds for rigid motions of a piece.

        A sliding point restricts motion along its normal; a sticking point restricts all directions.
        """
        X, n, sticks = (
            _pressed_samples(contact, u, piece)
            if isinstance(contact, DynamicPatternEnergy)
            else _pressed_points(contact, u, piece)
        )
        moved = rigid_motion_rows(X - self.held.centre, (0, 1, 2)).reshape(-1, 3, 6)
        return np.concatenate([np.einsum("pi,pij->pj", n, moved), moved[sticks].reshape(-1, 6)])


def _pressed_points(contact: Any, u: Floats, piece: Bools) -> tuple[Floats, Floats, Bools]:
    """Return positions (p, 3), m, normals (p, 3) and sticking states (p,) of points pressed by a rigid body."""
    nodes = getattr(contact, "nodes", None)
    on = contact.pressures(u) > 0.0
    if nodes is not None and len(nodes) == len(on):
        on = on & piece[nodes]
    sticks = ~contact.slip(u).slides[on] if contact.has_friction else np.zeros(int(on.sum()), dtype=np.bool_)
    return contact.places(u)[on], contact.look(u)[1][on], sticks


def _pressed_samples(contact: Any, u: Floats, piece: Bools) -> tuple[Floats, Floats, Bools]:
    """Return positions (p, 3), m, normals (p, 3) and sticking states (p,) of contact samples between two pieces."""
    from softmark.solvers.contact.deformable_friction import DeformableFriction

    hold, skin = (
        (contact if contact.has_friction else DeformableFriction(contact, 0.0)).tangential_coupling(u),
        contact.skin,
    )
    own = (abs(hold.W) @ np.repeat(piece, 3).astype(np.float64)).reshape(hold.n.shape).any(axis=1)
    X, n = (np.zeros((int(own.sum()), 3)) for _ in range(2))
    d = skin.X.shape[1]
    X[:, :d], n[:, :d] = skin.places(u)[skin.corners + hold.which[own]], hold.n[own]
    slides = hold.slip(u, contact.friction).slides[own] if contact.has_friction else np.ones(len(X), dtype=np.bool_)
    return X, n, ~slides


def find_unsupported_body(
    case: Case, mesh: Mesh, parts: IntegrationPoints, measured: Mapping[str, Any], dofs: int, beds: Mapping[str, Any]
) -> UnsupportedBody | None:
    """Return the stabilization of a body that supports leave free; None if supports hold every piece.

    `dofs` is the number of unknowns. Raises Fault if a free piece has no contact that could hold it.
    """
    held = build_constraints(case, mesh, measured)
    every = _pieces(mesh, beds)
    free = np.array([piece for piece in every if remaining_rigid_motions(held, piece, [])])
    if not len(free):
        return None
    if not (case.contacts or any(isinstance(bed, DynamicPatternEnergy) for bed in beds.values())):
        raise unsupported_fault(case, "a piece of it", remaining_rigid_motions(held, free[0], []))
    each = np.repeat(parts.w.sum(axis=1) / mesh.cells.shape[1], mesh.cells.shape[1])
    volumes = np.bincount(mesh.cells.ravel(), each, len(mesh.points)).astype(np.float64) * free.any(axis=0)
    spring = WEAKEST * case.largest_young * mesh.extent
    return UnsupportedBody(
        held, StabilizationSpring(volumes / volumes.sum(), spring, np.zeros(dofs)), free, len(every) == 1
    )


def _pieces(mesh: Mesh, beds: Mapping[str, Any]) -> Bools:
    """Return a mask of the nodes of each piece of a body (k, n); pieces that are tied together count as one."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    n = len(mesh.points)
    joined = [mesh.cells, *(bed.nodes for bed in beds.values() if isinstance(bed, TieConstraint))]
    ends = [(np.repeat(nodes[:, 0], nodes.shape[1]), nodes.ravel()) for nodes in joined]
    a, b = (np.concatenate(side) for side in zip(*ends, strict=True))
    count, of = connected_components(coo_matrix((np.ones(len(a)), (a, b)), shape=(n, n)), directed=False)
    found: Bools = of == np.arange(count)[:, None]
    return found
