"""Material points of probes, and the surface of a body that a report draws."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial, reduce
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.problem.body_case import Case, Fault, fault
from softmark.interpreter.problem.conforming_mesh import cuts_for
from softmark.interpreter.problem.data_sets import download_shape
from softmark.interpreter.problem.points_outside_body import near_body_mask
from softmark.interpreter.problem.probe_domains import ProbeDomain
from softmark.interpreter.problem.solution import View
from softmark.interpreter.results.even_thinning import pick_evenly
from softmark.interpreter.results.run_report import DrawnSurface, ProbeResult
from softmark.interpreter.vocabulary.probe_words import Markers, MeshNodes, Surface, Volume
from softmark.interpreter.vocabulary.supports.support import DisplacementSupport
from softmark.records import dataclass
from softmark.solvers.elements.tet4 import Tet4
from softmark.solvers.elements.tet10 import Tet10
from softmark.solvers.mesh import shape as geometry
from softmark.solvers.mesh.shape_surfaces import triangulate_swept
from softmark.solvers.mesh.shapes import MeshFile
from softmark.solvers.mesh.surface_bodies import SurfaceBody

if TYPE_CHECKING:
    from softmark.interpreter.problem.mesh_group_conditions import Members
    from softmark.references.measured_data import Measured
    from softmark.solvers.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Field = Callable[[Floats], Floats]

FINENESS = 40  # default number of points along the longest extent of a body
COARSER = 1.6  # cells of a volume, which have four points each
MANY = 5000  # default limit of points: a compact body would have twenty times as many
FRAMES = 40  # frames of a surface's history in a report
SCANNED = (128, 192)  # points around and along: facets must stay far below a voxel
MISSED = 0.01  # missed share of the selected area below which no warning is given
INNER = np.array([[4.0, 1.0, 1.0], [1.0, 4.0, 1.0], [1.0, 1.0, 4.0]]) / 6.0  # of a triangle: exact for quadratics
DRAWN = 1500  # points of a surface that is drawn only: enough for a smooth picture


@dataclass(frozen=True)
class ProbePoints:
    """Material points X (n, 3), m, of a probe, with triangles (k, 3) between them or a volume, m^3, of each (n,).

    `border` (b, 3), m, are the corners of the cells of a volume, on its surface and where it is cut. `notes` are
    warnings about the points.
    """

    X: Floats
    triangles: Ints | None = None
    weights: Floats | None = None
    notes: tuple[Diagnostic, ...] = ()
    border: Floats | None = None


def find_probe_points(probe: Declared, case: Case, tracked: Callable[[str], Floats]) -> ProbePoints:
    """Return the points of a probe. Raises Fault.

    `tracked` returns the points (n, 3), m, of a named measurement.
    """
    own = probe.thing.cells is not None
    if not own and not (case.shape.file or case.shape.enclosed):
        return _place(probe, case, tracked)
    from softmark.solvers.mesh.files.mesh_reader import UnreadableMesh

    try:
        return _place(probe, case, tracked)
    except UnreadableMesh as error:
        at, owner = (probe.at("mesh"), probe) if own else (case.shape_location, case.body)
        problem = f"the mesh of `{owner.name}` cannot be used: {error}"
        help_ = error.remedy or "use a file with cells of positive volume"
        raise fault(error.code, at, problem, help=help_) from error


def _place(probe: Declared, case: Case, tracked: Callable[[str], Floats]) -> ProbePoints:
    match probe.thing:
        case Surface():
            return _surface(probe, case)
        case Volume(size=size):
            return _volume_probe_points(
                probe, case, download_shape(case.shape, case.shape_location), size or _volume_size(case.shape)
            )
        case MeshNodes(mesh=mesh):
            return _points_near_body(probe, case, download_shape(mesh, probe.at("mesh")).points())
        case Markers(of=of):
            return _points_near_body(probe, case, tracked(of))
    return ProbePoints(np.array(probe.thing.stations))


def _points_near_body(probe: Declared, case: Case, X: Floats) -> ProbePoints:
    """Return the points that the probe's condition selects, without those far outside the body. Raises Fault."""
    chosen = _selected_points(probe, X)
    inside, notes = near_body_mask(probe, case, chosen)
    return ProbePoints(chosen[inside], notes=notes)


