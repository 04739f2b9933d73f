"""Cells of a mesh grouped by material. A body of one material is a single group, without extra cost."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.problem.body_case import Case
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.solvers.mesh.element_interpolation import IntegrationPoints
    from softmark.solvers.mesh.mesh import Mesh


@dataclass(frozen=True)
class MaterialRegion:
    """Cells of one material. The field `case` has only that material, and `mesh` only these cells but all nodes.

    `which` (k,) are the indices of the cells in the whole mesh, and `number` is the index of the material. `parts`
    is the integration over the cells. If constants of the material vary in space, `sample_regions` replaces them by
    arrays in `case` and keeps the original case as `graded`.
    """

    case: Case
    mesh: Mesh
    parts: IntegrationPoints
    which: Any
    number: int = 0
    graded: Case | None = None

    @property
    def original(self) -> Case:
        """Case whose constants vary in space as declared, instead of arrays of their values."""
        return self.graded or self.case

    @property
    def density(self) -> Any:
        """Density of the region, kg/m^3: a number, or a `Density` (heterogeneous_material.py) if it varies."""
        case = self.original
        if case.uniform:
            return case.material.density
        from softmark.interpreter.models.shared import heterogeneous_material

        return heterogeneous_material.density_of(case)


def sample_regions(each: tuple[MaterialRegion, ...], pressures: bool = False) -> tuple[MaterialRegion, ...]:
    """Return the regions with varying constants evaluated at their integration points. Raises Fault.

    A region whose cells need more integration points than the element has gets these points as `parts`. With
    `pressures`, the same points integrate the pressure unknowns.
    """
    return each if all(own.case.uniform for own in each) else tuple(_sample_region(own, pressures) for own in each)


def _sample_region(own: MaterialRegion, pressures: bool) -> MaterialRegion:
    """Return one region with its varying constants evaluated at integration points. Raises Fault."""
    from softmark.interpreter.models.shared import heterogeneous_material

    if own.case.uniform:
        return own
    case, parts = heterogeneous_material.sample_at_integration_points(own, pressures)
    return replace(own, case=case, graded=own.case, parts=own.parts if parts is None else parts)


LocalPoints = tuple[Any, Any]  # of each cell, (m, q, 3), and their weights (m, q)


def stiffness_points(case: Case, mesh: Mesh, which: Any, pressures: bool) -> LocalPoints | None:
    """Return the quadrature points of the stiffness of cells of one material; None for the points of their element.

    `which` are the cells of the mesh that have the material of the `case`.
    """
    if case.uniform:
        return None
    from softmark.interpreter.models.shared import heterogeneous_material

    own = mesh_of_cells(mesh, which)
    return _local_points(heterogeneous_material.stiffness_of(case, own, pressures), own)


def mass_points(case: Case, mesh: Mesh, which: Any) -> LocalPoints | None:
    """Return the quadrature points of the mass of cells of one material; None for the points of their element.

    `which` are the cells of the mesh that have the material of the `case`.
    """
    if case.uniform:
        return None
    from softmark.interpreter.models.shared import heterogeneous_material

    own = mesh_of_cells(mesh, which)
    return _local_points(heterogeneous_material.density_quadrature(case, own), own)


def mesh_of_cells(mesh: Mesh, which: Any) -> Mesh:
    """Return a mesh of the cells with indices `which`; the whole mesh if `which` is a slice."""
    from softmark.interpreter.models.shared.region_cells import submesh

    return mesh if isinstance(which, slice) else submesh(mesh, which)


def _local_points(seen: Any, own: Mesh) -> LocalPoints | None:
    """Return the special points of a cell quadrature in local coordinates; None if it has none."""
    return None if seen is None or seen.rule is None else seen.rule.local(own)


def must_be_mirrored(each: tuple[MaterialRegion, ...]) -> None:
    """Raise Fault if fibre directions are incompatible with planes of symmetry."""
    for own in each:
        case = own.original
        if getattr(case.material, "directed", False):
            from softmark.interpreter.models.shared.heterogeneous_material import rule_positions
            from softmark.interpreter.problem import anisotropy_limits

            anisotropy_limits.require_symmetric_fibers(case, rule_positions(own.mesh, own.mesh.element.quadrature()))


def regions_by_material(case: Case, mesh: Mesh, parts: IntegrationPoints) -> tuple[MaterialRegion, ...]:
    """Return the cells of every material that fills at least one cell. Raises Fault.

    For a body of one material this is the whole mesh.
    """
    if not case.parts:
        return (MaterialRegion(case, mesh, parts, slice(None)),)
    from softmark.interpreter.models.shared import region_cells

    return tuple(MaterialRegion(*own) for own in region_cells.region_meshes(case, mesh, parts))


def _regions_of_elements(case: Case, mesh: Mesh) -> tuple[MaterialRegion, ...]:
    """Return the cells of every material, integrated with the quadrature of their element."""
    from softmark.solvers.mesh.element_interpolation import integrate_cells

    return regions_by_material(case, mesh, integrate_cells(mesh))


def largest_quadrature_error(case: Case, mesh: Mesh) -> float:
    """Return the largest relative quadrature error of the integral of a varying constant; 0 for uniform materials."""
    from softmark.interpreter.models.shared import heterogeneous_material

    return heterogeneous_material.largest_quadrature_error(case, mesh, partial(_regions_of_elements, case, mesh))


def representative_materials(case: Case, mesh: Mesh | None) -> tuple[Any, ...]:
    """Return one material with constant properties for each material of a case.

    With a mesh, varying constants are replaced by means over its cells, so that files are read and values outside
    the body do not count. Without a mesh the result is `Case.typical`.
    """
    if case.uniform or mesh is None:
        return case.typical
    from softmark.interpreter.models.shared import heterogeneous_material

    return heterogeneous_material.representative_materials(case, mesh, partial(_regions_of_elements, case, mesh))


def material_report(case: Case, mesh: Mesh | None) -> dict[str, Any]:
    """Return the report of material regions and varying constants on a mesh; empty for a homogeneous body."""
    found: dict[str, Any] = {}
    if case.parts and mesh is not None:
        from softmark.interpreter.models.shared import region_cells

        found |= region_cells.region_report(case, mesh)
    if not case.uniform and mesh is not None:
        from softmark.interpreter.models.shared import heterogeneous_material

        found |= heterogeneous_material.varying_constants_report(case, mesh, partial(_regions_of_elements, case, mesh))
    return found


def notes(declared: Declared, case: Case, mesh: Mesh) -> tuple[Diagnostic, ...]:
    """Return warnings about material regions and varying constants on a mesh; none for a homogeneous body."""
    found: tuple[Diagnostic, ...] = ()
    if case.parts:
        from softmark.interpreter.models.shared import region_cells

        found = tuple(region_cells.notes(declared, case, mesh))
    if not case.uniform:
        from softmark.interpreter.models.shared import heterogeneous_material

        found = (*found, *heterogeneous_material.notes(declared, case, mesh, partial(_regions_of_elements, case, mesh)))
    return found


def softer_by(case: Case, mesh: Mesh, u: Any, pressures: bool) -> float:
    """Return an upper bound of how much softer the body can be than its mesh, as a fraction of stiffness.

    The cause is moduli that vary within cells. u (n, 3), m, are nodal displacements.
    """
    if case.uniform or case.porous:
        return 0.0
    from softmark.interpreter.models.shared import stiffness_warnings

    return stiffness_warnings.softer_by(u, _regions_of_elements(case, mesh), pressures)


def stiffer_by(case: Case, mesh: Mesh, u: Any, p: Any) -> float:
    """Return an upper bound of how much stiffer the body can be than its mesh, as a fraction of stiffness.

    The cause is bulk moduli that vary within cells. u (n, 3), m, are nodal displacements and p (m, b), Pa,
    pressures.
    """
    if case.uniform or case.porous:
        return 0.0
    from softmark.interpreter.models.shared import stiffness_warnings

    return stiffness_warnings.stiffer_by(u, _regions_of_elements(case, mesh), p)


def softness_note(
    declared: Declared, each: tuple[MaterialRegion, ...], u: Any, p: Any = None
) -> tuple[Diagnostic, ...]:
    """Return warnings that the body may be softer or stiffer than its mesh, because moduli vary within cells.

    `each` has the cells of every material, u (n, 3), m, are nodal displacements and p (m, b), Pa, the pressures of
    cells if these are unknowns.
    """
    if all(own.graded is None or own.case.porous for own in each):
        return ()
    from softmark.interpreter.models.shared import stiffness_warnings

    parts = [replace(own, case=own.original) for own in each]
    return tuple(stiffness_warnings.softness_note(declared, u, parts, p))


def cell_means_function(case: Case, mesh: Any) -> Any:
    """Return a function that computes the cell means of varying constants of a deformed mesh, for exported files.

    The result is None if no constant varies or there is no mesh.
    """
    if case.uniform or mesh is None:
        return None
    from softmark.interpreter.models.shared import heterogeneous_material

    return lambda: heterogeneous_material.cell_means(mesh.mesh, _regions_of_elements(case, mesh.mesh))
