"""Treatment of measured points, or points of another mesh, that lie outside their body."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.problem.body_case import Case, fault
from softmark.interpreter.problem.data_sets import download_shape
from softmark.solvers.mesh.shape import Swept
from softmark.solvers.mesh.shapes import MeshFile

Floats = NDArray[np.float64]

BESIDE = 0.01  # relative to the body's diagonal: tolerance for marks and meshes of the surface


def near_body_mask(probe: Declared, case: Case, X: Floats) -> tuple[NDArray[np.bool_], tuple[Diagnostic, ...]]:
    """Return a mask of points X (n, 3), m, in the body or close to it, and a warning about the other points.

    A displacement outside the body is extrapolated. Close to the surface that is reasonable, because curvature and the
    placement of marks move points off it; farther out the displacement is meaningless. Raises Fault if no point is
    left.
    """
    far, extent = distances(case, X)
    inside = far <= BESIDE * extent
    if inside.all():
        return inside, ()
    at, count = probe.at("of" if "of" in probe.fields else "mesh"), int((~inside).sum())
    most, body = units.format_value(float(far.max()), units.LENGTH), case.body.name
    help_ = "check the unit, the origin and the axes of the file; coordinates refer to the undeformed body"
    if not inside.any():
        problem = f"all {count} points of `{probe.name}` lie outside `{body}`, by {most} or less"
        raise fault("E504", at, problem, "outside the body", help_)
    first = units.format_vector(tuple(float(x) for x in X[int(np.argmax(far))]), units.LENGTH)
    problem = f"{count} of {len(X)} points of `{probe.name}` lie outside `{body}`, by up to {most}, and are ignored"
    return inside, (diagnostic("W379", at, problem, f"the farthest is at {first}", help_),)


def distances(case: Case, X: Floats) -> tuple[Floats, float]:
    """Return the distance, m, of each point X (n, 3), m, from a body (n,), 0 inside, and the body's diagonal, m."""
    shape = case.shape
    if isinstance(shape, MeshFile):
        from softmark.solvers.mesh.element_interpolation import locate_points
        from softmark.solvers.mesh.files.mesh_reader import read_cells

        known = download_shape(shape, case.shape_location)
        mesh = read_cells(known.path, known.unit, known.coincident, pieces=known.pieces)
        return locate_points(mesh, X).outside, mesh.extent
    bounds = download_shape(shape, case.shape_location).bounds
    assert bounds is not None  # only a file of cells has none
    low, high = (np.array(end) for end in bounds)
    extent = float(np.linalg.norm(high - low))
    return (_swept_distances(shape, X) if isinstance(shape, Swept) else _box_distances(low, high, X)), extent


def _box_distances(low: Floats, high: Floats, X: Floats) -> Floats:
    """Return distances (n,), m, of points X (n, 3) from the bounding box of a shape, which are lower bounds."""
    found: Floats = np.linalg.norm(np.maximum(np.maximum(low - X, X - high), 0.0), axis=1)
    return found


def _swept_distances(shape: Swept, X: Floats) -> Floats:
    """Return distances (n,), m, of points X (n, 3) from a body that is swept along an axis.

    They are exact for a straight axis; a curved body is continued beyond its ends.
    """
    s, u, v = shape.coordinates(X)
    along = np.maximum(np.maximum(-s, s - shape.length), 0.0)
    found: Floats = np.hypot(along, shape.section.outside(u, v))
    return found
