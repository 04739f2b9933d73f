"""Where answers are looked at: the material points of a probe, and the surface of a body that a report draws."""

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
from softmark.interpreter.problem.data_sets import located
from softmark.interpreter.problem.points_outside_body import kept
from softmark.interpreter.problem.probe_domains import ProbeDomain
from softmark.interpreter.problem.solution import View
from softmark.interpreter.results.even_thinning import picked
from softmark.interpreter.results.run_report import ProbeResult, SeenSurface
from softmark.interpreter.vocabulary.probe_words import Markers, Nodes, Surface, Volume
from softmark.interpreter.vocabulary.support_words import Holding
from softmark.records import dataclass
from softmark.solvers.elements.tet4 import Tet4
from softmark.solvers.elements.tet10 import Tet10
from softmark.solvers.mesh import shape as geometry
from softmark.solvers.mesh.shape_surfaces import triangulate_swept
from softmark.solvers.mesh.shapes import MeshFile
from softmark.solvers.mesh.surface_bodies import SurfaceBody

if TYPE_CHECKING:
    from softmark.interpreter.problem.group_conditions import Members
    from softmark.references.measured_data import Measured
    from softmark.solvers.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Field = Callable[[Floats], Floats]

FINENESS = 40  # points along the longest extent of a body, where a scene says nothing
COARSER = 1.6  # cells of a volume, which have four points each
MANY = 5000  # of them, where a scene says nothing: a compact body would have twenty times as many
FRAMES = 40  # of a history that a report keeps of a surface
SCANNED = (128, 192)  # points around and along: facets must stay far below a voxel
MISSED = 0.01  # of the area that a probe selects: less is not worth a word
INNER = np.array([[4.0, 1.0, 1.0], [1.0, 4.0, 1.0], [1.0, 1.0, 4.0]]) / 6.0  # of a triangle: exact for quadratics
DRAWN = 1500  # points of a surface that is drawn only: enough for a smooth picture


@dataclass(frozen=True)
class ProbePoints:
    """Material points X (n, 3) in m, with triangles (k, 3) over them or the volume (n,) that each stands for.

    `border` (b, 3), m, are the corners of the cells of a volume, on its surface and where it is cut. `notes` are
    warnings about them.
    """

    X: Floats
    triangles: Ints | None = None
    weights: Floats | None = None
    notes: tuple[Diagnostic, ...] = ()
    border: Floats | None = None


def place_of(probe: Declared, case: Case, tracked: Callable[[str], Floats]) -> ProbePoints:
    """The points of a probe; `tracked` gives those of a measurement by its name. Raises Fault."""
    own = probe.thing.cells is not None
    if not own and not (case.shape.file or case.shape.enclosed):
        return _place(probe, case, tracked)
    from softmark.solvers.mesh.files.mesh_reader import UnreadableMesh

    try:
        return _place(probe, case, tracked)
    except UnreadableMesh as error:
        at, owner = (probe.at("mesh"), probe) if own else (case.shaped, case.body)
        problem = f"the mesh of `{owner.name}` cannot be used: {error}"
        help_ = error.remedy or "the file must hold cells of positive volume"
        raise fault(error.code, at, problem, help=help_) from error


def _place(probe: Declared, case: Case, tracked: Callable[[str], Floats]) -> ProbePoints:
    match probe.thing:
        case Surface():
            return _surface(probe, case)
        case Volume(size=size):
            return _volume(probe, case, located(case.shape, case.shaped), size or _inner(case.shape))
        case Nodes(mesh=mesh):
            return _of_body(probe, case, located(mesh, probe.at("mesh")).points())
        case Markers(of=of):
            return _of_body(probe, case, tracked(of))
    return ProbePoints(np.array(probe.thing.stations))


def _of_body(probe: Declared, case: Case, X: Floats) -> ProbePoints:
    """The points that the probe's condition selects, but for those far outside the body. Raises Fault."""
    chosen = _part(probe, X)
    inside, notes = kept(probe, case, chosen)
    return ProbePoints(chosen[inside], notes=notes)


def _size(shape: geometry.Shape) -> float:
    """An edge length that resolves a shape; of a mesh from a file, which has its own, any."""
    if shape.bounds is None:
        return 1.0
    low, high = shape.bounds
    return float(max(b - a for a, b in zip(low, high, strict=True)) / FINENESS)


