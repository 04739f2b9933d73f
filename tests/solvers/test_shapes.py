"""Round bodies: their meshes fill them with the order of the element, and conform to what they say of themselves."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from softmark.solvers.elements import element_of
from softmark.solvers.mesh.arc_shapes import Arc
from softmark.solvers.mesh.mesh import jacobians
from softmark.solvers.mesh.mesh_refinement import build_finer_space
from softmark.solvers.mesh.shape import Shape
from softmark.solvers.mesh.spheres import Ellipsoid, Sphere, SphericalShell
from softmark.solvers.mesh.tubes import Annulus, Tube

SIZE = 0.004
BODIES: dict[str, Shape] = {
    "tube": Tube(0.02, 0.01, 0.006, (0.0, 0.6, 0.8), (1.0, 2.0, 3.0)),
    "sphere": Sphere(0.01, (0.0, 0.01, 0.0)),
    "octant": Sphere(0.01, part="octant"),
    "ellipsoid": Ellipsoid((0.012, 0.008, 0.01), part="half"),
    "shell": SphericalShell(0.01, 0.005, part="quarter"),
    "arc": Arc(0.02, 1.2, side=0.01, height=0.008, axis=(0.0, 0.6, 0.8)),
    "bent rod": Arc(0.02, 2.0, section_radius=0.01, origin=(1.0, 2.0, 3.0)),
}
ORDERS = {"tet4": 2.0, "hex8": 2.0, "tet10": 4.0, "hex20": 4.0, "hex27": 4.0}


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize(("kind", "order"), ORDERS.items())
def test_volume_converges_with_the_order_of_the_facets(name: str, kind: str, order: float) -> None:
    """Facets are inscribed: flat ones miss h^2 of the volume, quadratic ones h^4 (as interpolation of the surface)."""
    shape = BODIES[name]
    missing = [abs(float(shape.mesh(kind, h).volumes.sum()) / shape.volume - 1.0) for h in (SIZE, SIZE / 2.0)]
    assert missing[1] < missing[0] < 0.2
    found = math.log2(missing[0] / missing[1])
    assert found > order - 0.45, "the coarse mesh is not yet where its order is, and numbers of cells are rounded"


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("kind", ORDERS)
def test_cells_are_sound(name: str, kind: str) -> None:
    """No cell is inside out at its nodes or its points of quadrature, and nodes are shared."""
    for size in (4.0 * SIZE, SIZE):
        mesh = BODIES[name].mesh(kind, size)
        assert len(np.unique(mesh.cells)) == len(mesh.points)
        places = np.concatenate([element_of(kind).quadrature()[0], element_of(kind).places()])
        assert jacobians(mesh, places).min() > 0.0
        apart = np.unique(np.round(mesh.points / (1e-6 * mesh.extent)), axis=0)
        assert len(apart) == len(mesh.points)


@pytest.mark.parametrize("name", BODIES)
def test_tetrahedra_are_well_shaped(name: str) -> None:
    """Mean ratio (Liu and Joe 1994), 1 of a regular tetrahedron: above 0.3, as those of the cylinder."""
    mesh = BODIES[name].mesh("tet4", SIZE / 2.0)
    X = mesh.points[mesh.cells]
    edges = X[:, [0, 0, 0, 1, 1, 2]] - X[:, [1, 2, 3, 2, 3, 3]]
    quality = 12.0 * np.cbrt(3.0 * mesh.volumes) ** 2 / (edges**2).sum(axis=(1, 2))
    assert quality.min() > 0.3


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("kind", ["tet4", "tet10", "hex8"])
def test_finer_spaces_lie_on_the_true_surface(name: str, kind: str) -> None:
    """New nodes go onto the sides: what is missing of the volume falls with the order of the finer facets."""
    shape = BODIES[name]
    mesh = shape.mesh(kind, SIZE / 2.0)
    before, after = (
        abs(float(m.volumes.sum()) / shape.volume - 1.0) for m in (mesh, build_finer_space(mesh, shape).mesh)
    )
    assert after < before / 3.4


@pytest.mark.parametrize("name", BODIES)
def test_every_facet_is_of_a_side_or_flat(name: str) -> None:
    """Facets that are of no curved side lie in a plane of the body's ends or of symmetry."""
    shape = BODIES[name]
    mesh = shape.mesh("hex8", SIZE)
    corners = mesh.points[mesh.facets]
    curved = np.zeros(len(corners), dtype=bool)
    for side in shape.sides:
        curved |= side.of(corners)
    rest = corners[~curved]
    normal = np.cross(rest[:, 1] - rest[:, 0], rest[:, 3] - rest[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    planes = np.unique(np.round(np.column_stack([normal, np.einsum("fi,fi->f", normal, rest[:, 0])]), 9), axis=0)
    due = {"tube": 2, "sphere": 0, "octant": 3, "ellipsoid": 1, "shell": 2, "arc": 4, "bent rod": 2}
    assert len(planes) == due[name]


@pytest.mark.parametrize("cls", [Sphere, Ellipsoid, SphericalShell])
def test_parts_are_parts_of_the_whole(cls: type[Any]) -> None:
    """A mesh of a part has cells of the whole's mesh, whose mirror images fill the whole, to the last digits."""
    fields = {"semiaxes": (0.01, 0.008, 0.006)} if cls is Ellipsoid else {"radius": 0.01}
    fields |= {"inner": 0.005} if cls is SphericalShell else {}
    whole = cls(**fields).mesh("tet10", SIZE)
    for part, share in (("half", 2), ("quarter", 4), ("octant", 8)):
        mesh = cls(**fields, part=part).mesh("tet10", SIZE)
        assert len(mesh.cells) * share == len(whole.cells)
        assert float(mesh.volumes.sum()) * share == pytest.approx(float(whole.volumes.sum()), rel=1e-12)
        gaps = np.abs(mesh.points[:, None] - whole.points[None]).max(axis=2).min(axis=1)
        assert gaps.max() < 1e-12


def test_a_tube_has_nodes_on_the_cuts_of_supports() -> None:
    """Planes through the axis, circles around it, planes across it."""
    from softmark.solvers.mesh.conforming_planes import Cut

    tube = Tube(0.1, 0.01, 0.006)
    cut = tube.cut_at_plane((0.0, 0.6, 0.8, 0.0))
    assert cut is not None
    assert tube.cut_at_plane((0.0, 0.6, 0.8, 0.001)) is None
    X = tube.mesh("hex8", SIZE, (cut, Cut("radius", 0.0085), Cut("along", 0.033))).points
    for level in (X @ [0.0, 0.6, 0.8], np.hypot(X[:, 1], X[:, 2]) - 0.0085, X[:, 0] - 0.033):
        assert (np.abs(level) < 1e-12).sum() > 10
    cells = tube.counts(SIZE, (Cut("radius", 0.0085), Cut("along", 0.033)))
    assert math.prod(cells) == len(tube.mesh("hex8", SIZE, (Cut("radius", 0.0085), Cut("along", 0.033))).cells)


def test_a_ring_is_a_disc_without_a_disc() -> None:
    """Its moments by another formula; of no hollow those of a disc; of a thin wall 2 pi r^3 t (Roark, table A.1)."""
    ring = Annulus(0.01, 0.006)
    assert ring.moments[0] == pytest.approx(math.pi * (0.01**4 - 0.006**4) / 4, rel=1e-14)
    assert ring.torsion == pytest.approx(math.pi * (0.01**4 - 0.006**4) / 2, rel=1e-14)
    assert Annulus(0.01, 1e-9).shear_factor(0.3) == pytest.approx(6 * 1.3 / (7 + 1.8), rel=1e-12)
    thin = Annulus(0.01 + 5e-7, 0.01 - 5e-7)
    assert thin.torsion == pytest.approx(2 * math.pi * 0.01**3 * 1e-6, rel=1e-6)
    assert thin.shear_factor(0.3) == pytest.approx(2 * 1.3 / (4 + 0.9), rel=1e-6), "Cowper's thin tube"