def _surface_edge_length(shape: geometry.Shape) -> float:
    """Return an edge length, m, that resolves a shape; for a mesh from a file the value does not matter."""
    if shape.bounds is None:
        return 1.0
    low, high = shape.bounds
    return float(max(b - a for a, b in zip(low, high, strict=True)) / FINENESS)


def _volume_size(shape: geometry.Shape) -> float:
    """Return an edge length, m, of a mesh that fills a shape with at most MANY tetrahedra, six in each cube."""
    size = COARSER * _surface_edge_length(shape)
    volume = shape.closed(size).volume if isinstance(shape, SurfaceBody) else shape.volume
    return size if volume is None else max(size, (6.0 * volume / MANY) ** (1 / 3))


def _surface(probe: Declared, case: Case) -> ProbePoints:
    own = probe.thing.mesh is not None
    shape = download_shape(probe.thing.mesh if own else case.shape, probe.at("mesh") if own else case.shape_location)
    X, triangles = shape.surface(probe.thing.size or _surface_edge_length(shape))
    if probe.thing.where is None:
        return ProbePoints(X, triangles)
    from softmark.interpreter.problem.surface_selection.triangle_parts import clip_triangles

    where, members = probe.thing.where, None
    if where.groups:
        members = _triangle_group_masks(case, shape, where)
    points, part, share = clip_triangles(where, X, triangles, members)
    if not len(points):
        raise _empty_selection(probe)
    return ProbePoints(points, part, notes=_curved_border_warning(probe, share))


def _surface_points_in_volume(probe: Declared, case: Case) -> Floats | None:
    """Return the points (n, 3), m, of the body's surface that the condition of a volume probe selects."""
    shape = download_shape(case.shape, case.shape_location)
    X, triangles = shape.surface(_surface_edge_length(shape))
    if probe.thing.where is None:
        return X
    from softmark.interpreter.problem.surface_selection.triangle_parts import clip_triangles

    where = probe.thing.where
    return clip_triangles(where, X, triangles, _triangle_group_masks(case, shape, where) if where.groups else None)[0]


def domain_of(probe: Declared, case: Case, place: ProbePoints) -> ProbeDomain:
    """Return the line, surface or volume over which a probe with these points evaluates results."""
    thing = probe.thing
    if thing.ends is not None:
        first, last = (np.array(end, dtype=np.float64) for end in thing.ends)
        return ProbeDomain(ends=(first, last))
    if not isinstance(thing, Surface | Volume):
        return ProbeDomain()
    known = thing.where is None or not thing.where.groups  # mesh nodes do not determine their group
    extent = float(np.linalg.norm(np.ptp(place.X, axis=0)))
    if isinstance(thing, Volume):
        border = [own for own in (place.border, _surface_points_in_volume(probe, case)) if own is not None]
        return ProbeDomain(border=np.concatenate([np.zeros((0, 3)), *border]), nodes="all" if known else "none",
                           where=thing.where, extent=_extent(case, place))  # fmt: skip
    nodes: Literal["none", "surface"] = "surface" if known and thing.mesh is None and not case.planar else "none"
    own = ProbeDomain(nodes=nodes, where=thing.where, extent=_extent(case, place))
    if not case.parts or place.triangles is None or not len(place.triangles):
        return own
    pieces = _cut_triangles_at_materials(case, place, extent)
    X = INNER @ pieces  # (p, 3, 3)
    areas = 0.5 * np.linalg.norm(np.cross(pieces[:, 1] - pieces[:, 0], pieces[:, 2] - pieces[:, 0]), axis=1)
    return ProbeDomain(points=X.reshape(-1, 3), weights=np.repeat(areas / 3.0, 3), nodes=nodes, where=thing.where,
                       border=np.unique(pieces.reshape(-1, 3), axis=0), extent=own.extent)  # fmt: skip


