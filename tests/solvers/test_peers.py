"""Other packages on the identical mesh: scikit-fem for linear elasticity, FElupe for both neo-Hookean forms.

The beam of 2008, inscribed mesh of 900 tetrahedra, full weight. Peers get our points and cells and nothing
else; they assemble, load and solve by themselves. All converge to residuals far below the 1e-8 asked of the
displacements.
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.energy import VectorSpace
from softmark.solvers.energies.external_loads import DeadForces
from softmark.solvers.materials import MATERIALS, law_for
from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box, Cylinder
from softmark.solvers.statics.static_equilibrium import Statics, equilibrium

E, NU, RHO, G = 60e3, 0.49, 1070.0, 9.81
MU, LAM = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
DOWN = np.array([0.0, 0.0, -RHO * G])  # N/m^3


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    return Cylinder(0.178, 0.019).mesh("tet4", 12e-3)


def ours(mesh: Mesh, material: str, strain: str) -> np.ndarray:
    """Displacements (n, 3) by our solver, to a residual of 1e-11."""
    parts = integrate_cells(mesh)
    law = law_for(MATERIALS[material](E, NU, RHO), strain)
    elastic = Elastic(mesh.cells, parts.dNdX, parts.w, law)
    f = np.zeros_like(mesh.points)
    np.add.at(f, mesh.cells, (parts.w @ parts.N)[:, :, None] * DOWN)
    fixed = (3 * np.nonzero(mesh.points[:, 0] < 1e-9)[0][:, None] + np.arange(3)).ravel()
    dofs = mesh.points.size
    assembly = Assembly(dofs, fixed, [elastic], [DeadForces(f.ravel())])
    problem = Statics(assembly, VectorSpace(dofs), np.zeros(dofs), fixed, np.zeros(len(fixed)), 1e-11)
    if strain == "finite":
        turning = replace(elastic, law=law_for(MATERIALS[material](E, NU, RHO), "corotational"))
        problem = replace(problem, twin=assembly.with_internal([turning]))
    return equilibrium(problem).x.reshape(-1, 3)


def by_felupe(mesh: Mesh, law: Any) -> np.ndarray:
    """Displacements (n, 3) by FElupe, in load steps as its Newton iteration needs them."""
    import felupe

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if mesh.kind == "hex8":
            region = felupe.RegionHexahedron(felupe.Mesh(mesh.points, mesh.cells, "hexahedron"))
        else:
            region = felupe.RegionTetra(felupe.Mesh(mesh.points, mesh.cells, "tetra"))
        field = felupe.FieldContainer([felupe.Field(region, dim=3)])
        clamp = {"wall": felupe.Boundary(field[0], fx=0.0)}
        dof0, dof1 = felupe.dof.partition(field, clamp)
        body = felupe.SolidBody(law, field)
        weight = felupe.SolidBodyForce(field)
        for part in np.linspace(0.0, 1.0, 26)[1:]:
            weight.update(part * DOWN)
            felupe.newtonraphson(
                items=[body, weight],
                x0=field,
                dof0=dof0,
                dof1=dof1,
                ext0=felupe.dof.apply(field, clamp, dof0),
                tol=1e-11,
                maxiter=60,
                verbose=0,
            )
    return np.array(field[0].values)


def assert_same(mesh: Mesh, u: np.ndarray, v: np.ndarray) -> None:
    """1e-8 relative, in the whole field and at the tip: they differ by rounding and their last residuals."""
    tip = np.argmin(np.linalg.norm(mesh.points - [0.178, 0.0, 0.0], axis=1))
    assert np.linalg.norm(v[tip]) > 0.05  # a large bend, not a body at rest
    assert np.linalg.norm(u[tip] - v[tip]) <= 1e-8 * np.linalg.norm(v[tip])
    assert np.abs(u - v).max() <= 1e-8 * np.abs(v).max()


def test_linear_elasticity_against_scikit_fem(mesh: Mesh) -> None:
    import skfem
    from skfem.helpers import dot
    from skfem.models.elasticity import linear_elasticity

    basis = skfem.Basis(skfem.MeshTet(mesh.points.T, mesh.cells.T), skfem.ElementVector(skfem.ElementTetP1()))
    K = linear_elasticity(LAM, MU).assemble(basis)
    f = skfem.LinearForm(lambda v, w: dot(DOWN[:, None, None] + 0 * w.x, v)).assemble(basis)
    clamped = basis.get_dofs(lambda x: np.abs(x[0]) < 1e-9)
    solution = skfem.solve(*skfem.condense(K, f, D=clamped))
    # scikit-fem numbers points as they were given: nodal_dofs (3, n)
    assert_same(mesh, ours(mesh, "linear_elastic", "small"), solution[basis.nodal_dofs].T)


@pytest.mark.long
@pytest.mark.slow
def test_neo_hookean_logarithmic_against_felupe(mesh: Mesh) -> None:
    import felupe

    # NeoHookeCompressible: psi = mu/2 (tr C - ln det C - 3) + lambda/2 (ln J)^2, ours with ln det C = 2 ln J
    theirs = by_felupe(mesh, felupe.NeoHookeCompressible(mu=MU, lmbda=LAM))
    assert_same(mesh, ours(mesh, "neo_hookean", "finite"), theirs)


@pytest.mark.long
@pytest.mark.slow
def test_neo_hookean_isochoric_against_felupe(mesh: Mesh) -> None:
    import felupe

    # NeoHooke: psi = mu/2 (J^(-2/3) tr C - 3) + K/2 (J - 1)^2
    bulk = E / (3 * (1 - 2 * NU))
    theirs = by_felupe(mesh, felupe.NeoHooke(mu=MU, bulk=bulk))
    assert_same(mesh, ours(mesh, "neo_hookean_isochoric", "finite"), theirs)


# scikit-fem's order of the corners of a hexahedron, in ours
SKFEM_HEX = [0, 4, 3, 1, 7, 5, 2, 6]


def test_hexahedra_against_scikit_fem() -> None:
    """Linear elasticity; scikit-fem with its default quadrature, which is exact on these prisms to 1e-8 or better."""
    import skfem
    from skfem.helpers import dot
    from skfem.models.elasticity import linear_elasticity

    mesh = Cylinder(0.178, 0.019).mesh("hex8", 12e-3)
    theirs = skfem.MeshHex(mesh.points.T, mesh.cells[:, SKFEM_HEX].T)
    basis = skfem.Basis(theirs, skfem.ElementVector(skfem.ElementHex1()), intorder=3)
    K = linear_elasticity(LAM, MU).assemble(basis)
    f = skfem.LinearForm(lambda v, w: dot(DOWN[:, None, None] + 0 * w.x, v)).assemble(basis)
    clamped = basis.get_dofs(lambda x: np.abs(x[0]) < 1e-9)
    solution = skfem.solve(*skfem.condense(K, f, D=clamped))
    assert_same(mesh, ours(mesh, "linear_elastic", "small"), solution[basis.nodal_dofs].T)


def test_quadratic_tetrahedra_against_scikit_fem() -> None:
    """On a box, whose cells have straight edges: points are compared where both have them, at the corners."""
    import skfem
    from skfem.helpers import dot
    from skfem.models.elasticity import linear_elasticity

    mesh = Box((0.178, 0.03, 0.03)).mesh("tet10", 15e-3)
    corners = np.unique(mesh.cells[:, :4])
    assert np.array_equal(corners, np.arange(len(corners)))
    straight = skfem.MeshTet(mesh.points[corners].T, mesh.cells[:, :4].T)
    basis = skfem.Basis(straight, skfem.ElementVector(skfem.ElementTetP2()), intorder=2)
    K = linear_elasticity(LAM, MU).assemble(basis)
    f = skfem.LinearForm(lambda v, w: dot(DOWN[:, None, None] + 0 * w.x, v)).assemble(basis)
    clamped = basis.get_dofs(lambda x: np.abs(x[0]) < 1e-9)
    solution = skfem.solve(*skfem.condense(K, f, D=clamped))
    u, v = ours(mesh, "linear_elastic", "small")[corners], solution[basis.nodal_dofs].T
    assert np.abs(v).max() > 0.01
    assert np.abs(u - v).max() <= 1e-8 * np.abs(v).max()


@pytest.mark.long
@pytest.mark.slow
def test_neo_hookean_hexahedra_against_felupe() -> None:
    import felupe

    mesh = Cylinder(0.178, 0.019).mesh("hex8", 12e-3)
    theirs = by_felupe(mesh, felupe.NeoHookeCompressible(mu=MU, lmbda=LAM))
    assert_same(mesh, ours(mesh, "neo_hookean", "finite"), theirs)