def _inner(shape: geometry.Shape) -> float:
    """An edge length of tetrahedra throughout a shape, six in a cube of it, that are no more than MANY."""
    size = COARSER * _size(shape)
    volume = shape.closed(size).volume if isinstance(shape, SurfaceBody) else shape.volume
    return size if volume is None else max(size, (6.0 * volume / MANY) ** (1 / 3))


def _surface(probe: Declared, case: Case) -> ProbePoints:
    own = probe.thing.mesh is not None
    shape = located(probe.thing.mesh if own else case.shape, probe.at("mesh") if own else case.shaped)
    X, triangles = shape.surface(probe.thing.size or _size(shape))
    if probe.thing.where is None:
        return ProbePoints(X, triangles)
    from softmark.interpreter.problem.surface_selection.triangle_parts import clipped

    where, members = probe.thing.where, None
    if where.groups:
        members = _on_surface(case, shape, where)
    points, part, share = clipped(where, X, triangles, members)
    if not len(points):
        raise _nothing(probe)
    return ProbePoints(points, part, notes=_missed(probe, share))


def _surface_within(probe: Declared, case: Case) -> Floats | None:
    """Points (n, 3), m, of the part of the body's surface that the condition of a volume probe selects."""
    shape = located(case.shape, case.shaped)
    X, triangles = shape.surface(_size(shape))
    if probe.thing.where is None:
        return X
    from softmark.interpreter.problem.surface_selection.triangle_parts import clipped

    where = probe.thing.where
    return clipped(where, X, triangles, _on_surface(case, shape, where) if where.groups else None)[0]


def domain_of(probe: Declared, case: Case, place: ProbePoints) -> ProbeDomain:
    """The domain of a probe whose points have been found."""
    thing = probe.thing
    if thing.ends is not None:
        first, last = (np.array(end, dtype=np.float64) for end in thing.ends)
        return ProbeDomain(ends=(first, last))
    if not isinstance(thing, Surface | Volume):
        return ProbeDomain()
    known = thing.where is None or not thing.where.groups  # nodes of a mesh do not tell of what group they are
    extent = float(np.linalg.norm(np.ptp(place.X, axis=0)))
    if isinstance(thing, Volume):
        border = [own for own in (place.border, _surface_within(probe, case)) if own is not None]
        return ProbeDomain(border=np.concatenate([np.zeros((0, 3)), *border]), nodes="all" if known else "none",
                           where=thing.where, extent=_extent(case, place))  # fmt: skip
    nodes: Literal["none", "surface"] = "surface" if known and thing.mesh is None and not case.planar else "none"
    own = ProbeDomain(nodes=nodes, where=thing.where, extent=_extent(case, place))
    if not case.parts or place.triangles is None or not len(place.triangles):
        return own
    pieces = _split(case, place, extent)
    X = INNER @ pieces  # (p, 3, 3)
    areas = 0.5 * np.linalg.norm(np.cross(pieces[:, 1] - pieces[:, 0], pieces[:, 2] - pieces[:, 0]), axis=1)
    return ProbeDomain(points=X.reshape(-1, 3), weights=np.repeat(areas / 3.0, 3), nodes=nodes, where=thing.where,
                       border=np.unique(pieces.reshape(-1, 3), axis=0), extent=own.extent)  # fmt: skip


def _extent(case: Case, place: ProbePoints) -> float:
    """The diagonal of the body, m."""
    shape = located(case.shape, case.shaped)
    return float(shape.diagonal) if shape.bounds is not None else float(np.linalg.norm(np.ptp(place.X, axis=0)))


def _split(case: Case, place: ProbePoints, extent: float) -> Floats:
    """Triangles (t, 3, 3), m, of a surface, cut along the borders of the materials of its body."""
    from softmark.interpreter.problem.surface_selection.triangle_parts import cut_along
    from softmark.solvers.mesh.simplex_clipping import Pieces

    pieces = Pieces(place.X[place.triangles], np.arange(len(place.triangles)))  # type: ignore[arg-type]
    for part in case.parts:
        pieces = cut_along(part.thing.where, pieces, extent)
    found: Floats = pieces.corners[pieces.sizes > 0.0]
    return found


def _on_surface(case: Case, shape: geometry.Shape, where: Condition) -> Members:
    """Which triangles of the surface of a file are of a named group. Raises Fault."""
    from softmark.interpreter.problem import group_conditions

    mesh = shape.named()
    group_conditions.check((r for r in case.groups if r.thing.name in where.groups), mesh)
    facets, each = group_conditions.of_facets(mesh), len(mesh.element.facet.triangles)
    return lambda name: np.repeat(facets(name), each)


