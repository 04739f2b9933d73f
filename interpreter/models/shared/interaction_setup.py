"""Interactions of a body's surface: foundations, ties, self-contact and rigid contacts.

Their code is imported only if a scene has them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.self_contact_words import Tied
from softmark.solvers.assembly.assembly import number_energies
from softmark.solvers.energies.stabilization_spring import STABILIZATION

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.models.postprocessing.nodal_forces import NodalForces
    from softmark.interpreter.models.shared.prepared_model import DeformedMesh
    from softmark.interpreter.models.shared.unsupported_bodies import UnsupportedBody
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.assembly.assembly import Assembly
    from softmark.solvers.contact.interaction_state import InteractionState
    from softmark.solvers.contact.rigid_contact import RigidContact
    from softmark.solvers.energies.energy import Energy, Floats
    from softmark.solvers.mesh.element_interpolation import IntegrationPoints
    from softmark.solvers.mesh.mesh import Mesh
    from softmark.solvers.statics.static_equilibrium import Equilibrium, Statics

Solid = TypeVar("Solid")


def create_surface_interactions(case: Case, mesh: Mesh) -> dict[str, Any]:
    """Return the elastic foundations, ties and self-contacts of a body, by name. Raises Fault."""
    found: dict[str, Any] = {}
    if case.beds:
        from softmark.interpreter.models.shared.foundation_setup import create_foundations

        found |= create_foundations(case, mesh)
    if case.pairs:
        from softmark.interpreter.models.shared.self_contact_setup import create_pair_energies

        found |= create_pair_energies(case, mesh)
    return found


def create_rigid_contacts(case: Case, mesh: Mesh) -> dict[str, RigidContact]:
    """Return the energies of the contacts of a body with rigid bodies, by name. Raises Fault."""
    if not case.contacts:
        return {}
    from softmark.interpreter.models.shared.rigid_contact_setup import contacts_on

    return contacts_on(case, mesh)


def find_unsupported_body(
    case: Case, mesh: Mesh, parts: IntegrationPoints, measured: Mapping[str, Any], dofs: int, beds: Mapping[str, Any]
) -> UnsupportedBody | None:
    """Return the stabilization of a body that supports leave free and contact must hold. Raises Fault.

    The result is None if supports hold the body.
    """
    if not (case.contacts or case.pairs) or isinstance(case.analysis, Dynamic):
        return None
    from softmark.interpreter.models.shared import unsupported_bodies

    return unsupported_bodies.find_unsupported_body(case, mesh, parts, measured, dofs, beds)


def find_equilibrium(solid: Any, problem: Statics) -> Equilibrium:
    """Return the equilibrium of a solid with contacts, and of its force-driven rigid body. Raises NotConverged."""
    from softmark.solvers.statics.barrier_continuation import RigidBodyTunnelling, solve_with_stiffer_barriers
    from softmark.solvers.statics.rigid_substeps import count_substeps, presses_on_nodes, solve_in_substeps
    from softmark.solvers.statics.static_equilibrium import equilibrium

    def whole(problem: Statics) -> Equilibrium:
        """Return the equilibrium by barrier continuation, with stabilization if supports leave the body free."""
        if solid.loose is None:
            return solve_with_stiffer_barriers(problem, equilibrium)
        from softmark.solvers.statics.free_body_stabilization import solve_with_vanishing_spring

        return solve_with_stiffer_barriers(problem, lambda own: solve_with_vanishing_spring(own, equilibrium))

    def find(problem: Statics) -> Equilibrium:
        """Return the equilibrium in one step.

        If a rigid body has passed through the surface, its motion is divided into substeps.
        """
        try:
            return whole(problem)
        except RigidBodyTunnelling as failure:
            count = count_substeps(problem)
            if count == 1 or not _are_rigid_bodies_wide(solid):
                raise
            found = solve_in_substeps(problem, whole, count)
            if solid.pieces[0].original.planar and not presses_on_nodes(found):
                raise failure from None
            return found

    case: Case = solid.pieces[0].original
    if not case.has_force_driven_body:
        return find(problem)
    from softmark.interpreter.models.shared.force_driven_rigid_bodies import force_driven_problem
    from softmark.solvers.statics.force_controlled_rigid_body import solve_force_balance

    press = force_driven_problem(case, solid.contacts)
    assert press is not None
    return solve_force_balance(problem, press, find)


def _are_rigid_bodies_wide(solid: Any) -> bool:
    """Return whether every rigid body of a solid is at least as wide as the facets that it may press on.

    A narrower rigid body fits between the nodes of a facet.
    """
    import numpy as np

    from softmark.interpreter.models.shared.rigid_contact_setup import longest_triangle_side

    case: Case = solid.pieces[0].original
    for touch in case.contacts:
        if (bounds := touch.rigid.thing.shape.bounds) is None:
            return False
        low, high = np.array(bounds)
        facets, points = solid.contacts[touch.name].facets, solid.mesh.points
        extents = (high - low)[:2] if case.planar else high - low
        flat = points * (1.0, 1.0, 0.0) if case.planar else points
        if np.sort(extents)[-1 if case.planar else 1] < longest_triangle_side(flat, facets):
            return False
    return True


def rigid_body_report(solid: Any, known: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return the report of a force-driven rigid body from the solver's results `known`; empty without such a body."""
    if known is None:
        return {}
    from softmark.interpreter.models.shared import force_driven_rigid_bodies

    return {"rigid": force_driven_rigid_bodies.rigid_body_report(solid.pieces[0].original, known)}


