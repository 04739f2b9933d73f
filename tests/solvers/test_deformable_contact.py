"""Bodies that keep clear of each other: derivatives, patch test, nothing passes through."""

from __future__ import annotations

import numpy as np
import pytest

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.assembly.single_precision import SingleAssembly
from softmark.solvers.contact.contact_surface import build_contact_surface, number_mesh_pieces
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.energy import VectorSpace
from softmark.solvers.independent_forces.self_intersection import find_intersections
from softmark.solvers.materials import law_for
from softmark.solvers.materials.neo_hookean import NeoHookean
from softmark.solvers.mesh.disjoint_shapes import DisjointShapes
from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.plane_regions import Quadrilateral
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.statics.static_equilibrium import Statics, equilibrium

pytest.importorskip("ipctk")
from softmark.solvers.contact.deformable_contact import IpcContact

GAP = 2e-3


def blocks(kind, gap=GAP, size=0.5, coarser=0.68):
    """Two cubes of 1 m, one above the other, whose meshes do not match."""
    return DisjointShapes(Box((1.0, 1.0, 1.0)), Box((1.0, 1.0, 1.0), (0.0, 0.0, 1.0 + gap)), coarser).mesh(kind, size)


def slices(kind, gap=GAP):
    """The same as squares."""
    low = Quadrilateral((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0))
    high = Quadrilateral((0.0, 1.0 + gap, 0.0), (1.0, 1.0 + gap, 0.0), (1.0, 2.0, 0.0), (0.0, 2.0, 0.0))
    return DisjointShapes(low, high, 1.4).slice(0.05).mesh(kind, 0.25)


def between(mesh, gap=GAP):
    """Facets of the two faces that look at each other."""
    z = mesh.points[mesh.facets][:, :, 2]
    return np.flatnonzero((np.abs(z - 1.0) < 2 * gap + 1e-9).all(axis=1))


CASES = [("tet4", 0.0), ("tet10", 0.0), ("hex8", 0.0), ("hex20", 0.0), ("quad4", 0.0), ("tri6", 0.0), ("quad8", 0.05)]


@pytest.mark.parametrize(("kind", "depth"), CASES)
@pytest.mark.parametrize("alone", [True, False])
def test_derivatives(kind, depth, alone):
    """Gradient and Hessian are those of the value (differences over 1e-8 m), and forces add up to nothing."""
    flat = kind.startswith(("quad", "tri"))
    mesh = slices(kind) if flat else blocks(kind)
    n = mesh.points.size
    e = IpcContact(build_contact_surface(mesh, n, 3, None, flat, depth), 2 * GAP, 100.0, alone)
    x, d = 2e-4 * np.random.default_rng(1).standard_normal(n), np.random.default_rng(2).standard_normal(n)
    h = 1e-8

    def gradient(x):
        g = np.zeros(n)
        e.add_gradient(x, g)
        return g

    assert e.value(x) > 0.0
    assert (e.value(x + h * d) - e.value(x - h * d)) / (2 * h) == pytest.approx(gradient(x) @ d, rel=1e-5)
    difference = (gradient(x + h * d) - gradient(x - h * d)) / (2 * h)
    np.testing.assert_allclose(e.matrix(x) @ d, difference, atol=1e-5 * np.abs(difference).max())
    if not depth:
        np.testing.assert_allclose(gradient(x).reshape(-1, 3).sum(axis=0), 0.0, atol=1e-12 * np.abs(gradient(x)).max())
    least = np.linalg.eigvalsh(e.matrix(x, projected=True).toarray()).min()
    assert least >= -1e-12 * abs(e.matrix(x)).max()


def test_single_precision_has_their_stiffness_too():
    """The tangent of both blocks and what keeps them apart: that in double precision to 1e-5 of its largest entry."""
    mesh = blocks("tet4")
    n, parts_of = mesh.points.size, integrate_cells(mesh)
    elastic = Elastic(
        mesh.cells, parts_of.dNdX, parts_of.w, law_for(NeoHookean(young=1.0, poisson=0.3, density=1.0), "finite")
    )
    e = IpcContact(build_contact_surface(mesh, n, 3, between(mesh)), 2 * GAP, 100.0, True)
    whole = Assembly(n, np.zeros(0, dtype=np.int64), [elastic, e], [])
    x = (2e-4 * np.random.default_rng(1).standard_normal(n)).astype(np.float32)
    K, known = SingleAssembly.of(whole).tangent(x, 1.0), whole.tangent(x.astype(np.float64), 1.0)
    assert K.dtype == np.float32
    assert abs(e.matrix(x)).max() > 0.1 * abs(known).max()
    assert abs(K - known).max() < 1e-5 * abs(known).max()


