"""Borders of parts within round shapes: meshes have circles and spheres there, and quadratic cells follow them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from softmark.solvers.mesh.conforming_planes import Cut
from softmark.solvers.mesh.mesh_distortion import worst_cell
from softmark.solvers.mesh.shape import Shape
from softmark.solvers.mesh.shapes import Cylinder, Ellipsoid, Sphere, SphericalShell, Tube

R, A, L = 0.01, 0.0055, 0.01  # m: of the body, of the border within, and a length
BODIES = {
    "cylinder": (Cylinder(length=L, radius=R), math.pi * A**2 * L),
    "tube": (Tube(length=L, radius=R, inner=0.003), math.pi * (A**2 - 0.003**2) * L),
    "sphere": (Sphere(radius=R, part="octant"), math.pi * A**3 / 6),
    "shell": (SphericalShell(radius=R, inner=0.003, part="octant"), math.pi * (A**3 - 0.003**3) / 6),
    "ellipsoid": (Ellipsoid(semiaxes=(R, 0.8 * R, 0.9 * R), part="octant"), 0.72 * math.pi * A**3 / 6),
}


def away(shape: Shape, X: np.ndarray) -> np.ndarray:
    """How far points (n, 3) are from the middle, m: from an axis along x, or as the ellipsoid has it."""
    scale = np.array([0.0, 1.0, 1.0]) if isinstance(shape, Cylinder | Tube) else np.ones(3)
    if isinstance(shape, Ellipsoid):
        scale = R / np.array(shape.semiaxes)
    found: np.ndarray = np.linalg.norm(X * scale, axis=1)
    return found


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("kind", ["tet4", "hex8", "tet10", "hex20", "hex27"])
def test_what_lies_within_a_border_has_its_volume(name: str, kind: str) -> None:
    """Inscribed polygons miss per cents, quadratic cells 1e-3; before they did not follow it."""
    (shape, within), quadratic = BODIES[name], kind not in ("tet4", "hex8")
    mesh = shape.mesh(kind, 0.002, (Cut("radius", A),))
    corners = mesh.cells[:, : mesh.element.corners]
    core = away(shape, mesh.points[corners].mean(axis=1)) < A
    farthest, nearest = (
        f(away(shape, mesh.points[corners[own]].reshape(-1, 3)))
        for f, own in ((np.max, core), (np.min, ~core))
    )  # fmt: skip
    assert farthest == pytest.approx(A, rel=1e-9)  # no cell lies on both sides
    assert nearest == pytest.approx(A, rel=1e-9)
    missed = 1.0 - float(mesh.volumes[core].sum()) / within
    assert abs(missed) < (1.5e-3 if quadratic else 0.06)
    assert quadratic or missed > 3e-3
    assert mesh.volumes.min() > 0.0
    assert worst_cell(mesh)[0] > 0.2