def with_moved_rigid_bodies(case: Case, mesh: DeformedMesh | None) -> Case:
    """Return a case with its force-driven rigid bodies moved to their positions in a solved state, given by `mesh`.

    A case without such bodies is returned unchanged.
    """
    if mesh is None or not case.has_force_driven_body:
        return case
    from softmark.interpreter.models.shared import force_driven_rigid_bodies

    return force_driven_rigid_bodies.move_rigid_bodies(case, mesh.interactions)


def contacts_at_equilibrium(solid: Any, found: Equilibrium) -> dict[str, RigidContact]:
    """Return the contacts of a solid at the equilibrium `found`, with stiffened barriers and added contact points."""
    contacts: dict[str, RigidContact] = found.contacts or solid.contacts
    return contacts


def describe_free_motions(
    solid: Any, contacts: Mapping[str, RigidContact], x: Floats
) -> tuple[tuple[Diagnostic, ...], str]:
    """Return warnings about a solid that its supports leave free, and a description of its free motions.

    The motions are judged with the contacts in a state x (3 n,), m. Without free motions the description is empty.
    """
    if solid.loose is None:
        return (), ""
    from softmark.solvers.energies.energy import DynamicPatternEnergy

    pairs = {name: bed for name, bed in solid.beds.items() if isinstance(bed, DynamicPatternEnergy)}
    notes, adrift = solid.loose.warnings_and_motions(solid.declared, {**contacts, **pairs}, x)
    return notes, adrift


def assembly_without_stabilization(solid: Any, contacts: Mapping[str, RigidContact]) -> Assembly:
    """Return the assembly of a solid with the given contacts but without the stabilization spring."""
    known: Assembly = solid.assembly
    if any(contact is not solid.contacts[name] for name, contact in contacts.items()):
        known = known.with_energies(contacts)
    return (
        known
        if solid.loose is None
        else known.with_energies(number_energies(STABILIZATION, [solid.loose.spring.without_stiffness]))
    )


def recenter_stabilization(solid: Solid, x: Floats) -> Solid:
    """Return a solid whose stabilization spring is unstressed in a state x (dofs,), m.

    A solid without such a spring is returned unchanged.
    """
    known: Any = solid
    if known.loose is None:
        return solid
    spring = replace(known.loose.spring, place=x.copy())
    assembly = known.problem.assembly.with_energies(number_energies(STABILIZATION, [spring]))
    found: Solid = replace(known, problem=replace(known.problem, assembly=assembly))
    return found


def resume_interactions(made: Solid, before: DeformedMesh) -> Solid:
    """Return a solid whose interactions continue from their states after the previous state `before`."""
    known: Any = made  # a dataclass with a problem, its beds and its contacts
    if not (states := before.interactions):
        return made
    x = before.displacement.ravel()
    beds, contacts = (
        {name: own.resumed(states[name], x) if name in states else own for name, own in each.items()}
        for each in (known.beds, known.contacts)
    )
    others, exact = {**beds, **contacts}, known.problem.exact
    exact = None if exact is None else exact.with_energies(others)
    problem = replace(known.problem, assembly=known.problem.assembly.with_energies(others), exact=exact)
    found: Solid = replace(known, problem=problem, beds=beds, contacts=contacts, interactions=states)
    return found


def interaction_states(solid: Any, u: Floats, contacts: Mapping[str, RigidContact]) -> dict[str, InteractionState]:
    """Return the states of the interactions of a solid at displacements u (n, 3), m, by name.

    `contacts` are its contacts with rigid bodies in that state. An interaction without a state is left out.
    """
    energies: dict[str, Energy] = {**solid.beds, **contacts}
    found = {name: own.interaction_state(u.ravel(), solid.interactions.get(name)) for name, own in energies.items()}
    return {name: state for name, state in found.items() if state is not None}


def add_contact_forces(
    found: NodalForces, contacts: Mapping[str, RigidContact], solid: Any, states: Mapping[str, InteractionState]
) -> NodalForces:
    """Return the nodal forces of a solid with the forces of rigid contacts, self-contact and friction added.

    `states` are the states of the interactions, by name.
    """
    rubbed = {name: state.friction for name, state in states.items() if state.friction is not None}
    case, u = solid.pieces[0].original, found.u.ravel()
    if contacts:
        from softmark.interpreter.models.postprocessing import nodal_forces

        found = nodal_forces.add_rigid_contact_forces(found, contacts, case)
    touches = dict(found.touches)
    if own := [pair.name for pair in case.pairs if not isinstance(pair.thing, Tied)]:
        from softmark.interpreter.models.postprocessing.deformable_contact_results import contact_result

        touches |= {n: contact_result(case, solid.beds[n], solid.mesh, found.x, u, rubbed.get(n)) for n in own}
    if rubbed:
        from softmark.interpreter.models.postprocessing.rigid_friction_results import add_friction_result

        touches |= {n: add_friction_result(touches[n], contact, u, rubbed.get(n)) for n, contact in contacts.items()}
    return replace(found, touches=touches, dissipated=found.dissipated + sum(own.work for own in rubbed.values()))
