"""Stress singularities: at the edge of supports, under point forces, and at ends of material interfaces.

Stress may be singular where parts of different materials end on a free surface (Bogy 1971, "Two edge-bonded elastic
wedges of different materials and wedge angles under surface tractions"). Where a fixed face ends at a free one,
displacements grow like r^a with a < 1, by Poisson's ratio, and stresses are singular (Williams 1952, "Stress
singularities resulting from various boundary conditions in angular corners of plates in extension"). Faces that slide
along a plane, such as symmetry planes, end in a right angle without a singularity; where the free face continues flat,
as beside a frictionless punch, stresses grow with r^(-1/2) (Sadowsky 1928, ZAMM 8).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.metrics.metric_base import Metric
from softmark.interpreter.metrics.strain_energy import StrainEnergy
from softmark.interpreter.metrics.tensor_metrics import TensorMetric
from softmark.interpreter.metrics.work import LoadWork
from softmark.interpreter.models.shared.support_selection import select_support
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.verification.grid_convergence import HOPELESS
from softmark.interpreter.verification.probe_errors import NoErrorEstimate, ProbeResultUnderTest
from softmark.interpreter.verification.solution_under_test import SolutionUnderTest
from softmark.interpreter.vocabulary.loads.load import Action
from softmark.solvers.mesh.nearest_points import build_point_search
from softmark.solvers.mesh.plane_boundary import is_on_border

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from softmark.interpreter.verification.by_model.verifier import Verifier
    from softmark.solvers.mesh.mesh import Mesh

    Floats = NDArray[np.float64]

ALONG = 0.99  # squared cosine: a facet's normal is among the directions in which it is held
FLAT = 0.17  # cosine of 80 degrees: faces that enclose 100 degrees and more, of which a right angle is none
TRIFLE = 1e-3  # relative: what refinement adds without a word to a displacement that has no limit
UNSETTLED = 0.25  # relative: what refinement may change by more than that may have no limit


def singular_stress(metric: Metric | None, case: Case, mesh: Mesh | None, X: Floats) -> str | None:
    """Return the reason if a stress or strain metric is evaluated within a cell of a singularity, else None."""
    if not isinstance(metric, TensorMetric) or metric.over == "mean" or mesh is None or not len(X):
        return None
    near = _edge_length(mesh)
    for name, places in _singular_points(case, mesh):
        places = places * (1.0, 1.0, 0.0) if case.planar else places  # the same for all z
        if build_point_search(places, len(X)).distance(X).min() < near:
            return name
    return None


def converged_mesh_error(answer: SolutionUnderTest, seen: ProbeResultUnderTest, verifier: Verifier) -> float:
    """Return the mesh error of a stress or strain metric. Raises NoErrorEstimate if it does not seem to converge.

    At a re-entrant corner, the stress jump between the cells around a point grows with every refinement, as the stress
    itself does; for a finite stress it decreases, however coarse the mesh is.
    """
    metric = seen.metric
    assert isinstance(metric, TensorMetric)
    if place := singular_stress(metric, answer.case, answer.prepared.mesh, seen.place.evaluation_points(metric.over)):
        raise NoErrorEstimate(f"the metric is evaluated at {place}, where the stress grows with every mesh refinement")
    found = verifier.discretisation(answer, seen)
    if found > HOPELESS * seen.size or (found > UNSETTLED * seen.size and verifier.is_singular(answer, seen)):
        raise NoErrorEstimate(
            f"the value has not converged: mesh refinement may change it by {100 * found / seen.size:.2g} % or more"
        )
    return found


def _edge_length(mesh: Mesh) -> float:
    """Return the typical length of boundary edges, m."""
    corners = mesh.points[mesh.facets[:, : mesh.element.facet.corners]]
    lengths = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    return float(np.median(lengths[lengths > 0.0]))  # a side of a triangle may be a corner


def _singular_points(case: Case, mesh: Mesh) -> Iterator[tuple[str, Floats]]:
    """Yield the singular points (n, 3), m, of each kind in the mesh, with a description of the kind."""
    held, facets = held_directions(case, mesh), mesh.facets
    if case.planar:  # the border of its region: its faces are no surface
        facets = facets[is_on_border(mesh.points, facets)]
    of_facets = np.all(held[facets], axis=1)  # (f, 3)
    free = ~np.any(of_facets, axis=1)
    rim = _nodes_shared_by_facets(facets, np.all(of_facets, axis=1), free)
    sideways = any(material.poisson != 0.0 for material in case.materials)
    if len(rim) and sideways:
        yield _describe_edge(case, mesh, rim, whole=True), mesh.points[rim]
    punched = _nodes_of_flat_continuations(mesh, facets, of_facets, free)
    if len(punched):
        yield _describe_edge(case, mesh, punched, whole=False), mesh.points[punched]
    ends = _interface_ends(case, mesh, facets, held) if sideways and case.parts else rim[:0]
    if len(ends):
        yield "the edge where regions of different materials meet at the surface", mesh.points[ends]
    for load in case.loads:
        if load.thing.action.points:
            yield place_of(load), _points_along(load.thing.action, _edge_length(mesh))


def load_of_unbounded_displacement(case: Case, mesh: Mesh | None, X: Floats, u: Floats) -> Declared | None:
    """Return the point or line force that makes the displacement at X (n, 3), m, singular, or None.

    u (n, 3) or (t, n, 3), m, are the displacements there. The result is None also if refinement changes the
    displacement by less than TRIFLE of it: a force at the end of a long bar dents it by less than it bends it.
    """
    if mesh is None or not len(X):
        return None
    level = (1.0, 1.0, 0.0) if case.planar else (1.0, 1.0, 1.0)  # of a plane body the same for all z
    moved, edge = np.linalg.norm(u, axis=-1).reshape(-1, len(X)).max(axis=0), _edge_length(mesh)
    for load in case.loads:
        if (action := load.thing.action).points:
            near = np.linalg.norm(level * (X - _nearest_load_points(action, X)), axis=1) < edge
            if np.any(near & (_unresolved_indentation(action, case, edge) > TRIFLE * moved)):
                return load
    return None


def load_of_unbounded_work(metric: Metric, case: Case, mesh: Mesh | None, value: float) -> Declared | None:
    """Return the point or line force whose work, J, makes a metric infinite under refinement, or None."""
    if mesh is None or not isinstance(metric, LoadWork | StrainEnergy):
        return None
    for load in case.loads:
        if isinstance(metric, LoadWork) and load.name != metric.of:
            continue
        if (action := load.thing.action).points:
            length = 1.0 if action.length is None else action.length
            work = (
                length
                * float(np.linalg.norm(action.vector))
                * _unresolved_indentation(action, case, _edge_length(mesh))
            )
            if work > TRIFLE * abs(value):
                return load
    return None


def _unresolved_indentation(action: Action, case: Case, edge: float) -> float:
    """Return the displacement, m, that refinement adds under a force, by the solutions of Boussinesq and Flamant."""
    young = min(material.young for material in case.typical)
    across = edge if action.length is None else 1.0  # of a line its force is per length already
    if case.planar and action.length is None:
        across = case.body.thing.thickness
    dent: float = np.linalg.norm(action.vector) / (young * across)
    return dent


def place_of(load: Declared) -> str:
    """Describe as text where a point or line force acts."""
    how = "line that `{}` acts along" if load.thing.action.length is not None else "point that `{}` acts at"
    return f"the {how.format(load.name)}"


def _ends(action: Action) -> Floats:
    """Return the point of a force, or the ends of a line of force, (1 or 2, 3), m."""
    return np.array([point for _, point in action.points])


def _nearest_load_points(action: Action, X: Floats) -> Floats:
    """Return the points of a force that are nearest to X (n, 3), m: (n, 3) for a line, (1, 3) for a point."""
    ends = _ends(action)
    if len(ends) == 1:
        return ends
    begin, way = ends[0], ends[1] - ends[0]
    nearest: Floats = begin + np.clip((X - begin) @ way / (way @ way), 0.0, 1.0)[:, None] * way
    return nearest


def _points_along(action: Action, step: float) -> Floats:
    """Return the point of a force, or points of its line at most half a step apart, (n, 3), m."""
    ends = _ends(action)
    if len(ends) == 1:
        return ends
    way = ends[1] - ends[0]
    s = np.linspace(0.0, 1.0, 2 + int(2.0 * float(np.linalg.norm(way)) / step))
    found: Floats = ends[0] + s[:, None] * way
    return found


def _interface_ends(case: Case, mesh: Mesh, facets: NDArray[np.int64], held: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the free surface nodes at which cells of several materials meet, without those in symmetry planes."""
    from softmark.interpreter.models.shared.region_cells import materials_of_cells

    number = materials_of_cells(case, mesh).cells
    low, high = np.full(len(mesh.points), len(case.materials)), np.full(len(mesh.points), -1)
    for k in range(mesh.cells.shape[1]):
        np.minimum.at(low, mesh.cells[:, k], number)
        np.maximum.at(high, mesh.cells[:, k], number)
    outer = np.zeros(len(mesh.points), dtype=np.bool_)
    outer[facets] = True
    return np.flatnonzero(outer & (low < high) & ~held.any(axis=1))


