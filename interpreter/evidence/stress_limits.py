"""Where elasticity has no largest stress: at the edge of what is held, and under a force on a point.

Where a face that is held ends at one that is free, displacements grow like r^a with a < 1, by Poisson's ratio, and
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
    rim = _rim(case, mesh) if case.material.poisson != 0.0 else np.zeros(0, dtype=np.int64)
    if len(rim):
        whole = [s for s in case.supports if len(s.thing.components) == 3]
        names = ", ".join(f"`{s.name}`" for s in whole or case.supports)
        yield f"the edge of what {names} holds", mesh.points[rim]
    for load in case.loads:
        if isinstance(load.thing.action, AtPoint):
            yield f"the point that `{load.name}` acts at", np.array([load.thing.action.at])


def _rim(case: Case, mesh: Mesh) -> NDArray[np.int64]:
    """Nodes between facets that are held in every direction and facets that are held in none."""
    held = np.zeros((len(mesh.points), 3), dtype=np.bool_)
    for support in case.supports:
        held[np.ix_(grip(support.thing.where, mesh).nodes, support.thing.components)] = True
    of_facets = np.all(held[mesh.facets], axis=1)  # (f, 3)
    fixed, free = mesh.facets[np.all(of_facets, axis=1)], mesh.facets[~np.any(of_facets, axis=1)]
    return np.intersect1d(fixed, free).astype(np.int64)
