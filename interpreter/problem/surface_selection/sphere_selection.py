"""Selected surface of spheres, ellipsoids and spherical shells, and the integral of its normal."""

from __future__ import annotations

import numpy as np

from softmark.interpreter.language.coordinate_conditions import Condition, Term
from softmark.interpreter.problem.surface_selection.facet_patches import ConditionOnPatches, Floats, Patches
from softmark.interpreter.problem.surface_selection.selected_facets import select_patches
from softmark.solvers.mesh.curved_boundary import EllipsoidSide
from softmark.solvers.mesh.spheres import RoundBody

CELLS = 8  # cells along a quarter of a great circle of the projected patches
GAUSS = 8  # points along each side of a facet: exact to rounding


def select_curved_side(
    shape: RoundBody, side: EllipsoidSide, condition: Condition, extent: float
) -> tuple[float, Floats, float]:
    """Return the selected area of an ellipsoidal side, m^2, and two integrals over it.

    The integrals are those of n (3,), m^2, and of x . n, m^3. n is the unit normal that points away from the centre of
    the ellipsoid, and x the position. An ellipsoid with semi-axes A is mapped to the unit sphere by A^-1 (A is a
    diagonal matrix). A facet with area vector da in the mapped space, at distance r from the centre in the direction e,
    projects to the area vector e (e . da) / r^2 on the sphere, and to cof(A) times this on the ellipsoid.
    """
    from softmark.solvers.mesh.ball_blocks import build_shell, mesh_blocks

    mesh = mesh_blocks(build_shell(CELLS, (0.5, 1.0)), "hex8", side.semiaxes, side.centre, shape.halved_axis_count)
    facets = mesh.facets[side.of(mesh.points[mesh.facets])]
    patches = Patches(mesh.points[facets], extent, side.project_points)
    found = select_patches(ConditionOnPatches.of(condition, patches))
    x, v = np.polynomial.legendre.leggauss(GAUSS)
    xi, w = np.stack(np.meshgrid(x, x), axis=-1).reshape(-1, 2), np.outer(v, v).ravel()
    f = np.concatenate([np.repeat(found.whole, len(w)), found.f])
    xi = np.concatenate([np.tile(xi, (len(found.whole), 1)), found.xi])
    w = np.concatenate([np.tile(w, len(found.whole)), found.w])
    A = np.array(side.semiaxes)
    da = patches.area(f, xi) * A / A.prod()
    y = (patches.at(f, xi[:, None])[:, 0] - np.array(side.centre)) / A
    r = np.linalg.norm(y, axis=1)[:, None]
    e = y / r
    seen = w[:, None] * A.prod() * (e * da).sum(axis=1)[:, None] / r**2
    vectors = e / A * seen
    total = vectors.sum(axis=0)
    through = float(total @ np.array(side.centre)) + float(seen.sum())
    return float(np.linalg.norm(vectors, axis=1).sum()), total, through


def symmetry_cuts(shape: RoundBody) -> tuple[Floats, Condition]:
    """Return rectangles (k, 4, 3), m, around the flat cuts by symmetry planes, and the condition inside the cuts.

    Corners are counter-clockwise seen from outside.
    """
    low, high = (np.array(end) for end in shape.bounds)
    faces, size = [], np.diag(high - low)
    for axis in range(shape.halved_axis_count):
        b, c = size[(axis + 1) % 3], size[(axis + 2) % 3]
        faces.append([low, low + c, low + c + b, low + b])
    level = Term.constant(0.0)
    for axis, (o, a) in enumerate(zip(shape.origin, shape.outer_semiaxes, strict=True)):
        off = Term.coordinate(axis).combine("-", Term.constant(o)).combine("*", Term.constant(1.0 / a))
        level = level.combine("+", off.combine("*", off))
    within = Condition.comparison("<=", level, Term.constant(1.0), 0)
    if shape.hollow_ratio:
        without = Condition.comparison(">=", level, Term.constant(shape.hollow_ratio**2), 0)
        within = Condition.junction("and", within, without)
    return np.array(faces).reshape(-1, 4, 3), within
