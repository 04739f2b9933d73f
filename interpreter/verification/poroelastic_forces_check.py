"""Independent forces and fluid balance of porous solids (solvers/independent_forces/poroelastic_equations.py)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from softmark.interpreter.models.shared.prepared_model import DeformedMesh
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.mesh_group_conditions import facet_membership, split_by_groups
from softmark.interpreter.verification.cell_materials_check import INWARD
from softmark.interpreter.verification.unverified_model_error import NoIndependentFormula
from softmark.solvers.independent_forces.poroelastic_equations import PoroelasticBody
from softmark.solvers.independent_forces.solid_forces import EPS, Floats

IMPOSED = 1e-9  # relative to the largest pressure: rounding of prescribed values


def drained_case(case: Case) -> Case:
    """Return the case with the drained skeleton as its material."""
    return replace(case, other_material=case.material.law)


def fluid_forces(case: Case, mesh: DeformedMesh, u: Floats, small: bool) -> tuple[Floats, float, float]:
    """Return nodal forces of the fluid (n, 3), N, the residual of the fluid balance, N, and the rounding, N.

    The residual, a volume, is converted to a force by the shear modulus and the edge length of a mean cell. Raises
    NoIndependentFormula.
    """
    past: Any = getattr(mesh, "past", None)
    if past is None or mesh.pressures is None:
        raise NoIndependentFormula("the deformation history is not known")
    k0, n, M, s = (getattr(case.material, f) for f in ("permeability", "exponent", "stiffening", "solid"))

    def permeable(J: Floats) -> Floats:
        found: Floats = k0 * ((J - s) / (1.0 - s)) ** n * np.exp(M * (J * J - 1.0) / 2.0)
        return found

    own = PoroelasticBody(mesh.points, mesh.cells, mesh.kind, -mesh.pressures, permeable, small, case.depth)
    f, noise = own.forces(u)
    try:
        amiss = own.stage_residual(past.times, past.states)
    except ValueError as reason:
        raise NoIndependentFormula(str(reason)) from reason
    amiss[nodes_with_pressure(case, mesh)] = 0.0
    whole = mesh.mesh.volumes
    other = _prescribed_pressure_error(case, mesh) * float(np.cbrt(whole.mean())) ** 2
    unit = case.material.shear_modulus / float(np.cbrt(whole.mean()))
    around = 2.0 * np.pi * float(np.abs(mesh.points[:, 0]).max()) / case.depth if case.depth else 1.0
    stages = 12.0  # subtracted volumes, each with rounding
    noise += stages * EPS * unit * around * float(np.linalg.norm(whole))
    return f, float(np.hypot(unit * np.linalg.norm(amiss), other)), noise


def _prescribed_pressure_error(case: Case, mesh: DeformedMesh) -> float:
    """Return the deviation from prescribed fluid pressures, Pa: a norm over nodes, 0 within rounding."""
    p, found = np.zeros(len(mesh.points)), 0.0
    pressures = -np.asarray(mesh.pressures)
    p[mesh.cells[:, : pressures.shape[1]]] = pressures
    corner = np.zeros(len(p), dtype=np.bool_)
    corner[mesh.cells[:, : pressures.shape[1]]] = True
    size = float(np.abs(p).max(initial=0.0))
    for drain in case.drains:
        where = nodes_with_pressure(replace(case, drains=(drain,)), mesh) & corner  # shared nodes belong to the first
        own = p[where] - drain.thing.pressure
        corner &= ~where
        if float(np.abs(own).max(initial=0.0)) > IMPOSED * size:
            found = float(np.hypot(found, np.linalg.norm(own)))
    return found


def nodes_with_pressure(case: Case, mesh: DeformedMesh) -> Any:
    """Return a mask (n,) of the nodes with a prescribed pressure, which are those of the facets that a support selects.

    A facet is selected if all its corners satisfy the condition of the support, at their positions or moved slightly
    inward. Moving them inward helps if the condition excludes its border; it does not help on a curved side.
    """
    points, facets = mesh.points, mesh.mesh.facets
    found = np.zeros(len(points), dtype=np.bool_)
    extent = float(np.sqrt((np.ptp(points, axis=0) ** 2).sum()))
    for drain in case.drains:
        for condition, which in split_by_groups(drain.thing.where, facet_membership(mesh.mesh)):
            X = points[facets[which]]
            for part in (0.0, INWARD):
                x, y, z = np.moveaxis(X + part * (X.mean(axis=1, keepdims=True) - X), 2, 0)
                inside = np.broadcast_to(condition.holds(x, y, z, extent), x.shape)
                found[facets[which][inside.all(axis=1)]] = True
    return found
