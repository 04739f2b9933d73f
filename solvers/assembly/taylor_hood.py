"""Poroelastic energies of meshes, over displacements and Taylor-Hood pore pressures."""

from __future__ import annotations

from typing import Any

import numpy as np

from softmark.solvers.elements import element_of
from softmark.solvers.energies.poroelastic import PermeabilityLaw, PoroelasticSolid
from softmark.solvers.mesh.element_interpolation import IntegrationPoints
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.pressure_interpolation import build_pressure_space


def poroelastic_energy(
    mesh: Mesh, parts: IntegrationPoints, pair: Any, mu: float, pores: PermeabilityLaw, turns: bool
) -> PoroelasticSolid:
    """Return the energy of a porous solid, whose unknowns are displacements followed by pore pressures.

    `pair` is the law of the skeleton and its volume constraint, and `pores` the permeability law. `turns` is False for
    small strains. The unit of pressures is the shear modulus `mu`, Pa, divided by the edge length of a mean cell, m, so
    that the blocks of the matrix are balanced. Raises KeyError for an element whose pressures are not continuous.
    """
    if mesh.element.pressures != "corners":
        raise KeyError(mesh.kind)
    known = build_pressure_space(mesh)
    edge = float(np.cbrt(parts.w.sum() / len(mesh.cells)))
    at = 3 * len(mesh.points) + known.cells
    nodal = element_of(mesh.element.linear).shape(mesh.element.places())  # (a, b) pressure shape functions
    slopes = nodal.T @ parts.dNdX
    law, constraint = pair
    return PoroelasticSolid(
        mesh.cells, parts.dNdX, parts.w, law, constraint, 0.0, at, known.N, len(mesh.points), mu, edge,
        conservative=not turns, dNpdX=slopes, pores=pores, turns=turns,
    )  # fmt: skip