def _missed(probe: Declared, share: float) -> tuple[Diagnostic, ...]:
    """A warning where triangles that a curved border crosses are a part of what a probe selects."""
    if 1.0 - share <= MISSED:
        return ()
    return (
        diagnostic(
            "W380",
            probe.at("where"),
            f"`{probe.name}` looks at {100 * share:.3g} % of the surface that it selects",
            "its triangles do not end at a curved border",
            "give the probe a smaller `size`",
        ),
    )


def _part(probe: Declared, X: Floats) -> Floats:
    """The points that the probe's condition selects, all where it has none. Raises Fault."""
    return X if probe.thing.where is None else X[_chosen(probe, X)]


def _chosen(probe: Declared, X: Floats) -> NDArray[np.bool_]:
    """Which points a probe's condition selects. Raises Fault if none."""
    if probe.thing.where.groups:
        from softmark.interpreter.problem.group_conditions import unplaced

        raise unplaced(probe)
    extent = float(np.linalg.norm(np.ptp(X, axis=0)))
    held = np.broadcast_to(probe.thing.where.holds(*X.T, extent), len(X))
    if not held.any():
        raise _nothing(probe)
    return held


def _nothing(probe: Declared, faces: Sequence[str] = ()) -> Fault:
    """`faces` are the regions of its condition that are faces, of which a volume has nothing."""
    help = "the condition is on coordinates before deformation"
    if faces:
        named = " and ".join(f"`{name}`" for name in faces)
        help = f"faces have no volume, and those of {named} are selected: use a `surface`, or a group of cells"
    return fault("E302", probe.at("where"), f"`{probe.name}` selects no points", "selects nothing", help)


def _volume(probe: Declared, case: Case, shape: geometry.Shape, size: float) -> ProbePoints:
    """Four points in every tetrahedron, by which integrals of squares of linear fields are exact: at its centroid alone
    the strains of linear elements are better than anywhere else, and their error seems less than it is. Tetrahedra that
    a border of the condition, or of a part of another material, passes are cut there. Raises Fault if nothing is
    selected."""
    each, named = _each(probe, case), case.groups and shape.prebuilt
    cuts = tuple(dict.fromkeys(cut for where in each for cut in cuts_for(where, shape)))
    mesh = shape.named(Tet4.name) if named else shape.mesh(Tet4.name, size, cuts)
    xi, weights = Tet10.quadrature()
    corners, volumes = mesh.points[mesh.cells], mesh.volumes
    if each:
        corners, volumes = _selected(probe, case, mesh, each)
    X = Tet4.shape(xi) @ corners  # (m, 4, 3)
    shares = np.outer(volumes, weights / weights.sum()).ravel()
    return ProbePoints(X.reshape(-1, 3), weights=shares, border=np.unique(corners.reshape(-1, 3), axis=0))


def _each(probe: Declared, case: Case) -> tuple[Condition, ...]:
    """What a probe selects, that of each material apart: stress and strain jump between them. None where it is all."""
    where = probe.thing.where
    if not case.parts:
        return () if where is None else (where,)
    from softmark.interpreter.problem.material_layers import remaining

    both = partial(Condition.junction, "and")
    rest = reduce(both, (Condition.negation(part.thing.where) for part in case.parts))
    each = (rest, *remaining(case))
    return each if where is None else tuple(both(where, own) for own in each)


def _selected(probe: Declared, case: Case, mesh: Mesh, each: Sequence[Condition]) -> tuple[Floats, Floats]:
    """Tetrahedra (t, 4, 3), m, of what a probe selects of a mesh, and their volumes (t,), m^3. Raises Fault.

    `each` are the conditions that select it, each in tetrahedra of its own.
    """
    from softmark.interpreter.problem import group_conditions
    from softmark.interpreter.problem.surface_selection.selected_pieces import within
    from softmark.solvers.mesh.simplex_clipping import Pieces

    whole, named = Pieces(mesh.points[mesh.cells], np.arange(len(mesh.cells))), {g for own in each for g in own.groups}
    group_conditions.check((r for r in case.groups if r.thing.name in named), mesh)
    found = [
        within(own, whole.chosen(np.arange(len(mesh.cells))[which]), mesh.extent)
        for where in each
        for own, which in group_conditions.apart(where, group_conditions.of_cells(mesh))
    ]
    corners, sizes = (np.concatenate([getattr(part, name) for part in found]) for name in ("corners", "sizes"))
    if not sizes.sum() > 0.0:
        asked = {r.name: r.thing.name for r in case.groups if r.thing.name in probe.thing.where.groups}
        faces = [region for region, name in asked.items() if (mesh.groups or {})[name].kind == "faces"]
        raise _nothing(probe, faces)
    return corners, sizes