def _extent(case: Case, place: ProbePoints) -> float:
    """Return the diagonal of the body, m."""
    shape = download_shape(case.shape, case.shape_location)
    return float(shape.diagonal) if shape.bounds is not None else float(np.linalg.norm(np.ptp(place.X, axis=0)))


def _cut_triangles_at_materials(case: Case, place: ProbePoints, extent: float) -> Floats:
    """Return the triangles (t, 3, 3), m, of a probe's surface, cut along the borders between materials."""
    from softmark.interpreter.problem.surface_selection.triangle_parts import cut_along
    from softmark.solvers.mesh.simplex_clipping import Pieces

    pieces = Pieces(place.X[place.triangles], np.arange(len(place.triangles)))  # type: ignore[arg-type]
    for part in case.parts:
        pieces = cut_along(part.thing.where, pieces, extent)
    found: Floats = pieces.corners[pieces.sizes > 0.0]
    return found


def _triangle_group_masks(case: Case, shape: geometry.Shape, where: Condition) -> Members:
    """Return a function that gives the mask of surface triangles in a named group of a mesh file. Raises Fault."""
    from softmark.interpreter.problem import mesh_group_conditions

    mesh = shape.mesh_with_groups()
    mesh_group_conditions.check_mesh_groups((r for r in case.groups if r.thing.name in where.groups), mesh)
    facets, each = mesh_group_conditions.facet_membership(mesh), len(mesh.element.facet.triangles)
    return lambda name: np.repeat(facets(name), each)


def _curved_border_warning(probe: Declared, share: float) -> tuple[Diagnostic, ...]:
    """Return a warning if triangles crossed by a curved border are a significant part of the selection."""
    if 1.0 - share <= MISSED:
        return ()
    return (
        diagnostic(
            "W380",
            probe.at("where"),
            f"`{probe.name}` covers only {100 * share:.3g} % of the surface that it selects",
            "its triangles approximate a curved border",
            "give the probe a smaller `size`",
        ),
    )


def _selected_points(probe: Declared, X: Floats) -> Floats:
    """Return the points that the probe's condition selects; all points without a condition. Raises Fault."""
    return X if probe.thing.where is None else X[_selected_mask(probe, X)]


def _selected_mask(probe: Declared, X: Floats) -> NDArray[np.bool_]:
    """Return a mask of the points X (n, 3), m, that the probe's condition selects. Raises Fault if it selects none."""
    if probe.thing.where.groups:
        from softmark.interpreter.problem.mesh_group_conditions import group_of_points_fault

        raise group_of_points_fault(probe)
    extent = float(np.linalg.norm(np.ptp(X, axis=0)))
    held = np.broadcast_to(probe.thing.where.holds(*X.T, extent), len(X))
    if not held.any():
        raise _empty_selection(probe)
    return held


def _empty_selection(probe: Declared, faces: Sequence[str] = ()) -> Fault:
    """Return the Fault of an empty selection. `faces` are named facet groups in it, which have no volume."""
    help = "check the condition: it applies to coordinates before deformation"
    if faces:
        named = " and ".join(f"`{name}`" for name in faces)
        help = f"use a `surface`, or a group of cells: the selected faces of {named} have no volume"
    return fault("E302", probe.at("where"), f"`{probe.name}` selects no points", "selects nothing", help)


