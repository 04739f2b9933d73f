"""Setup of self-contact of a body and of ties between its pieces, as energies of its surface."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.language import units
from softmark.interpreter.models.shared.rigid_contact_setup import size_of
from softmark.interpreter.problem.body_case import fault
from softmark.interpreter.vocabulary.self_contact_words import REACH
from softmark.interpreter.vocabulary.self_contact_words import Tied as TiedWord
from softmark.solvers.contact.contact_surface import (
    ContactSurface,
    build_contact_surface,
    mask_nodes_after_first_piece,
    number_mesh_pieces,
)
from softmark.solvers.contact.deformable_contact import IpcContact, IpctkMissing, import_ipctk
from softmark.solvers.contact.tie_constraint import TieConstraint, tie_surfaces
from softmark.solvers.mesh.plane_boundary import is_on_border

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.energies.energy import Energy, Ints
    from softmark.solvers.mesh.mesh import Mesh

THIN = 1e-3  # of the size of a body: distance at which the barrier becomes active
SOFT = 0.1  # of Young's modulus: stiffness of the barrier
STRAIGHT, CURVED = 3, 4  # parts of a side of a facet with nodes at its corners alone, and of others
STIFF = 1e4  # times Young's modulus over the size of a body: stiffness of a tie
CLOSE = 1e-8  # of the size: nearer surfaces are in contact


def create_pair_energies(case: Case, mesh: Mesh) -> dict[str, Any]:
    """Return the energy of every self-contact and every tie, by name. Raises Fault."""
    return {
        p.name: (_tie_energy if isinstance(p.thing, TiedWord) else _friction_contact_energy)(case, p, mesh)
        for p in case.pairs
    }


def _friction_contact_energy(case: Case, pair: Declared, mesh: Mesh) -> Energy:
    """Return the energy of one self-contact, including friction if declared."""
    pressing = _barrier_energy(case, pair, mesh)
    if not pair.thing.friction:
        return pressing
    from softmark.solvers.contact.deformable_friction import DeformableFriction

    return DeformableFriction(pressing, pair.thing.friction)


def _barrier_energy(case: Case, pair: Declared, mesh: Mesh) -> IpcContact:
    """Return the barrier energy of one self-contact. Raises Fault if its surfaces overlap at the start."""
    _must_be_installed(pair)
    said, several = pair.thing, int(number_mesh_pieces(mesh).max()) > 0
    parts = said.parts or (STRAIGHT if mesh.facets.shape[1] == mesh.element.facet.corners else CURVED)
    skin = build_contact_surface(
        mesh, mesh.points.size, parts, _facets(case, pair, mesh), bool(case.planar), case.depth
    )
    thickness = _represented_depth(case, mesh, skin)
    usual = THIN * size_of(case, mesh)
    asked = said.distance or usual
    stiffness = said.stiffness or SOFT * case.largest_young
    told = mask_nodes_after_first_piece(mesh)
    made = IpcContact(skin, asked, stiffness, several, thickness, told, mesh.points)
    left = _gap(pair, made, size_of(case, mesh))
    if left == asked:
        return made
    if said.distance is None:
        return IpcContact(skin, left, stiffness, several, thickness, told, mesh.points)
    raise fault(
        "E631",
        pair.at("distance"),
        f"`distance` of `{pair.name}` is {units.format_value(asked, units.LENGTH)}, more than the "
        f"initial gap of {units.format_value(left, units.LENGTH)} between its surfaces",
        "pressure in the undeformed state",
        "write a smaller `distance`, or remove `distance`: the default is at most the gap",
    )


def _represented_depth(case: Case, mesh: Mesh, skin: ContactSurface) -> float:
    """Return the depth of the body that one length of its contact surface represents, m.

    It is the thickness of a plane slice, the circumference of the middle ring of a body of revolution, or 1 in 3D.
    """
    if case.depth:
        return float(2.0 * np.pi * np.abs(skin.X[:, 0]).mean())
    return float(np.ptp(mesh.points[:, 2])) if case.planar else 1.0


def _gap(pair: Declared, made: IpcContact, size: float) -> float:
    """Return the gap between the surfaces at the start, m, at most the barrier distance. Raises Fault if they touch."""
    rest = np.zeros(made.skin.M.shape[1])
    found = 0.0 if made.intersects(rest) else min(made.least(rest), made.distance)
    if found > CLOSE * size:
        return found
    raise fault(
        "E631",
        pair.at(),
        f"the surfaces of `{pair.name}` touch or overlap in the undeformed state",
        "no initial gap",
        "leave a gap of about 1/1000 of the size between the shapes, more for curved surfaces with flat "
        "facets; write `tied(...)` for surfaces that are joined",
    )


def _must_be_installed(pair: Declared) -> None:
    """Raise Fault if the package ipctk is not installed."""
    try:
        import_ipctk()
    except IpctkMissing as error:
        raise fault(
            "E630",
            pair.at(),
            f"`{pair.name}` needs the package ipctk, which is not installed",
            "no contact between deformable bodies",
            'run pip install "softmark[contact]"',
        ) from error


def _tie_energy(case: Case, pair: Declared, mesh: Mesh) -> TieConstraint:
    """Return the energy of one tie. Raises Fault if the tie joins no surfaces."""
    said, of = pair.thing, number_mesh_pieces(mesh)
    which = _facets(case, pair, mesh)
    piece = of[mesh.facets[which, 0]]
    stiffness = said.stiffness or STIFF * case.largest_young / size_of(case, mesh)
    reach = said.reach or REACH * size_of(case, mesh)
    sides = [(which[piece == a], which[piece > a]) for a in range(int(of.max()))]
    each = [
        tie_surfaces(mesh, one, other, stiffness, reach, case.depth) for one, other in sides if len(one) and len(other)
    ]
    each = [made for made in each if len(made.nodes)]
    if not each:
        raise fault(
            "E632",
            pair.at("where" if "where" in pair.fields else ""),
            f"`{pair.name}` finds no surfaces of `{case.body.name}` that face each other",
            "ties nothing",
            "write a larger `reach`, or another `where`: two pieces of the body must have surfaces "
            f"within {units.format_value(reach, units.LENGTH)} of each other",
        )
    return TieConstraint(
        np.concatenate([t.nodes for t in each]),
        np.concatenate([t.K for t in each]),
        sum(t.area for t in each),
        stiffness,
        mask_nodes_after_first_piece(mesh),
    )


def _facets(case: Case, pair: Declared, mesh: Mesh) -> Ints:
    """Return the indices of the surface facets that the condition of a contact or tie selects.

    For a plane slice these are the facets of its edge. Raises Fault.
    """
    from softmark.interpreter.problem.surface_selection.loaded_surface_part import find_loaded_surface

    rows = find_loaded_surface(case.shape, mesh, pair.thing.where).selected_facets
    known = {tuple(row): i for i, row in enumerate(np.sort(mesh.facets, axis=1).tolist())}
    found = np.array(sorted({known[tuple(row)] for row in np.sort(rows, axis=1).tolist()}), dtype=np.int64)
    if case.planar:
        found = found[is_on_border(mesh.points, mesh.facets[found], case.depth > 0.0)]
    if not len(found):
        raise fault(
            "E302",
            pair.at("where" if "where" in pair.fields else ""),
            f"`{pair.name}` selects no part of the surface of `{case.body.name}`",
            "selects nothing",
            "write a condition that holds on a part of the surface of the body",
        )
    return found
