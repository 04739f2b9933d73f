"""What a body meets at its surface: beds that it lies on, and rigid bodies; nothing is imported where there is none."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from softmark.interpreter.models.answers.carried import Carried
    from softmark.interpreter.models.fem.build import PreparedSolid
    from softmark.interpreter.models.shared.rubbing import Past
    from softmark.interpreter.problem.case import Case
    from softmark.solvers.contact.touching import Touching
    from softmark.solvers.energies.energy import Floats
    from softmark.solvers.energies.bedding import Bedding
    from softmark.solvers.mesh.mesh import Mesh
    from softmark.solvers.statics.problem import Statics


def beds(case: Case, mesh: Mesh) -> dict[str, Bedding]:
    """The springs that it lies on, by name. Raises Fault."""
    if not case.beds:
        return {}
    from softmark.interpreter.models.shared.bedding import beds_on

    return beds_on(case, mesh)


def contacts(case: Case, mesh: Mesh) -> dict[str, Touching]:
    """The energies of its contacts, by name. Raises Fault."""
    if not case.contacts:
        return {}
    from softmark.interpreter.models.shared.contacting import contacts_on

    return contacts_on(case, mesh)


def past(contacts: Mapping[str, Touching], u: Floats, before: Past) -> Past:
    """What friction remembers after displacements u (3 n,), m; nothing where there is none."""
    if not any(contact.rubs for contact in contacts.values()):
        return {}
    from softmark.interpreter.models.shared.rubbing import past_of

    return past_of(contacts, u, before)


def resumed(prepared: PreparedSolid, past: Past) -> PreparedSolid:
    """A model that goes on from what friction remembers of the state before."""
    if not past:
        return prepared
    from softmark.interpreter.models.shared import rubbing

    contacts = rubbing.resumed(prepared.contacts, past)
    problem = rubbing.exchanged(prepared.problem, prepared.contacts, contacts)
    return replace(prepared, contacts=contacts, problem=problem, past=past)


def begun(problem: Statics, x: Floats, contacts: Mapping[str, Touching], past: Past) -> Statics:
    """A problem that starts from a state x before, moved on with what sticks to rigid bodies."""
    if not past:
        return replace(problem, start=x)
    from softmark.interpreter.models.shared import rubbing

    return replace(problem, start=rubbing.begun(problem, x, contacts, past))


def touched(found: Carried, contacts: Mapping[str, Touching], case: Case, before: Past) -> Carried:
    """What acts on a body, with what rigid bodies do to it."""
    from softmark.interpreter.models.answers import carried

    found = carried.touched(found, contacts, case)
    rubbed = past(contacts, found.u.ravel(), before)
    if not rubbed:
        return found
    from softmark.interpreter.models.shared.rubbing import slipped

    touches = {n: slipped(t, contacts[n], found.u.ravel(), rubbed.get(n)) for n, t in found.touches.items()}
    return replace(found, touches=touches, dissipated=found.dissipated + sum(own.work for own in rubbed.values()))
