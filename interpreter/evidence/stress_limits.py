"""Where elasticity has no largest stress: at the edge of what is held, and under a force on a point.

Where parts of different materials end on a free surface stress may have no limit either (Bogy 1971, "Two edge-bonded
elastic wedges of different materials and wedge angles under surface tractions"). Where a face that is held ends at one
that is free, displacements grow like r^a with a < 1, by Poisson's ratio, and
stresses without limit (Williams 1952, "Stress singularities resulting from various boundary conditions in angular
corners of plates in extension"). Faces that only slide along a plane, as those of symmetry, end there without that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.evidence.answer import Answer
from softmark.interpreter.evidence.probe_answers import ProbeAnswer, Unknown
from softmark.interpreter.metrics.metric import Metric
from softmark.interpreter.metrics.tensors import OfTensors
from softmark.interpreter.models.shared.gripping import grip
from softmark.interpreter.problem.case import Case
from softmark.interpreter.vocabulary.loads import AtPoint
from softmark.solvers.mesh.neighbours import neighbours

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from softmark.solvers.mesh.mesh import Mesh

    Floats = NDArray[np.float64]

UNSETTLED = 0.25  # relative: what refinement may change by more than that may have no limit


def limitless(metric: Metric | None, case: Case, mesh: Mesh | None, X: Floats) -> str | None:
    """Why a metric of stress or strain has no limit: what it looks at within a cell of such a place. None if it has."""
    if not isinstance(metric, OfTensors) or metric.over == "mean" or mesh is None or not len(X):
        return None
    near = _edge(mesh)
    for name, places in _places(case, mesh):
        if neighbours(places, len(X)).distance(X).min() < near:
            return name
    return None


def settled(answer: Answer, seen: ProbeAnswer, discretisation: Callable[[Answer, ProbeAnswer], float]) -> float:
    """The error of the mesh in a metric of stress or strain. Raises Unknown where there is no limit, or seems to be."""
    if place := limitless(seen.metric, answer.case, answer.prepared.mesh, seen.X):
        raise Unknown(f"it looks at {place}, where every refinement finds a larger stress")
    found = discretisation(answer, seen)
    if found > UNSETTLED * seen.size:
        raise Unknown(f"it is not settled: refinement may change it by {100 * found / seen.size:.2g} % and more")
    return found


def _edge(mesh: Mesh) -> float:
    """The usual length of the boundary's edges, m."""
    corners = mesh.points[mesh.facets[:, : mesh.element.facet.corners]]
    return float(np.median(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)))


def _places(case: Case, mesh: Mesh) -> Iterator[tuple[str, Floats]]:
    """Points (n, 3) of the mesh where stress has no limit, with words for each kind."""
    sideways = any(material.poisson != 0.0 for material in case.materials)
    rim = _rim(case, mesh) if sideways else np.zeros(0, dtype=np.int64)
    if len(rim):
        whole = [s for s in case.supports if len(s.thing.components) == 3]
        names = ", ".join(f"`{s.name}`" for s in whole or case.supports)
        yield f"the edge of what {names} holds", mesh.points[rim]
    ends = _ends(case, mesh) if sideways and case.parts else rim[:0]
    if len(ends):
        yield "the edge where parts of different materials end on the surface", mesh.points[ends]
    for load in case.loads:
        if isinstance(load.thing.action, AtPoint):
            yield f"the point that `{load.name}` acts at", np.array([load.thing.action.at])


def _ends(case: Case, mesh: Mesh) -> NDArray[np.int64]:
    """Nodes of cells of several materials on the surface, where nothing is held: not those in planes of symmetry."""
    from softmark.interpreter.models.shared.regions import owners

    number = owners(case, mesh).cells
    low, high = np.full(len(mesh.points), len(case.materials)), np.full(len(mesh.points), -1)
    for k in range(mesh.cells.shape[1]):
        np.minimum.at(low, mesh.cells[:, k], number)
        np.maximum.at(high, mesh.cells[:, k], number)
    outer = np.zeros(len(mesh.points), dtype=np.bool_)
    outer[mesh.facets] = True
    return np.flatnonzero(outer & (low < high) & ~_held(case, mesh).any(axis=1))


def _held(case: Case, mesh: Mesh) -> NDArray[np.bool_]:
    """Which components of which nodes supports hold (n, 3)."""
    held = np.zeros((len(mesh.points), 3), dtype=np.bool_)
    for support in case.supports:
        held[np.ix_(grip(support.thing.where, mesh).nodes, support.thing.components)] = True
    return held


def _rim(case: Case, mesh: Mesh) -> NDArray[np.int64]:
    """Nodes between facets that are held in every direction and facets that are held in none."""
    of_facets = np.all(_held(case, mesh)[mesh.facets], axis=1)  # (f, 3)
    fixed, free = mesh.facets[np.all(of_facets, axis=1)], mesh.facets[~np.any(of_facets, axis=1)]
    return np.intersect1d(fixed, free).astype(np.int64)
