"""Meshes made worse on purpose: the quality that was asked for, the same body, and still a mesh."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.elements import ELEMENTS
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.linear.factorisations import factor
from softmark.solvers.materials import Law
from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.mesh import Mesh, jacobians
from softmark.solvers.mesh.mesh_distortion import QualityTooLow, cell_qualities, distort, worst_cell
from softmark.solvers.mesh.shapes import Box, Cylinder

KINDS = tuple(ELEMENTS)
SHAPES = (Box((2.0, 1.0, 1.0)), Cylinder(2.0, 0.5))


def test_quality_of_known_cells() -> None:
    """1 for the regular tetrahedron and the cube; 12 (3/6)^(2/3) / 9 for the corner of a cube (edges 3 x 1, 3 x 2);
    3 h^(2/3) / (2 + h^2) for a box of 1 x 1 x h; the sign is that of the volume."""
    regular = Mesh(np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]), np.array([[0, 2, 1, 3]]))
    corner = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), np.array([[0, 1, 2, 3], [0, 2, 1, 3]]))
    assert abs(cell_qualities(regular)[0]) == pytest.approx(1.0, rel=1e-14)
    value = 12 * 0.5 ** (2 / 3) / 9
    np.testing.assert_allclose(cell_qualities(corner), [value, -value], rtol=1e-14)
    for h in (1.0, 0.1):
        flat = Box((1.0, 1.0, 1.0)).mesh("hex8", 1.0)
        box = Mesh(flat.points * [1.0, 1.0, h], flat.cells, "hex8")
        side = np.ptp(box.points[box.cells[0]], axis=0)
        exact = 3 * np.prod(side) ** (2 / 3) / np.sum(side**2)
        np.testing.assert_allclose(cell_qualities(box), exact, rtol=1e-13)


@pytest.mark.parametrize("shape", SHAPES, ids=lambda s: type(s).__name__)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("quality", [0.2, 1e-3, 1e-6, 1e-9])
def test_the_worst_cell_has_the_quality_that_was_asked_for(shape: Box, kind: str, quality: float) -> None:
    """To 1 % down to 1e-6, where the volume of the worst cell is 1e-9 of a regular one's; to 3 % at 1e-9, where the
    volume is 3e-14 of it and coordinates have 16 digits."""
    made = shape.mesh(kind, 0.25)
    mesh = distort(made, quality)
    assert worst_cell(mesh)[0] == pytest.approx(quality, rel=0.01 if quality > 1e-8 else 0.03)
    assert jacobians(mesh, mesh.element.quadrature()[0]).min() > 0.0
    assert np.all(cell_qualities(mesh) > 0.0)
    # the body is the same: its volume to rounding, its boundary in the planes where it was
    assert mesh.volumes.sum() == pytest.approx(made.volumes.sum(), rel=1e-14)
    np.testing.assert_array_equal(mesh.cells, made.cells)
    np.testing.assert_allclose(mesh.points.min(axis=0), made.points.min(axis=0), atol=1e-15)
    np.testing.assert_allclose(mesh.points.max(axis=0), made.points.max(axis=0), atol=1e-15)
    if isinstance(shape, Cylinder):  # corners on the side slide along the axis only
        corners = np.unique(made.facets[:, : made.element.facet.corners])
        r = [np.hypot(m.points[corners, 1], m.points[corners, 2]) for m in (made, mesh)]
        on = np.abs(r[0] - 0.5) < 1e-9
        np.testing.assert_allclose(r[1][on], 0.5, rtol=1e-14)


def test_it_is_the_same_every_time_and_never_better() -> None:
    made = Box((2.0, 1.0, 1.0)).mesh("tet4", 0.5)
    np.testing.assert_array_equal(distort(made, 1e-4).points, distort(made, 1e-4).points)
    with pytest.raises(QualityTooLow, match=r"0\.\d+"):
        distort(made, 0.99)


def test_edges_of_ten_node_cells_stay_straight() -> None:
    mesh = distort(Box((2.0, 1.0, 1.0)).mesh("tet10", 0.5), 1e-4)
    from softmark.solvers.elements.tet10 import EDGES

    ends = mesh.points[mesh.cells[:, np.array(EDGES)]].mean(axis=2)
    np.testing.assert_allclose(mesh.points[mesh.cells[:, 4:]], ends, atol=1e-15)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("quality", [0.1, 1e-3, 1e-6])
def test_patch_test(
    kind: str, quality: float, law: Callable[..., Law], elastic: Callable[[Mesh, Law], Elastic]
) -> None:
    """A linear displacement of the boundary has the same inside, whatever the cells (Irons and Razzaque 1972).

    Tolerance: the stiffness of a flat cell is larger than others' by its size over its height, 1/q^(3/2), and so is
    what rounding leaves; of that the displacements take a part as small as the cell: 1e-16 / q, and a thousand of
    these, of which tet10 comes to 210.
    """
    mesh = distort(Box((2.0, 1.0, 1.0)).mesh(kind, 0.5), quality)
    H = np.array([[0.01, 0.02, -0.01], [0.0, -0.02, 0.01], [0.03, 0.0, 0.015]])
    exact = (mesh.points @ H.T).ravel()
    boundary = (3 * np.unique(mesh.facets)[:, None] + np.arange(3)).ravel()
    assembly = Assembly(exact.size, boundary, [elastic(mesh, law("small", 1.0, 0.3))], [])
    x = np.zeros_like(exact)
    x[boundary] = exact[boundary]
    free = assembly.free
    x[free] -= factor(assembly.tangent(x, 1.0)).solve(assembly.gradient(x, 1.0)[free])
    error = np.abs(x - exact).max() / np.abs(exact).max()
    assert error < 1e-13 / quality + 1e-12
    F = np.einsum("mai,mqaj->mqij", x.reshape(-1, 3)[mesh.cells], integrate_cells(mesh).dNdX)
    typical = np.median(np.abs(F - H).max(axis=(1, 2, 3)))
    assert typical < 1e-12 / quality
