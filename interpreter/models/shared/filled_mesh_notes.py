"""Report and warnings about a mesh that fills a closed surface: repairs of the surface, and its distance."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.problem.body_case import Case
from softmark.references.surface_geometry import SurfaceSearch
from softmark.solvers.mesh.mesh import Floats, Mesh, boundary_surface
from softmark.solvers.mesh.mesh_distortion import cell_qualities
from softmark.solvers.mesh.surface_bodies import SurfaceBody
from softmark.solvers.mesh.tetrahedralization import FilledMesh

if TYPE_CHECKING:
    from softmark.solvers.mesh.files.watertight_repair import ClosedSurface
    from softmark.solvers.mesh.shape import Shape

VOLUME: units.Dimension = units.raise_dimension(units.LENGTH, 3)
COARSE = 0.01  # of the volume: a smaller volume error of flat facets causes no warning
AWAY = 2.0  # tolerances: beyond this distance from the surface a warning is reported
PER_FACET = np.array([[1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1], [1, 0, 1], [1, 1, 1]], dtype=float)


def filled_mesh_report(shape: Shape, mesh: Mesh | None) -> dict[str, Any]:
    """Return the `filled` part of a report, about a mesh that fills a closed surface.

    The result is empty for other meshes. It is cached in the mesh.
    """
    if not isinstance(mesh, FilledMesh) or mesh.filling is None:
        return {}
    if "filled" not in mesh.selections:
        mesh.selections["filled"] = _filled_mesh_facts(shape, mesh)
    return {"filled": mesh.selections["filled"]}


def _filled_mesh_facts(shape: Shape, mesh: FilledMesh) -> dict[str, Any]:
    how, quality = mesh.filling, cell_qualities(mesh)
    assert how is not None
    beyond, short, place = _surface_distances(mesh, how.surface.points, how.surface.triangles)
    return {
        "mesher": how.mesher, "digest": how.digest, "cpu_s": how.seconds, "repairs": list(how.repairs),
        "facets_m3": shape.missed(how.size) if isinstance(shape, SurfaceBody) else 0.0,
        "surface_m3": how.surface.volume, "mesh_m3": float(mesh.volumes.sum()), "tolerance_m": how.tolerance,
        "mesh_to_surface_m": beyond, "surface_to_mesh_m": short, "farthest_m": place, "beside": how.beside,
        "quality": float(quality.min()), "median_quality": float(np.median(quality)),
    }  # fmt: skip


def _surface_distances(mesh: Mesh, points: Floats, triangles: Any) -> tuple[float, float, list[float]]:
    """Return the two one-sided Hausdorff distances between a mesh and a triangulated surface, m.

    The first is the largest distance from the mesh to the surface, the second from the surface to the mesh. The
    third value is the point (x, y, z), m, of the surface that is farthest from the mesh. Distances are sampled at
    corners, edges and centres of facets.
    """
    own = SurfaceSearch(*boundary_surface(mesh))
    there = SurfaceSearch(points, triangles)
    weights = PER_FACET / PER_FACET.sum(axis=1, keepdims=True)
    sampled = np.unique(np.einsum("sk,tki->tsi", weights, own.points[own.triangles]).reshape(-1, 3), axis=0)
    short = own.closest(points).distances
    farthest = points[int(np.argmax(short))]
    return float(there.closest(sampled).distances.max()), float(short.max()), farthest.tolist()


def notes(declared: Declared, case: Case, mesh: Mesh) -> Iterator[Diagnostic]:
    """Yield warnings if a filled mesh is far from its surface, or if a public data set was not checked completely."""
    if not isinstance(mesh, FilledMesh) or mesh.filling is None:
        return
    found, how = filled_mesh_report(case.shape, mesh)["filled"], mesh.filling
    if case.shape.file.startswith("data:"):
        said = repair_warning(case, how.surface), thickness_warning(declared, case, how.surface)
        yield from (d for d in said if d is not None)
    if abs(found["facets_m3"]) > COARSE * found["surface_m3"]:
        share = units.format_value(float(f"{100 * found['facets_m3'] / found['surface_m3']:.2g}"), units.NONE)
        yield diagnostic(
            "W354",
            declared.at(),
            f"flat facets of `{case.body.name}` miss {share} % of its volume in `{declared.name}`",
            "curved surface approximated by flat facets",
            "use a smaller `size`, or smaller `facets` of the shape",
        )
    away = max(found["mesh_to_surface_m"], found["surface_to_mesh_m"])
    if away > AWAY * how.tolerance:
        place = units.format_vector(found["farthest_m"], units.LENGTH)
        yield diagnostic(
            "W349",
            declared.at(),
            f"the mesh of `{declared.name}` deviates from the surface of the body",
            f"up to {units.format_value(float(f'{away:.3g}'), units.LENGTH)} apart, near {place}",
            "use a smaller `size`, or a smaller `tolerance` of `tetrahedralized`: thin or sharp parts were lost, "
            f"and the tolerance of {units.format_value(how.tolerance, units.LENGTH)} is not met",
        )


def repair_warning(case: Case, surface: ClosedSurface) -> Diagnostic | None:
    """Return a warning about a surface that was repaired; None if no repair was needed.

    The warning names the repairs, their extent, and the volume error that they may cause.
    """
    if not surface.repairs:
        return None
    volume = units.format_value(float(f"{surface.volume:.5g}"), VOLUME)
    open_ = (
        f", with an uncertainty of {100 * surface.relative_volume_uncertainty:.2g} % due to closed holes"
        if surface.capped
        else ""
    )
    twice = ", counting overlapping parts twice" if surface.crossings else ""
    return diagnostic("W348", case.body.at("shape"), f"the surface of `{case.body.name}` was repaired "
                                                     "before it was filled",
                      f"it encloses {volume}{twice}{open_}",
                      "check these places in the program that made the surface; the report contains the "
                      "volume of the mesh",
                      surface.repairs)  # fmt: skip


def thickness_warning(declared: Declared, case: Case, surface: ClosedSurface) -> Diagnostic | None:
    """Return a warning if cells are too large for the thickness of the body, else None.

    The thickness is estimated as twice the volume of the body over its surface area, which is exact for a thin
    plate.
    """
    thick, size = 2.0 * surface.volume / surface.area, declared.thing.size
    if size is None or size <= thick:
        return None
    return diagnostic("W350", declared.at("size"), f"the cells of `{declared.name}` are larger than the "
                                                   f"thickness of `{case.body.name}`",
                      f"about {units.format_value(float(f'{thick:.3g}'), units.LENGTH)}",
                      "use a smaller `size`: one cell across is too stiff in bending; the thickness is estimated as "
                      "twice the volume over the area, a third of the diameter for a sphere")  # fmt: skip
