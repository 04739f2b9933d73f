"""What a body meets at its surface: beds that it lies on, and rigid bodies; nothing is imported where there is none."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from softmark.interpreter.problem.case import Case
    from softmark.solvers.contact.touching import Touching
    from softmark.solvers.mesh.mesh import Mesh


def beds(case: Case, mesh: Mesh) -> dict[str, Any]:
    """The springs that it lies on, ties of its pieces and what keeps it clear of itself, by name. Raises Fault."""
    found: dict[str, Any] = {}
    if case.beds:
        from softmark.interpreter.models.shared.bedding import beds_on

        found |= beds_on(case, mesh)
    if case.pairs:
        from softmark.interpreter.models.shared.pairing import pairs_on

        found |= pairs_on(case, mesh)
    return found


def contacts(case: Case, mesh: Mesh) -> dict[str, Touching]:
    """The energies of its contacts, by name. Raises Fault."""
    if not case.contacts:
        return {}
    from softmark.interpreter.models.shared.contacting import contacts_on

    return contacts_on(case, mesh)
