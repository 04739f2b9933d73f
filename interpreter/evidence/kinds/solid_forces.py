"""Forces of finite elements found again by formulas that share nothing with those that solved."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.evidence.load_check import Unchecked, loads_on
from softmark.interpreter.evidence.materials import INWARD, alone
from softmark.interpreter.evidence.reaction_check import summed
from softmark.interpreter.models.answers.carried import Wrench
from softmark.interpreter.models.fem.words import Fem
from softmark.interpreter.models.shared.prepared import Moved
from softmark.interpreter.problem.case import Case
from softmark.solvers.checks import solids
from softmark.solvers.checks.pressures import Pressed, split_of
from softmark.solvers.checks.solids import CheckedBody, ForceBalance, StressTerm
from softmark.solvers.elements import ELEMENTS

LEFT = 50.0  # times the estimate of what rounding leaves


def balance_of(model: Fem, case: Case, mesh: Moved | None) -> ForceBalance:
    """The forces of finite elements found again. Raises Unchecked."""
    if mesh is None or mesh.kind not in ELEMENTS:
        raise Unchecked(f"there is no other formula for {model.element}")
    u = np.asarray(mesh.displacement, dtype=np.float64)
    chosen, _ = solids.sample(len(mesh.points), mesh.cells, len(solids.rule(mesh.kind)[1]))
    inside, lacking, noise = np.zeros_like(mesh.points), 0.0, 0.0
    if model.formulation != "displacement":
        chosen = None
        for own, which in alone(case, mesh):
            f, less, left = pressed(model, own, mesh, which).forces()
            inside, lacking, noise = inside + f, float(np.hypot(lacking, less)), noise + left
    else:
        near = _near(chosen, mesh)
        for own, which in alone(case, mesh):
            terms, stiff = terms_of(model, own)
            cells = mesh.cells[which] if near is None else mesh.cells[which][near[which]]
            body = CheckedBody(mesh.points, cells, mesh.kind, u, terms, stiff, turned=model.rotation == "element")
            f, left = body.forces(cells)
            inside, noise = inside + f, noise + left
    outside, unsure = loads_on(case, mesh, u, model.strain == "small", model.mass)
    return solids.balance(inside, outside, held(case, mesh), noise + unsure / LEFT, chosen, lacking)


def reactions_of(model: Fem, case: Case, mesh: Moved) -> tuple[dict[str, Wrench], float]:
    """What every support does, from the cells around what it holds, and what rounding leaves, N. Raises Unchecked."""
    u = np.asarray(mesh.displacement, dtype=np.float64)
    near = _near(np.flatnonzero(held(case, mesh).any(axis=1)), mesh)
    inside, noise = np.zeros_like(mesh.points), 0.0
    for own, which in alone(case, mesh):
        if model.formulation != "displacement":
            f, _, left = pressed(model, own, mesh, which).forces()
        else:
            terms, stiff = terms_of(model, own)
            cells = mesh.cells[which][near[which]]
            body = CheckedBody(mesh.points, cells, mesh.kind, u, terms, stiff, turned=model.rotation == "element")
            f, left = body.forces(cells)
        inside, noise = inside + f, noise + left
    small = model.strain == "small"
    outside, unsure = loads_on(case, mesh, u, small, model.mass)
    x = mesh.points if small else mesh.points + u
    return by_support(case, mesh, inside - outside, x), LEFT * noise + unsure


def by_support(case: Case, mesh: Moved, left: NDArray[np.float64], x: NDArray[np.float64]) -> dict[str, Wrench]:
    """Of what is left (n, 3) at nodes x (n, 3): what each support of a mesh has."""
    masks = {}
    for support in case.supports:
        own = held(replace(case, supports=(support,)), mesh)
        masks[support.name] = np.hstack([own, np.zeros_like(own)])
    return summed(masks, np.hstack([left, np.zeros_like(left)]), x)


def _near(chosen: Any, mesh: Moved) -> Any:
    """Which cells touch chosen nodes (m,); None where all nodes are looked at."""
    if chosen is None:
        return None
    mask = np.zeros(len(mesh.points), dtype=np.bool_)
    mask[chosen] = True
    return mask[mesh.cells].any(axis=1)


def pressed(model: Fem, case: Case, mesh: Moved, which: Any = slice(None)) -> Pressed:
    """The solid of a formulation with pressures, deformed: of `which` cells, of one material. Raises Unchecked."""
    E, nu = case.material.young, case.material.poisson
    split = split_of(case.material, model.strain, E, nu)
    if split is None:
        raise Unchecked(f"there is no other formula for a {type(case.material).__name__} with pressures")
    u, own = np.asarray(mesh.displacement, dtype=np.float64), None
    if model.formulation == "mixed":
        if mesh.pressures is None:
            raise Unchecked("its pressures are not known")
        own = mesh.pressures[which]
    elif model.formulation != "mean_dilatation":
        raise Unchecked(f"there is no other formula for formulation = {model.formulation}")
    return Pressed(mesh.points, mesh.cells[which], mesh.kind, u, split, E / (2.0 * (1.0 + nu)), own)


def terms_of(model: Fem, case: Case) -> tuple[tuple[StressTerm, ...], float]:
    """The parts of the stress of a model, and its stiffest modulus, Pa. Raises Unchecked."""
    E, nu = case.material.young, case.material.poisson
    mu, lam = E / (2.0 * (1.0 + nu)), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    stiff = 6.0 * mu + 9.0 * abs(lam)
    if model.integration not in ("full", "selective"):
        raise Unchecked(f"there is no other formula for {model.integration} integration")
    selective, strain = model.integration == "selective", "small" if model.rotation == "element" else model.strain
    if strain == "finite":
        return _finite_terms(case.material, selective), stiff
    law = solids.small_stress if strain == "small" else solids.corotational_stress
    if selective:
        return (StressTerm(law(mu, 0.0)), StressTerm(law(0.0, lam), centre=True)), stiff
    return (StressTerm(law(mu, lam)),), stiff


def _finite_terms(material: Any, selective: bool) -> tuple[StressTerm, ...]:
    parts = material.finite_parts() if selective else None
    if parts is not None:
        return StressTerm(parts[0].P), StressTerm(parts[1].P, centre=True)
    return (StressTerm(material.finite_law().P),)


def held(case: Case, mesh: Moved) -> NDArray[np.bool_]:
    """Which degrees of freedom supports hold (n, 3): of the nodes that they select, and of whole cells and facets.

    Cells and facets are taken as selected where all their corners are, seen from a little inside: a selection without
    its border holds up to it.
    """
    points = mesh.points
    found = np.zeros(points.shape, dtype=np.bool_)
    extent = float(np.sqrt((np.ptp(points, axis=0) ** 2).sum()))
    for support in case.supports:
        where = np.array(np.broadcast_to(support.thing.where.holds(*points.T, extent), len(points)))
        for nodes in (mesh.cells, mesh.mesh.facets):
            corners = points[nodes]
            X = corners + INWARD * (corners.mean(axis=1, keepdims=True) - corners)
            inside = np.broadcast_to(support.thing.where.holds(*np.moveaxis(X, 2, 0), extent), nodes.shape)
            where[nodes[inside.all(axis=1)]] = True
        for c in support.thing.components:
            found[:, c] |= where
    return found
