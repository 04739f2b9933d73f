"""Laws with fibres against FElupe: a bent bar on the same mesh, of which FElupe gets points, cells and energies alone.

It integrates, assembles and solves by itself. Energies are those of the papers, written out here once more; stress is
their derivative by the complex step (Squire and Trapp 1998), exact to rounding, and the stiffness that FElupe iterates
with one by differences, which an answer does not feel. With the pressure of a volume that hardly changes, K = 200 kPa.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.energy import VectorSpace
from softmark.solvers.energies.external_loads import DeadForces
from softmark.solvers.materials import DIRECTED, MATERIALS, law_for
from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.statics.static_equilibrium import Statics, equilibrium

pytestmark = pytest.mark.slow

K = 200e3
LOAD = np.array([0.6e5, 0.2e5, -0.6e5])  # N/m^3: it bends the bar and pulls it
ALONG, BESIDE = (2.0, 0.4, 0.7), (-0.3, 1.0, 0.2)
f = np.array(ALONG) / np.linalg.norm(ALONG)
s = np.array(BESIDE) - (np.array(BESIDE) @ f) * f
s /= np.linalg.norm(s)
n = np.cross(f, s)
STEP = 1e-200  # of the complex step, whose square is nothing
ONSET = 0.05  # wide, so that FElupe converges, which searches along no line

Field = Any  # (..., q, c), complex


def det(F: Field) -> Field:
    return sum(F[0, i] * (F[1, i - 2] * F[2, i - 1] - F[1, i - 1] * F[2, i - 2]) for i in range(3))


def green(F: Field, a: Any, b: Any) -> Field:
    """a . E b of Green's strain."""
    return 0.5 * (np.einsum("kiqc,i,kjqc,j->qc", F, a, F, b) - a @ b)


def first(F: Field) -> Field:
    return np.einsum("kiqc,kiqc->qc", F, F)


def strand(E: Field, k1: float, k2: float) -> Field:
    """k1/(2 k2) (exp(k2 E^2) - 1) of fibres that only pull: to the onset the stress is a E^2 + b E^3."""
    e, top = ONSET, k1 * ONSET * math.exp(k2 * ONSET**2)
    slope = k1 * (1.0 + 2.0 * k2 * e**2) * math.exp(k2 * e**2)
    a, b = np.linalg.solve([[e**2, e**3], [2.0 * e, 3.0 * e**2]], [top, slope])
    begun, at = a * e**3 / 3.0 + b * e**4 / 4.0, 0.5 * k1 * (np.expm1(k2 * e**2) / k2)
    beyond = 0.5 * k1 * (np.exp(k2 * E**2) - 1.0) / k2 - at + begun
    return np.where(E.real > e, beyond, np.where(E.real > 0.0, E * E * E * (a / 3.0 + b / 4.0 * E), 0.0))


def tendon(F: Field) -> Field:
    I4 = 2.0 * green(F, f, f) + 1.0
    return 5e3 * (first(F) - 3.0 - 2.0 * np.log(det(F))) + strand(I4 - 1.0, 20e3, 2.0)


def artery(F: Field) -> Field:
    found = 4e3 * (first(F) - 3.0 - 2.0 * np.log(det(F)))
    for side in (1.0, -1.0):
        a = math.cos(0.6) * f + side * math.sin(0.6) * s
        found = found + strand(0.15 * (first(F) - 3.0) + (1.0 - 0.45) * 2.0 * green(F, a, a), 15e3, 1.5)
    return found


def heart(F: Field) -> Field:
    found = 8e3 / (2.0 * 2.0) * (np.exp(2.0 * (first(F) - 3.0)) - 1.0) - 8e3 * np.log(det(F))
    found = found + strand(2.0 * green(F, f, f), 12e3, 3.0) + strand(2.0 * green(F, s, s), 6e3, 1.0)
    return found + 4e3 / (2.0 * 1.5) * (np.exp(1.5 * (2.0 * green(F, f, s)) ** 2) - 1.0)


def exponential(F: Field, C: float, b: dict[tuple[int, int], float]) -> Field:
    axes = (f, s, n)
    Q = sum((1.0 if i == j else 2.0) * w * green(F, axes[i], axes[j]) ** 2 for (i, j), w in b.items())
    return 0.5 * C * (np.exp(Q) - 1.0)


def muscle(F: Field) -> Field:
    b = {(0, 0): 8.0, (1, 1): 2.0, (2, 2): 2.0, (1, 2): 2.0, (0, 1): 4.0, (0, 2): 4.0}
    return exponential(F, 8e3, b)


def orthotropic(F: Field) -> Field:
    b = {(0, 0): 8.0, (1, 1): 5.0, (2, 2): 3.0, (0, 1): 4.0, (0, 2): 3.5, (1, 2): 2.5}
    return exponential(F, 6e3, b)