def pressed(kind, parts, down=0.05):
    """Two blocks pressed together between smooth walls: stresses along z at all Gauss points, and the energy."""
    mesh = blocks(kind)
    n, P = mesh.points.size, mesh.points
    law = law_for(NeoHookean(young=1.0, poisson=0.3, density=1.0), "finite")
    parts_of = integrate_cells(mesh)
    elastic = Elastic(mesh.cells, parts_of.dNdX, parts_of.w, law)
    e = IpcContact(build_contact_surface(mesh, n, parts, between(mesh)), GAP, 0.1, True)
    lid = 3 * np.flatnonzero(P[:, 2] > 2.0 + GAP - 1e-9) + 2
    floor = 3 * np.flatnonzero(P[:, 2] < 1e-9) + 2
    walls = (3 * np.flatnonzero(P[:, i] < 1e-9) + i for i in (0, 1))
    fixed = np.unique(np.concatenate([lid, floor, *walls]))
    assembly = Assembly(n, fixed, [elastic, e], [], P)
    target = np.where(np.isin(fixed, lid), -down, 0.0)

    def sound(x):
        return bool((np.linalg.det(elastic.F(x)) > 0).all())

    found = equilibrium(Statics(assembly, VectorSpace(n), np.zeros(n), fixed, target, sound=sound, extent=mesh.extent))
    F = elastic.F(found.x)
    stress = (law.P(F) @ F.transpose(0, 2, 1) / np.linalg.det(F)[:, None, None])[:, 2, 2]
    return stress, e, found, assembly.gradient(found.x, 1.0), lid, floor


SLOWER = [pytest.param(kind, 4, marks=pytest.mark.slow) for kind in ("tet10", "hex20")]


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(("kind", "parts"), [("tet4", 3), ("hex8", 3), *SLOWER])
def test_patch(kind, parts):
    """A uniform pressure is one through meshes that do not match, within 0.5 % anywhere at the usual parts of a facet.

    Taylor and Papadopoulos (1991). The rest is what quadrature over the facets of the other mesh leaves.
    """
    stress, e, found, g, lid, floor = pressed(kind, parts)
    assert abs(stress / stress.mean() - 1.0).max() < 0.005
    assert g[lid].sum() == pytest.approx(-g[floor].sum(), rel=1e-9)
    skin = e.skin
    assert len(find_intersections(skin.places(found.x)[: skin.corners], skin.faces)) == 0
    assert 0.0 < e.least(found.x) < GAP


@pytest.mark.long
@pytest.mark.slow
def test_patch_converges():
    """The error of stress falls with the square of the parts, as that of facets split in flat triangles does."""
    errors = [(s := pressed("hex8", parts)[0]).std() / -s.mean() for parts in (2, 4)]
    assert errors[1] < 0.35 * errors[0]


def test_steps_end_before_faces_meet():
    """A motion of one block through the other is cut; what is left of it ends with a gap."""
    mesh = blocks("tet4")
    n = mesh.points.size
    e = IpcContact(build_contact_surface(mesh, n, 2), GAP, 1.0, True)
    d = np.zeros((len(mesh.points), 3))
    d[number_mesh_pieces(mesh) == 1, 2] = -0.5
    share = e.limit(np.zeros(n), d.ravel())
    assert 0.5 * GAP < 0.5 * share < GAP
    assert not e.intersects(share * d.ravel())
    assert e.value(d.ravel()) == np.inf


def test_crossings():
    """Two triangles, one through the other, cross; moved apart, or along the other's plane beside it, they do not."""
    t = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    through = np.array([[0.2, 0.2, -1.0], [0.2, 0.2, 1.0], [0.3, 0.9, 1.0]])
    faces = np.arange(6).reshape(2, 3)
    assert len(find_intersections(np.concatenate([t, through]), faces)) == 1
    for away in ([0.0, 0.0, 1.5], [2.0, 0.0, 0.0]):
        assert len(find_intersections(np.concatenate([t, through + np.array(away)]), faces)) == 0
    lines = np.array([[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0]])
    assert len(find_intersections(lines, np.array([[0, 1], [2, 3]]))) == 1
    lines[2:, 0] += 1.0
    assert len(find_intersections(lines, np.array([[0, 1], [2, 3]]))) == 0


@pytest.mark.parametrize("kind", ["quad8", "tri6"])
def test_a_slice_is_pressed_alike_through_its_thickness(kind):
    """What moves its middle one way and its faces the other, and nothing on the mean, does not move its border.

    Forces on the middle alone are not those of a traction that is the same all through, and bend facets of eight nodes:
    forces between squares pressed by a twentieth were a third too small in quad8, two thirds in tri6.
    """
    mesh = slices(kind)
    skin = build_contact_surface(mesh, mesh.points.size, 3, None, True)
    z = mesh.points[:, 2] - mesh.points[:, 2].mean()
    x = np.zeros((len(z), 3))
    x[:, 1] = 0.01 * ((z / z.max()) ** 2 - 1.0 / 3.0)
    assert skin.places(x.ravel()) == pytest.approx(skin.X, abs=1e-15)
    x[:, 1] = 0.01  # all of it goes along
    assert skin.places(x.ravel()) - skin.X == pytest.approx(np.tile([0.0, 0.01], (len(skin.X), 1)))