def _volume_probe_points(probe: Declared, case: Case, shape: geometry.Shape, size: float) -> ProbePoints:
    """Return four points in every tetrahedron of a volume, which integrate squares of linear fields exactly.

    At the centroid alone, strains of linear elements are superconvergent, so their error would be underestimated.
    Tetrahedra are cut along borders of the condition and of materials. Raises Fault for an empty selection.
    """
    each, named = _conditions_by_material(probe, case), case.groups and shape.prebuilt
    cuts = tuple(dict.fromkeys(cut for where in each for cut in cuts_for(where, shape)))
    mesh = shape.mesh_with_groups(Tet4.name) if named else shape.mesh(Tet4.name, size, cuts)
    xi, weights = Tet10.quadrature()
    corners, volumes = mesh.points[mesh.cells], mesh.volumes
    if each:
        corners, volumes = _selected_tetrahedra(probe, case, mesh, each)
    X = Tet4.shape(xi) @ corners  # (m, 4, 3)
    shares = np.outer(volumes, weights / weights.sum()).ravel()
    return ProbePoints(X.reshape(-1, 3), weights=shares, border=np.unique(corners.reshape(-1, 3), axis=0))


def _conditions_by_material(probe: Declared, case: Case) -> tuple[Condition, ...]:
    """Return the probe's selection in each material, since stress and strain jump between them.

    The result is empty for a probe without a condition in a body of one material.
    """
    where = probe.thing.where
    if not case.parts:
        return () if where is None else (where,)
    from softmark.interpreter.problem.material_layers import region_conditions

    both = partial(Condition.junction, "and")
    rest = reduce(both, (Condition.negation(part.thing.where) for part in case.parts))
    each = (rest, *region_conditions(case))
    return each if where is None else tuple(both(where, own) for own in each)


def _selected_tetrahedra(probe: Declared, case: Case, mesh: Mesh, each: Sequence[Condition]) -> tuple[Floats, Floats]:
    """Return the selected tetrahedra (t, 4, 3), m, of a mesh, and their volumes (t,), m^3. Raises Fault.

    `each` has the condition for each material; tetrahedra are selected for each of them separately.
    """
    from softmark.interpreter.problem import mesh_group_conditions
    from softmark.interpreter.problem.surface_selection.selected_pieces import select_pieces
    from softmark.solvers.mesh.simplex_clipping import Pieces

    whole, named = Pieces(mesh.points[mesh.cells], np.arange(len(mesh.cells))), {g for own in each for g in own.groups}
    mesh_group_conditions.check_mesh_groups((r for r in case.groups if r.thing.name in named), mesh)
    found = [
        select_pieces(own, whole.chosen(np.arange(len(mesh.cells))[which]), mesh.extent)
        for where in each
        for own, which in mesh_group_conditions.split_by_groups(where, mesh_group_conditions.cell_membership(mesh))
    ]
    corners, sizes = (np.concatenate([getattr(part, name) for part in found]) for name in ("corners", "sizes"))
    if not sizes.sum() > 0.0:
        asked = {r.name: r.thing.name for r in case.groups if r.thing.name in probe.thing.where.groups}
        faces = [region for region, name in asked.items() if (mesh.groups or {})[name].kind == "faces"]
        raise _empty_selection(probe, faces)
    return corners, sizes


def drawn_surface(case: Case) -> ProbePoints:
    """Return the points and triangles of the body's surface for pictures."""
    return ProbePoints(*surface_triangles(download_shape(case.shape, case.shape_location)))


def surface_triangles(shape: geometry.Shape) -> tuple[Floats, Ints]:
    """Return points (n, 3), m, and triangles (t, 3) of the surface of a shape, for pictures."""
    if isinstance(shape, geometry.Swept):
        return triangulate_swept(shape)
    size = _surface_edge_length(shape)
    X, triangles = shape.surface(size)
    if len(X) > DRAWN and not shape.prebuilt:
        X, triangles = shape.surface(size * (len(X) / DRAWN) ** 0.5)
    return X, triangles