GUCCIONE = DIRECTED["guccione"](8e3, 8.0, 2.0, 4.0, 1.0, ALONG, K)
# from where fibres are 1 % shorter: with 4 % FElupe finds nothing
BACK = np.outer(f, f) / 0.99 + 0.99**0.5 * (np.eye(3) - np.outer(f, f))
CASES: dict[str, tuple[Any, Callable[[Field], Field]]] = {
    "transversely_isotropic": (
        DIRECTED["transversely_isotropic"](10e3, 20e3, 2.0, 1.0, ALONG, "tension", K, ONSET), tendon
    ),
    "holzapfel_gasser_ogden": (
        DIRECTED["holzapfel_gasser_ogden"](8e3, 15e3, 1.5, 0.6, 1.0, ALONG, BESIDE, 0.15, K, ONSET), artery
    ),
    "holzapfel_ogden": (
        DIRECTED["holzapfel_ogden"](8e3, 2.0, 12e3, 3.0, 6e3, 1.0, 4e3, 1.5, 1.0, ALONG, BESIDE, K, ONSET), heart
    ),
    "guccione": (GUCCIONE, muscle),
    "fung_orthotropic": (
        DIRECTED["fung_orthotropic"](6e3, 8.0, 5.0, 3.0, 4.0, 3.5, 2.5, 1.0, ALONG, BESIDE, K), orthotropic
    ),
    "active": (DIRECTED["active"](GUCCIONE, 3e3), lambda F: muscle(F) + 1.5e3 * 2.0 * green(F, f, f)),
    "active_strain": (DIRECTED["active_strain"](GUCCIONE, 0.01), lambda F: muscle(np.einsum("iJqc,JK->iKqc", F, BACK))),
}  # fmt: skip


def stress(energy: Callable[[Field], Field], F: Any) -> Any:
    """P (3, 3, q, c): imaginary parts of the energy over the step."""
    found = np.empty(F.shape)
    for i in range(3):
        for j in range(3):
            G = F.astype(complex)
            G[i, j] += 1j * STEP
            found[i, j] = (energy(G) + 0.5 * K * (det(G) - 1.0) ** 2).imag / STEP
    return found


def by_felupe(mesh: Mesh, energy: Callable[[Field], Field]) -> Any:
    """Displacements (n, 3), in load steps, to a residual of 1e-11."""
    import felupe

    def tangent(x: Any, **more: Any) -> Any:
        F, h = x[0], 1e-7
        found, here = np.empty((3, 3, *F.shape)), stress(energy, F)
        for k in range(3):
            for m in range(3):
                G = F.copy()
                G[k, m] += h
                found[:, :, k, m] = (stress(energy, G) - here) / h
        return [found]

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        region = felupe.RegionHexahedron(felupe.Mesh(mesh.points, mesh.cells, "hexahedron"))
        field = felupe.FieldContainer([felupe.Field(region, dim=3)])
        clamp = {"wall": felupe.Boundary(field[0], fx=0.0)}
        dof0, dof1 = felupe.dof.partition(field, clamp)
        law = felupe.Material(lambda x, **more: [stress(energy, x[0]), x[-1]], tangent)
        body, weight = felupe.SolidBody(law, field), felupe.SolidBodyForce(field)
        for part in np.linspace(0.0, 1.0, 9)[1:]:
            weight.update(part * LOAD)
            felupe.newtonraphson(items=[body, weight], x0=field, dof0=dof0, dof1=dof1, tol=1e-11, maxiter=60,
                                 ext0=felupe.dof.apply(field, clamp, dof0), verbose=0)  # fmt: skip
    return np.array(field[0].values)


@pytest.mark.long
@pytest.mark.parametrize("name", CASES)
def test_a_bent_bar_with_fibres_is_that_of_felupe(name: str) -> None:
    """All nodes to 1e-8 of the largest displacement, several mm: rounding, and what is left of two residuals."""
    material, energy = CASES[name]
    mesh = Box((40e-3, 10e-3, 10e-3)).mesh("hex8", 5e-3)
    parts = integrate_cells(mesh)
    elastic = Elastic(mesh.cells, parts.dNdX, parts.w, law_for(material, "finite"))
    weight = np.zeros_like(mesh.points)
    np.add.at(weight, mesh.cells, (parts.w @ parts.N)[:, :, None] * LOAD)
    fixed = (3 * np.nonzero(mesh.points[:, 0] < 1e-9)[0][:, None] + np.arange(3)).ravel()
    assembly = Assembly(weight.size, fixed, [elastic], [DeadForces(weight.ravel())])
    none = np.zeros(len(fixed))
    u = equilibrium(Statics(assembly, VectorSpace(weight.size), np.zeros(weight.size), fixed, none, 1e-11)).x
    theirs = by_felupe(mesh, energy)
    assert np.abs(theirs).max() > 2e-3
    assert np.abs(u.reshape(-1, 3) - theirs).max() <= 1e-8 * np.abs(theirs).max()


def test_every_law_with_fibres_is_here() -> None:
    assert CASES.keys() == DIRECTED.keys()
    assert MATERIALS.keys().isdisjoint(CASES)