def drawn(case: Case) -> ProbePoints:
    """A surface of the body for pictures."""
    return ProbePoints(*pictured(located(case.shape, case.shaped)))


def pictured(shape: geometry.Shape) -> tuple[Floats, Ints]:
    """Points (n, 3), m, and triangles (t, 3) of the surface of a shape, for pictures."""
    if isinstance(shape, geometry.Swept):
        return triangulate_swept(shape)
    size = _size(shape)
    X, triangles = shape.surface(size)
    if len(X) > DRAWN and not shape.prebuilt:
        X, triangles = shape.surface(size * (len(X) / DRAWN) ** 0.5)
    return X, triangles


def throughout(case: Case, place: ProbePoints) -> Floats:
    """Points (n, 3), m, all over a body and on the surface that is drawn: the nodes of its file, or of a mesh that
    costs next to nothing."""
    shape = located(case.shape, case.shaped)
    if case.planar or shape.enclosed or place.triangles is None:
        return place.X
    inner = shape.points() if isinstance(shape, MeshFile) else shape.mesh(Tet4.name, _inner(shape)).points
    return np.concatenate([place.X, inner])


def surface_points(case: Case, place: ProbePoints, where: Condition) -> Floats:
    """Points (n, 3), m, that a condition selects of the surface that is drawn, on its borders too; of rods none."""
    if place.triangles is None:
        return np.zeros((0, 3))
    from softmark.interpreter.problem.surface_selection.triangle_parts import clipped

    members = _on_surface(case, located(case.shape, case.shaped), where) if where.groups else None
    return clipped(where, place.X, place.triangles, members)[0]


def scanned(case: Case) -> ProbePoints:
    """A surface of the body fine enough to be put through a scanner."""
    shape = located(case.shape, case.shaped)
    return ProbePoints(*triangulate_swept(shape, *SCANNED)) if isinstance(shape, geometry.Swept) else drawn(case)


def held_face(case: Case) -> tuple[Floats, Ints] | None:
    """The part of the undeformed surface that supports hold in place, None where they hold none."""
    place = drawn(case)
    if place.triangles is None:
        return None
    held = [s.thing for s in case.named_supports if isinstance(s.thing, Holding) and not s.thing.moves]
    wheres = [support.where for support in held]
    if not wheres:
        return None
    from softmark.interpreter.problem.surface_selection.triangle_parts import clipped

    where, members = reduce(partial(Condition.junction, "or"), wheres), None
    if where.groups:
        members = _on_surface(case, located(case.shape, case.shaped), where)
    points, triangles, _ = clipped(where, place.X, place.triangles, members)
    return (points, triangles) if len(triangles) else None


def surface_of(
    view: View, place: ProbePoints, u: Floats, error: Floats | None, measured_from: str | None
) -> SeenSurface | None:
    """The surface with its displacements u (n, 3) in m, and some frames of it where there is a history."""
    if place.triangles is None:
        return None
    times = frames = None
    if view.history is not None:
        chosen = picked(len(view.history.times), FRAMES)
        times, frames = view.history.times[chosen], place.X + view.history.displacement(place.X)[chosen]
    position = place.X + u
    if not (np.all(np.isfinite(position)) and (frames is None or np.all(np.isfinite(frames)))):
        return None
    if error is not None and not np.all(np.isfinite(error)):
        error = measured_from = None
    return SeenSurface(position, place.triangles, times, frames, error, measured_from)


def seen_finite(probe: ProbeResult) -> bool:
    """Whether a probe has seen numbers only."""
    course = probe.displacement if probe.course is None else probe.course
    return bool(np.all(np.isfinite(probe.displacement)) and np.all(np.isfinite(course)))


def above(u: Floats, error: float) -> Floats:
    """Displacements (n, 3), zero where they are below the reference's own error: such numbers say nothing."""
    small: Floats = np.where(np.linalg.norm(u, axis=1, keepdims=True) <= error, 0.0, u)  # what is no number stays none
    return small


def facts_of(data: Measured) -> dict[str, Any]:
    """What a report says of a measurement."""
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
