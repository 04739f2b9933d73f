"""What a body meets at its surface: beds that it lies on, and rigid bodies; nothing is imported where there is none."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from softmark.interpreter.models.fem.build import PreparedSolid
    from softmark.interpreter.models.shared.prepared import Moved
    from softmark.interpreter.problem.case import Case
    from softmark.solvers.assembly.assembly import Assembly
    from softmark.solvers.contact.gaps.gap import Gap
    from softmark.solvers.contact.touching import Touching
    from softmark.solvers.energies.bedding import Bedding
    from softmark.solvers.mesh.mesh import Mesh


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


def as_stiff(
    contacts: Mapping[str, Touching], assembly: Assembly, factor: float
) -> tuple[Mapping[str, Touching], Assembly]:
    """Contacts, which are the last of the loads, and the assembly, with barriers so many times as stiff."""
    if factor == 1.0 or not contacts:
        return contacts, assembly
    stiffer = {name: contact.stiffer(factor) for name, contact in contacts.items()}
    loads = [*assembly.loads[: -len(stiffer)], *stiffer.values()]
    return stiffer, assembly.acting(assembly.internal, loads)


def resumed(made: PreparedSolid, before: Moved) -> PreparedSolid:
    """The same, whose contacts know where their rigid bodies were in the state before."""
    if not before.beside:
        return made
    contacts = {n: replace(c, earlier=before.beside[n]) for n, c in made.contacts.items()}
    loads = [*made.problem.assembly.loads[: -len(contacts)], *contacts.values()]
    assembly = made.problem.assembly.acting(made.problem.assembly.internal, loads)
    return replace(made, problem=replace(made.problem, assembly=assembly), contacts=contacts)


def beside(contacts: Mapping[str, Touching]) -> dict[str, Gap]:
    """The rigid bodies where they are, by contact."""
    return {name: contact.body for name, contact in contacts.items()}
