"""Finer spaces over the cells of a mesh: the same body, matching cells, and all that the coarse space can do."""

from __future__ import annotations

import numpy as np
import pytest

from softmark.solvers.elements import ELEMENTS
from softmark.solvers.mesh.cell_splitting import SPLITS
from softmark.solvers.mesh.element_interpolation import locate_points
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.mesh_refinement import UnmatchedFaces, build_finer_space
from softmark.solvers.mesh.shapes import Box, Cylinder

BODIES = {"box": Box((0.03, 0.02, 0.01)), "cylinder": Cylinder(0.04, 0.01)}


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("kind", ELEMENTS)
def test_it_is_the_same_body_and_holds_the_coarse_space(kind: str, body: str) -> None:
    mesh = BODIES[body].mesh(kind, 7e-3)
    found = build_finer_space(mesh)
    assert len(found.mesh.cells) == len(mesh.cells) * (1 if kind == "tet4" else 8)
    np.testing.assert_allclose(found.mesh.volumes.sum(), mesh.volumes.sum(), rtol=1e-12)
    assert found.mesh.volumes.min() > 0
    assert len(found.mesh.facets) == len(mesh.facets) * (1 if kind == "tet4" else 4)  # no face is torn
    u = np.random.default_rng(0).standard_normal((len(mesh.points), 3))
    X = found.mesh.points[found.mesh.cells].mean(axis=1)
    inside = locate_points(mesh, X).outside == 0
    coarse, fine = (
        locate_points(mesh, X).interpolate(u),
        locate_points(found.mesh, X).interpolate(found.interpolate_displacements(u)),
    )
    np.testing.assert_allclose(fine[inside], coarse[inside], atol=1e-9)


@pytest.mark.parametrize("kind", ELEMENTS)
def test_new_nodes_of_a_cylinder_lie_on_it(kind: str) -> None:
    """What is missing of the volume falls with h^2 where facets are flat, with h^4 where they are curved."""
    shape = BODIES["cylinder"]
    mesh = shape.mesh(kind, 7e-3)
    lost, less = (abs(1 - m.volumes.sum() / shape.volume) for m in (mesh, build_finer_space(mesh, shape).mesh))
    assert less < (0.3 if ELEMENTS[kind].order == 1 else 0.1) * lost


def test_curved_facets_of_a_mesh_of_its_own_are_kept() -> None:
    """Without a shape, quarter points lie on the parabolas of the cells."""
    mesh = BODIES["cylinder"].mesh("tet10", 7e-3)
    points = build_finer_space(mesh).mesh.points
    outer = np.unique(build_finer_space(mesh).mesh.facets)
    r = np.hypot(points[outer, 1], points[outer, 2])
    flat = Mesh(mesh.points, mesh.cells[:, :4], "tet4")
    assert r.max() <= 0.01 * 1.01
    assert build_finer_space(mesh).mesh.volumes.sum() > 1.05 * flat.volumes.sum()


def test_cells_that_do_not_match_are_refused() -> None:
    with pytest.raises(UnmatchedFaces):
        build_finer_space(SPLITS["repeated"](BODIES["box"].mesh("hex8", 7e-3)))
