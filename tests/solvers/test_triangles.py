"""Meshes of plane triangles: slices of wedges, cut from the grid of a region."""

from __future__ import annotations

import numpy as np
import pytest

from softmark.solvers.mesh.conforming_planes import Cut
from softmark.solvers.mesh.jacobian_bounds import find_folded_cells
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.mesh_distortion import cell_qualities
from softmark.solvers.mesh.mesh_refinement import build_finer_space
from softmark.solvers.mesh.plane_regions import Quadrilateral, QuarterRing, Slice

PANEL = Slice(Quadrilateral((0.0, 0.0, 0.0), (0.048, 0.044, 0.0), (0.048, 0.06, 0.0), (0.0, 0.044, 0.0)), 0.004)
RING = Slice(QuarterRing(1.0, 2.0), 0.2)
BOTH = pytest.mark.parametrize("kind", ["tri3", "tri6"])


def outward(mesh: Mesh) -> float:
    """The volume that the boundary's triangles enclose, m^3."""
    a, b, c = np.moveaxis(mesh.points[mesh.faces], 1, 0)
    return float(np.einsum("fi,fi->", a, np.cross(b, c))) / 6.0


@BOTH
def test_cells_fill_the_region_and_its_surface_is_closed(kind: str) -> None:
    """Straight sides: the volume to rounding, by cells and by what triangles of the surface enclose; none is empty."""
    mesh = PANEL.mesh(kind, 0.01)
    assert mesh.volumes.min() > 0.0
    assert mesh.volumes.sum() == pytest.approx(PANEL.volume, rel=1e-13)
    assert outward(mesh) == pytest.approx(PANEL.volume, rel=1e-13)
    a, b, c = np.moveaxis(mesh.points[mesh.faces], 1, 0)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 0.0
    assert cell_qualities(mesh).min() > 0.0


def test_curved_sides_lie_on_the_circle() -> None:
    """All nodes of facets on the two arcs; parabolas through three points of an arc miss next to nothing."""
    mesh = RING.mesh("tri6", 0.25)
    r = np.hypot(*mesh.points[mesh.facets, :2].transpose(2, 0, 1))
    for radius in (1.0, 2.0):
        on = r[(np.abs(r[:, :4] - radius) < 1e-12).all(axis=1)]
        assert len(on) == RING.counts(0.25)[1]
        assert on == pytest.approx(radius, abs=1e-12)
    assert mesh.volumes.sum() == pytest.approx(RING.volume, rel=1e-5)
    assert not len(find_folded_cells(mesh, np.zeros(len(mesh.cells)))[0])


@BOTH
def test_borders_get_nodes(kind: str) -> None:
    """At a share of 0.37 of the wall, on no line of an even grid."""
    mesh = RING.mesh(kind, 0.25, (Cut("s", 0.37),))
    r = np.hypot(*mesh.points[mesh.cells[:, :6], :2].transpose(2, 0, 1))
    assert not ((r.min(axis=1) < 1.37 - 1e-9) & (r.max(axis=1) > 1.37 + 1e-9)).any()


@BOTH
def test_their_finer_space_holds_theirs(kind: str) -> None:
    """The fine mesh is of the same body, and a field of the coarse one is in it: here x, and what the cells map."""
    mesh = PANEL.mesh(kind, 0.02)
    above = build_finer_space(mesh)
    assert above.mesh.kind == "wedge15"
    assert len(above.mesh.cells) == len(mesh.cells) * (1 if kind == "tri3" else 8)
    assert above.mesh.volumes.min() > 0.0
    assert above.mesh.volumes.sum() == pytest.approx(PANEL.volume, rel=1e-13)
    assert above.interpolate_displacements(mesh.points) == pytest.approx(above.mesh.points, abs=1e-16)


def test_a_region_reversed_or_folded_is_seen() -> None:
    """A wedge whose corners go the other way is turned back; one with a corner pushed through it is inside out."""
    mesh = PANEL.mesh("tri3", 0.02)
    turned = Mesh(mesh.points, mesh.cells[:, list(mesh.element.mirrored_nodes)], mesh.kind)
    assert turned.volumes == pytest.approx(-mesh.volumes, rel=1e-12)
    assert cell_qualities(turned).max() < 0.0
