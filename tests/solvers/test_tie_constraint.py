"""Ties of meshes that do not match: areas in common, derivatives, patch test."""

from __future__ import annotations

import numpy as np
import pytest

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.contact.contact_surface import number_mesh_pieces
from softmark.solvers.contact.surface_overlap import find_overlaps
from softmark.solvers.contact.tie_constraint import tie_surfaces
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.energy import VectorSpace
from softmark.solvers.materials import law_for
from softmark.solvers.materials.neo_hookean import NeoHookean
from softmark.solvers.mesh.disjoint_shapes import DisjointShapes
from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.statics.static_equilibrium import Statics, equilibrium

KINDS = ["tet4", "tet10", "hex8", "hex20", "hex27"]


def blocks(kind):
    """Two cubes of 1 m that touch at z = 1, whose meshes do not match, and the facets of both faces there."""
    mesh = DisjointShapes(Box((1.0, 1.0, 1.0)), Box((1.0, 1.0, 1.0), (0.0, 0.0, 1.0)), 0.68).mesh(kind, 0.5)
    face = np.flatnonzero((np.abs(mesh.points[mesh.facets][:, :, 2] - 1.0) < 1e-9).all(axis=1))
    piece = number_mesh_pieces(mesh)[mesh.facets[face, 0]]
    return mesh, face[piece == 0], face[piece == 1]


@pytest.mark.parametrize("kind", KINDS)
def test_areas(kind):
    """What facets have in common covers the face once; a linear function is the same on both sides of it."""
    mesh, one, other = blocks(kind)
    common = find_overlaps(mesh, one, other, 1e-3)
    assert common.A.sum() == pytest.approx(1.0, rel=1e-12)
    assert common.gaps.max() < 1e-12
    np.testing.assert_allclose(common.A @ common.X, [0.5, 0.5, 1.0], atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_patch(kind):
    """A block of two glued halves that is stretched by a fifth has one stress, whatever the meshes (Irons 1972)."""
    mesh, one, other = blocks(kind)
    n, P = mesh.points.size, mesh.points
    law = law_for(NeoHookean(young=1.0, poisson=0.3, density=1.0), "finite")
    parts = integrate_cells(mesh)
    elastic = Elastic(mesh.cells, parts.dNdX, parts.w, law)
    glue = tie_surfaces(mesh, one, other, 1e4, 1e-3)
    lid, floor = (3 * np.flatnonzero(np.abs(P[:, 2] - z) < 1e-9) + 2 for z in (2.0, 0.0))
    walls = (3 * np.flatnonzero(P[:, i] < 1e-9) + i for i in (0, 1))
    fixed = np.unique(np.concatenate([lid, floor, *walls]))
    target = np.where(np.isin(fixed, lid), 0.2, 0.0)
    assembly = Assembly(n, fixed, [elastic, glue], [], P)
    found = equilibrium(Statics(assembly, VectorSpace(n), np.zeros(n), fixed, target, extent=mesh.extent))
    F = elastic.F(found.x)
    stress = (law.P(F) @ F.transpose(0, 2, 1) / np.linalg.det(F)[:, None, None])[:, 2, 2]
    np.testing.assert_allclose(stress, stress.mean(), rtol=1e-9)
    assert assembly.gradient(found.x, 1.0)[lid].sum() == pytest.approx(-assembly.gradient(found.x, 1.0)[floor].sum())


def test_derivatives():
    """Of a quadratic energy, by its values."""
    mesh, one, other = blocks("tet10")
    glue = tie_surfaces(mesh, one, other, 1e3, 1e-3)
    x, d = (np.random.default_rng(i).standard_normal(mesh.points.size) for i in (1, 2))
    g = np.zeros_like(x)
    glue.add_gradient(x, g)
    assert (glue.value(x + d) - glue.value(x - d)) / 2 == pytest.approx(g @ d, rel=1e-9)
    np.testing.assert_allclose(g.reshape(-1, 3).sum(axis=0), 0.0, atol=1e-10 * np.abs(g).max())