def points_throughout(case: Case, place: ProbePoints) -> Floats:
    """Return points (n, 3), m, throughout a body and on its drawn surface.

    They are the nodes of its mesh file, or of a coarse mesh made for this purpose.
    """
    shape = download_shape(case.shape, case.shape_location)
    if case.planar or shape.enclosed or place.triangles is None:
        return place.X
    inner = shape.points() if isinstance(shape, MeshFile) else shape.mesh(Tet4.name, _volume_size(shape)).points
    return np.concatenate([place.X, inner])


def surface_points(case: Case, place: ProbePoints, where: Condition) -> Floats:
    """Return the points (n, 3), m, of the drawn surface that a condition selects, and of its border; none for rods."""
    if place.triangles is None:
        return np.zeros((0, 3))
    from softmark.interpreter.problem.surface_selection.triangle_parts import clip_triangles

    members = (
        _triangle_group_masks(case, download_shape(case.shape, case.shape_location), where) if where.groups else None
    )
    return clip_triangles(where, place.X, place.triangles, members)[0]


def scan_surface(case: Case) -> ProbePoints:
    """Return points and triangles of the body's surface, fine enough for a simulated scan."""
    shape = download_shape(case.shape, case.shape_location)
    return (
        ProbePoints(*triangulate_swept(shape, *SCANNED)) if isinstance(shape, geometry.Swept) else drawn_surface(case)
    )


def held_face(case: Case) -> tuple[Floats, Ints] | None:
    """Return points and triangles of the undeformed surface that supports fix; None if there are none."""
    place = drawn_surface(case)
    if place.triangles is None:
        return None
    held = [s.thing for s in case.named_supports if isinstance(s.thing, DisplacementSupport) and not s.thing.moves]
    wheres = [support.where for support in held]
    if not wheres:
        return None
    from softmark.interpreter.problem.surface_selection.triangle_parts import clip_triangles

    where, members = reduce(partial(Condition.junction, "or"), wheres), None
    if where.groups:
        members = _triangle_group_masks(case, download_shape(case.shape, case.shape_location), where)
    points, triangles, _ = clip_triangles(where, place.X, place.triangles, members)
    return (points, triangles) if len(triangles) else None


def surface_of(
    view: View, place: ProbePoints, u: Floats, error: Floats | None, measured_from: str | None
) -> DrawnSurface | None:
    """Return the drawn surface with its displacements u (n, 3), m, and some frames of the motion over time."""
    if place.triangles is None:
        return None
    times = frames = None
    if view.history is not None:
        chosen = pick_evenly(len(view.history.times), FRAMES)
        times, frames = view.history.times[chosen], place.X + view.history.displacement(place.X)[chosen]
    position = place.X + u
    if not (np.all(np.isfinite(position)) and (frames is None or np.all(np.isfinite(frames)))):
        return None
    if error is not None and not np.all(np.isfinite(error)):
        error = measured_from = None
    return DrawnSurface(position, place.triangles, times, frames, error, measured_from)


def is_finite_probe(probe: ProbeResult) -> bool:
    """Return whether all numbers of a probe are finite."""
    course = probe.displacement if probe.course is None else probe.course
    return bool(np.all(np.isfinite(probe.displacement)) and np.all(np.isfinite(course)))


def zero_below_error(u: Floats, error: float) -> Floats:
    """Return displacements u (n, 3), m, with those smaller than the reference's own error, m, set to zero."""
    small: Floats = np.where(np.linalg.norm(u, axis=1, keepdims=True) <= error, 0.0, u)  # nan stays nan
    return small


def facts_of(data: Measured) -> dict[str, Any]:
    """Return the facts about measured data for the report."""
    found: dict[str, Any] = {"uncertainty": data.uncertainty, "notes": list(data.notes)}
    residual = data.residual
    if residual is not None:
        found["registration"] = {
            "mean": residual.mean,
            "rms": residual.rms,
            "max": residual.max,
            "points": residual.points,
        }
    return found
