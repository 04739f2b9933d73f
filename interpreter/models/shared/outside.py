"""What a body meets at its surface: beds that it lies on, and rigid bodies; nothing is imported where there is none."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from softmark.interpreter.problem.case import Case
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