def _describe_edge(case: Case, mesh: Mesh, rim: NDArray[np.int64], whole: bool) -> str:
    """Describe as text the edge of the supports that hold the nodes `rim` (k,).

    With `whole` the supports that fix all components are named, otherwise those that fix only some. If there are none,
    all supports of these nodes are named.
    """
    there = [s for s in case.supports if select_support(s.thing.where, mesh).nodes[rim].any()]
    some = [s for s in there if (len(s.thing.components) == 3) == whole]
    names = ", ".join(f"`{s.name}`" for s in some or there)
    return f"the edge of the part held by {names}"


def held_directions(case: Case, mesh: Mesh) -> NDArray[np.bool_]:
    """Return a mask of the directions in which supports hold each node (nodes, 3)."""
    held = np.zeros((len(mesh.points), 3), dtype=np.bool_)
    for support in case.supports:
        held[np.ix_(select_support(support.thing.where, mesh).nodes, support.thing.components)] = True
    if case.planar:  # every point is held along z, which says nothing: both other directions are all that there are
        held[:, 2] = held[:, :2].all(axis=1)
    return held


def _nodes_shared_by_facets(
    facets: NDArray[np.int64], some: NDArray[np.bool_], others: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """Return nodes that belong both to facets of one kind and to facets of another, by their masks (f,)."""
    return np.intersect1d(facets[some], facets[others]).astype(np.int64)


def _nodes_of_flat_continuations(
    mesh: Mesh, facets: NDArray[np.int64], of_facets: NDArray[np.bool_], free: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """Return nodes where facets held only along their normal continue as free facets in the same plane, within FLAT."""
    slide = ~free & ~np.all(of_facets, axis=1)
    rim = _nodes_shared_by_facets(facets, slide, free)
    if not len(rim):
        return rim
    normals = facet_normals(mesh, facets)
    slide &= (normals**2 * of_facets[:, None]).sum(axis=2).mean(axis=1) > ALONG

    def flat(node: int) -> bool:
        there = facets == node
        turns = normals[there & slide[:, None]] @ normals[there & free[:, None]].T
        return bool(np.any(turns > FLAT))

    return rim[[flat(int(node)) for node in rim]]


def facet_normals(mesh: Mesh, facets: NDArray[np.int64]) -> Floats:
    """Return the normals of facets at their nodes (f, nodes, 3).

    Normals at nodes show the right angle of a curved face to a flat one, which chords would not.
    """
    facet = mesh.element.facet
    corners = np.array(facet.rim)
    places = np.concatenate([corners, *(corners[list(some)].mean(axis=0, keepdims=True) for some in facet.between)])
    along = np.einsum("fni,pnk->fpki", mesh.points[facets], facet.gradient(places))  # (f, p, 2, 3)
    normals: Floats = np.cross(along[:, :, 0], along[:, :, 1])
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    return normals
