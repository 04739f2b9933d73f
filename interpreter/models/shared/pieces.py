"""The cells of a mesh by their materials: all together for a body of one, which pays nothing for those of several."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.scene import Declared
from softmark.interpreter.problem.case import Case
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.solvers.mesh.interpolation import Integration
    from softmark.solvers.mesh.mesh import Mesh


@dataclass(frozen=True)
class Piece:
    """The cells of one material: a case of that material alone, a mesh of these cells over all nodes.

    `which` (k,) are their numbers in the whole mesh.
    """

    case: Case
    mesh: Mesh
    parts: Integration
    which: Any


def pieces(case: Case, mesh: Mesh, parts: Integration) -> tuple[Piece, ...]:
    """The cells of every material that has some; of a body of one material the whole. Raises Fault."""
    if not case.parts:
        return (Piece(case, mesh, parts, slice(None)),)
    from softmark.interpreter.models.shared import regions

    return tuple(Piece(*own) for own in regions.pieces(case, mesh, parts))


def facts(case: Case, mesh: Mesh | None) -> dict[str, Any]:
    """What a report says of the parts on a mesh; nothing of a body of one material."""
    if not case.parts or mesh is None:
        return {}
    from softmark.interpreter.models.shared import regions

    return regions.facts(case, mesh)


def notes(declared: Declared, case: Case, mesh: Mesh) -> tuple[Diagnostic, ...]:
    """Warnings about the parts on a mesh; none of a body of one material."""
    if not case.parts:
        return ()
    from softmark.interpreter.models.shared import regions

    return tuple(regions.notes(declared, case, mesh))
