"""Report and warnings about cell quality, and deliberate distortion of meshes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.problem.body_case import fault
from softmark.solvers.elements import moment_fitted_quadrature
from softmark.solvers.mesh.jacobian_bounds import has_folded_corner
from softmark.solvers.mesh.mesh import Mesh, facet_areas
from softmark.solvers.mesh.mesh_distortion import QualityTooLow, cell_qualities, distort, worst_cell

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.models.fem.fem_declaration import Fem
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.mesh.shape import Shape

LOST_VOLUME = 0.05  # of the body's volume: a smaller volume error of a mesh causes no warning
SLIVER = 1e-3  # quality below which a cell of a file causes a warning


def distort_to_quality(mesh: Mesh, model: Fem, declared: Declared) -> Mesh:
    """Return the mesh with nodes moved until its worst cell has the quality that the scene requests. Raises Fault."""
    if model.quality is None:
        return mesh
    try:
        return distort(mesh, model.quality)
    except QualityTooLow as has:
        raise fault(
            "E508",
            declared.at("quality"),
            f"`quality` can only make the mesh of `{declared.name}` worse, and its worst cell has a quality of {has}",
            f"{model.quality:g} is higher",
            "write a smaller number, or remove `quality`",
        ) from has


def mesh_facts(mesh: Mesh) -> dict[str, Any]:
    """Return the `mesh` part of a report: the quality of the worst cell."""
    return {"mesh": {"quality": worst_cell(mesh)[0]}}


def volume_and_area_facts(shape: Shape, mesh: Mesh) -> dict[str, Any]:
    """Return the `body` part of a report: volume and surface area of the shape, if known, and of its mesh."""
    if "body" not in mesh.selections:
        mesh.selections["body"] = {
            "volume_m3": shape.volume,
            "mesh_m3": float(mesh.volumes.sum()),
            "area_m2": shape.skin,
            "mesh_m2": float(facet_areas(mesh, *moment_fitted_quadrature.gauss_rule(mesh.element.facet.nodes)).sum()),
        }
    return {"body": mesh.selections["body"]}


def sliver_note(declared: Declared, shape: Shape, mesh: Mesh) -> tuple[Diagnostic, ...]:
    """Return warnings about cells, of a mesh read from a file, that are nearly flat or inverted at a corner."""
    if not shape.file:
        return ()
    return (*_corner_notes(declared, mesh), *_sliver_notes(declared, shape, mesh))


def _corner_notes(declared: Declared, mesh: Mesh) -> tuple[Diagnostic, ...]:
    """Return a warning about hexahedra with an inverted corner."""
    if not len(cells := np.flatnonzero(has_folded_corner(mesh))):
        return ()
    place = ", ".join(
        units.format_value(float(c), units.LENGTH) for c in mesh.points[mesh.cells[cells[0]]].mean(axis=0)
    )
    at = declared.at() if declared.thing.own_mesh is None else declared.at("mesh")
    many = "1 hexahedron has" if len(cells) == 1 else f"{len(cells)} hexahedra have"
    return (
        diagnostic(
            "W756", at, f"in the mesh of `{declared.name}`, {many} an inverted corner",
            f"the first is cell {cells[0]} at ({place})",
            "move the nodes around it if you need the stress there: integrals are correct, but the stress "
            "near that corner is not",
        ),
    )  # fmt: skip


def _sliver_notes(declared: Declared, shape: Shape, mesh: Mesh) -> tuple[Diagnostic, ...]:
    """Return warnings about nearly flat cells."""
    found = cell_qualities(_thicken_slice_cells(mesh) if shape.flat else mesh)
    found[has_folded_corner(mesh)] = 1.0  # its negative quality at that corner is already reported
    count = int((found < SLIVER).sum())
    if not count:
        return ()
    cell = int(np.argmin(found))
    place = ", ".join(units.format_value(float(c), units.LENGTH) for c in mesh.points[mesh.cells[cell]].mean(axis=0))
    at = declared.at() if declared.thing.own_mesh is None else declared.at("mesh")
    cells = "1 cell" if count == 1 else f"{count} cells"
    return (
        diagnostic(
            "W364",
            at,
            f"the mesh of `{declared.name}` has slivers: {cells} with a quality below {SLIVER:g}",
            f"the worst, {found[cell]:.1e}, at ({place})",
            "repair the mesh there: flat cells are too stiff, reduce accuracy and need tiny explicit time steps",
        ),
    )


def _thicken_slice_cells(mesh: Mesh) -> Mesh:
    """Return a plane slice with each cell as thick as it is wide, because thickness does not affect cell quality."""
    corners = mesh.points[mesh.cells]
    depth = np.ptp(mesh.points[:, 2])
    corners[:, :, 2] *= (np.sqrt(np.abs(mesh.volumes) / depth) / depth)[:, None]
    return Mesh(corners.reshape(-1, 3), np.arange(corners.size // 3).reshape(mesh.cells.shape), mesh.kind)


def filled_notes(declared: Declared, case: Case, mesh: Mesh) -> tuple[Diagnostic, ...]:
    """Return warnings about a mesh that fills a closed surface."""
    if not case.shape.enclosed:
        return ()
    from softmark.interpreter.models.shared import filled_mesh_notes  # imported only for filled surfaces

    return tuple(filled_mesh_notes.notes(declared, case, mesh))


def volume_note(declared: Declared, case: Case, mesh: Mesh) -> tuple[Diagnostic, ...]:
    """Return a warning if the volume of a mesh differs much from the volume of the body."""
    if case.shape.volume is None:
        return ()
    lost = 1.0 - float(mesh.volumes.sum()) / case.shape.volume
    if abs(lost) < LOST_VOLUME:
        return ()
    given = declared.thing.own_mesh is not None
    return (
        diagnostic(
            "W305",
            declared.at("mesh" if given else "size"),
            f"the mesh of `{declared.name}` has {100 * abs(lost):.1f} % "
            f"{'less' if lost > 0 else 'more'} volume than the body",
            "different body?" if given else "too coarse for the curved surface",
            "check the file and its unit" if given else "use a smaller size",
        ),
    )
