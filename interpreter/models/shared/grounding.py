"""Bodies that supports leave free, and only touch can hold: what keeps them until it does, and what stays free."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.messages import diagnostic
from softmark.interpreter.language.scene import Declared
from softmark.interpreter.models.beam.rigid import point_rows
from softmark.interpreter.models.shared.holding import Held, held_of, left_free, listed
from softmark.interpreter.problem.case import Case
from softmark.records import dataclass
from softmark.solvers.energies.ground import Ground
from softmark.solvers.statics.grounded import GONE

if TYPE_CHECKING:
    from softmark.solvers.contact.touching import Touching
    from softmark.solvers.energies.energy import Floats
    from softmark.solvers.mesh.interpolation import Integration
    from softmark.solvers.mesh.mesh import Mesh

WEAKEST = 1e-6  # of Young's modulus times the size: a spring that a body hardly feels, and factors of its tangent bear


@dataclass(frozen=True)
class Loose:
    """A body that supports leave free: how they hold it, and the spring that keeps it until it touches."""

    held: Held
    spring: Ground

    def kept(self, declared: Declared, contacts: Mapping[str, Touching], u: Floats) -> tuple[Diagnostic, str]:
        """What holds it in a state u (3 n,), m, without numbers of that state: several of which it is true are named.

        What it is free to do still, in words, or nothing where it is held.
        """
        case = self.held.case
        pressing = {name: rows for name, contact in contacts.items() if len(rows := self._rows(contact, u))}
        left = left_free(self.held, [*pressing.values()])
        adrift = listed(left) if left else ""
        by = " and ".join(f"`{name}`" for name in pressing)
        problem = f"supports leave `{case.body.name}` free to {listed(left_free(self.held, []))}: "
        problem += f"{by} {'hold' if len(pressing) > 1 else 'holds'} it" if by else "nothing touches it"
        stays = f"; free to {adrift} still, it stays where it was" if adrift else ""
        remedy = "a spring keeps it where it is; what is to hold it must come nearer"
        if by:
            remedy = f"a spring kept it on the way, and bears less than {GONE:.0e} of the forces now{stays}"
        label = "held by what it touches" if by else "held by nothing"
        return diagnostic("W613", declared.at(), problem, label, remedy), adrift

    def _rows(self, contact: Any, u: Floats) -> Floats:
        """What rigid motions do to gaps of points that are pressed, and along the surface where they stick (r, 6)."""
        on = contact.pressures(u) > 0.0
        moved = point_rows(contact.places(u)[on] - self.held.centre, (0, 1, 2)).reshape(-1, 3, 6)
        rows = np.einsum("pi,pij->pj", contact.look(u)[1][on], moved)
        sticks = moved[~contact.slip(u).slides[on]] if contact.rubs else moved[:0]
        return np.concatenate([rows, sticks.reshape(-1, 6)])


def loose(case: Case, mesh: Mesh, parts: Integration, measured: Mapping[str, Any], dofs: int) -> Loose | None:
    """What keeps a body on a mesh that supports leave free, in a state of so many unknowns; None where none is left."""
    held = held_of(case, mesh, measured)
    if not left_free(held, []):
        return None
    each = np.repeat(parts.w.sum(axis=1) / mesh.cells.shape[1], mesh.cells.shape[1])
    volumes = np.bincount(mesh.cells.ravel(), each, len(mesh.points)).astype(np.float64)
    spring = WEAKEST * case.largest_young * mesh.extent
    return Loose(held, Ground(volumes / volumes.sum(), spring, np.zeros(dofs)))
