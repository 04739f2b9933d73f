"""The cells of a mesh by their materials: all together for a body of one, which pays nothing for those of several."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.problem.body_case import Case
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.solvers.mesh.element_interpolation import Integration
    from softmark.solvers.mesh.mesh import Mesh


@dataclass(frozen=True)
class Piece:
    """The cells of one material: a case of that material alone, a mesh of these cells over all nodes.

    `which` (k,) are their numbers in the whole mesh, `number` is that of the material. Where constants vary in space
    `sampled` gives the same with arrays for them, and keeps what they were as `graded`.
    """

    case: Case
    mesh: Mesh
    parts: Integration
    which: Any
    number: int = 0
    graded: Case | None = None

    @property
    def density(self) -> Any:
        """kg/m^3; a `Density` where it varies (heterogeneous_material.py)."""
        case = self.graded or self.case
        if case.uniform:
            return case.material.density
        from softmark.interpreter.models.shared import heterogeneous_material

        return heterogeneous_material.density_of(case)


def sampled(each: tuple[Piece, ...], pressures: bool = False) -> tuple[Piece, ...]:
    """Pieces with the constants of materials that vary at their points of integration. Raises Fault.

    Where cells need other points than those of their element, `parts` are those; with `pressures` in the cells as well.
    """
    return each if all(own.case.uniform for own in each) else tuple(_sampled(own, pressures) for own in each)


def _sampled(own: Piece, pressures: bool) -> Piece:
    from softmark.interpreter.models.shared import heterogeneous_material

    if own.case.uniform:
        return own
    case, parts = heterogeneous_material.at_points(own, pressures)
    return replace(own, case=case, graded=own.case, parts=own.parts if parts is None else parts)


LocalPoints = tuple[Any, Any]  # of each cell, (m, q, 3), and their weights (m, q)


def own_points(case: Case, mesh: Mesh, which: Any, pressures: bool) -> LocalPoints | None:
    """Return the points at which cells integrate stiffness constants; None if they are those of their element.

    `which` selects the cells of the mesh that have the material of the `case`.
    """
    if case.uniform:
        return None
    from softmark.interpreter.models.shared import heterogeneous_material

    own = some_cells(mesh, which)
    return _local(heterogeneous_material.stiffness_of(case, own, pressures), own)


def mass_points(case: Case, mesh: Mesh, which: Any) -> LocalPoints | None:
    """Return the points at which the `which` cells integrate density; None if they are those of their element."""
    if case.uniform:
        return None
    from softmark.interpreter.models.shared import heterogeneous_material

    own = some_cells(mesh, which)
    return _local(heterogeneous_material.density_resolved(case, own), own)


def some_cells(mesh: Mesh, which: Any) -> Mesh:
    """A mesh of the cells of one material: the whole, where `which` is a slice."""
    from softmark.interpreter.models.shared.region_cells import submesh

    return mesh if isinstance(which, slice) else submesh(mesh, which)


def _local(seen: Any, own: Mesh) -> LocalPoints | None:
    return None if seen is None or seen.rule is None else seen.rule.local(own)


def must_be_mirrored(each: tuple[Piece, ...]) -> None:
    """Pieces with fibres are what planes of symmetry make of them. Raises Fault."""
    for own in each:
        case = own.graded or own.case
        if getattr(case.material, "directed", False):
            from softmark.interpreter.models.shared.heterogeneous_material import places
            from softmark.interpreter.problem import anisotropy_limits

            anisotropy_limits.must_be_mirrored(case, places(own.mesh, own.mesh.element.quadrature()))


def pieces(case: Case, mesh: Mesh, parts: Integration) -> tuple[Piece, ...]:
    """The cells of every material that has some; of a body of one material the whole. Raises Fault."""
    if not case.parts:
        return (Piece(case, mesh, parts, slice(None)),)
    from softmark.interpreter.models.shared import region_cells

    return tuple(Piece(*own) for own in region_cells.pieces(case, mesh, parts))


def _whole(case: Case, mesh: Mesh) -> tuple[Piece, ...]:
    """The cells of every material, by the quadrature of their element."""
    from softmark.solvers.mesh.element_interpolation import integration

    return pieces(case, mesh, integration(mesh))


def lost(case: Case, mesh: Mesh) -> float:
    """The largest share of an integral of a constant that varies, which the quadrature of cells misses."""
    from softmark.interpreter.models.shared import heterogeneous_material

    return heterogeneous_material.lost(case, mesh, partial(_whole, case, mesh))


def typical(case: Case, mesh: Mesh | None) -> tuple[Any, ...]:
    """As `Case.typical`, from the cells of a mesh: files are read, and what lies beside the body does not count."""
    if case.uniform or mesh is None:
        return case.typical
    from softmark.interpreter.models.shared import heterogeneous_material

    return heterogeneous_material.typical(case, mesh, partial(_whole, case, mesh))


def facts(case: Case, mesh: Mesh | None) -> dict[str, Any]:
    """What a report says of parts and of what varies on a mesh; nothing of a body that is the same everywhere."""
    found: dict[str, Any] = {}
    if case.parts and mesh is not None:
        from softmark.interpreter.models.shared import region_cells

        found |= region_cells.facts(case, mesh)
    if not case.uniform and mesh is not None:
        from softmark.interpreter.models.shared import heterogeneous_material

        found |= heterogeneous_material.facts(case, mesh, partial(_whole, case, mesh))
    return found


def notes(declared: Declared, case: Case, mesh: Mesh) -> tuple[Diagnostic, ...]:
    """Warnings about parts and about what varies on a mesh; none of a body that is the same everywhere."""
    found: tuple[Diagnostic, ...] = ()
    if case.parts:
        from softmark.interpreter.models.shared import region_cells

        found = tuple(region_cells.notes(declared, case, mesh))
    if not case.uniform:
        from softmark.interpreter.models.shared import heterogeneous_material

        found = (*found, *heterogeneous_material.notes(declared, case, mesh, partial(_whole, case, mesh)))
    return found


def softer_by(case: Case, mesh: Mesh, u: Any, pressures: bool) -> float:
    """The share of its stiffness that a body in displacements u (n, 3), m, may lack: moduli vary within its cells."""
    if case.uniform or case.porous:
        return 0.0
    from softmark.interpreter.models.shared import stiffness_warnings

    return stiffness_warnings.softer_by(u, _whole(case, mesh), pressures)


def stiffer_by(case: Case, mesh: Mesh, u: Any, p: Any) -> float:
    """The share by which a body may be stiffer than its cells with pressures p (m, b), Pa, which moduli vary within."""
    if case.uniform or case.porous:
        return 0.0
    from softmark.interpreter.models.shared import stiffness_warnings

    return stiffness_warnings.stiffer_by(u, _whole(case, mesh), p)


def softness_note(declared: Declared, each: tuple[Piece, ...], u: Any, p: Any = None) -> tuple[Diagnostic, ...]:
    """Warnings where moduli vary within cells, and the body may be softer or stiffer for it.

    `u` (n, 3) are displacements, m, and `p` (m, b) the pressures of cells, Pa, where these are unknowns.
    """
    if all(own.graded is None or own.case.porous for own in each):
        return ()
    from softmark.interpreter.models.shared import stiffness_warnings

    parts = [replace(own, case=own.graded or own.case) for own in each]
    return tuple(stiffness_warnings.softness_note(declared, u, parts, p))


def of_cells(case: Case, mesh: Any) -> Any:
    """What gives the constants that vary, of the cells of a mesh that is deformed, for files; None of none."""
    if case.uniform or mesh is None:
        return None
    from softmark.interpreter.models.shared import heterogeneous_material

    return lambda: heterogeneous_material.of_cells(mesh.mesh, _whole(case, mesh.mesh))
