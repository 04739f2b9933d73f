"""The watchdog: what a model says it found is looked at once more before it becomes a result.

Forces of a state of rest are found again by formulas that share nothing with those that solved
(solvers/checks/solids.py); a state whose forces do not balance as well as the solver says is no answer. Cells inside
out are counted, and nothing that is not a finite number is let through.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.evidence.load_check import Unchecked, loads_on
from softmark.interpreter.language.scene import Declared, Scene
from softmark.interpreter.models.beam.words import Beam6Dof, station
from softmark.interpreter.models.fem.words import Fem
from softmark.interpreter.models.shared.prepared import Solution
from softmark.interpreter.models.springs.words import MassSpring
from softmark.interpreter.problem.case import Case, case_for
from softmark.interpreter.problem.stretches import coverage
from softmark.interpreter.results.report import ModelResult, clean
from softmark.interpreter.vocabulary.analyses import Dynamic
from softmark.interpreter.vocabulary.loads import Gravity, PointForce, Traction
from softmark.records import dataclass
from softmark.solvers.checks import solids
from softmark.solvers.checks.pressures import Pressed, split_of
from softmark.solvers.checks.rods import Rod, frames
from softmark.solvers.checks.solids import Balance, Body, Floats, Term
from softmark.solvers.elements import ELEMENTS

AGREES = 2.0  # times what the solver claims
LEFT = 50.0  # times the estimate of what rounding leaves
SEEN = 0.005  # of a value: differences that three digits show
INWARD = 1e-6  # of the way to its centroid: where a cell is looked at, so that its border is not


def watched(scene: Scene, declared: Declared, case: Case, prepared: Any, solution: Solution) -> Solution:
    """A solution with `checks` among its facts; one that does not stand up to them is `failed`."""
    facts = clean(solution.facts)
    solution = replace(solution, facts=facts)
    if solution.displacement is None:
        return solution
    if (reason := _not_finite(solution)) is not None:
        return _refused(solution, reason)
    try:
        with np.errstate(all="ignore"):
            found, reason = _checked(scene, declared, case, prepared, solution)
    except Exception as error:  # a check that fails says nothing of the solution
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        found, reason = {"residual": None, "reason": f"the check stopped: {type(error).__name__}: {error}"}, None
    facts = facts | {"checks": clean(found)}
    if reason is not None:
        return _refused(replace(solution, facts=facts), reason)
    notes = (*solution.notes, *_folded(declared, solution, found), *_unseen(declared, found))
    return replace(solution, facts=facts, notes=notes)


def _refused(solution: Solution, reason: str) -> Solution:
    return Solution("failed", reason, solution.facts, notes=solution.notes)


# ------------------------------------------------------------------ numbers


def _not_finite(solution: Solution) -> str | None:
    """Which numbers of a solution are not finite, in words."""
    mesh, history = solution.mesh, solution.history
    if mesh is not None and not solids.finite([np.asarray(mesh.displacement)]):
        return "the displacements are not finite numbers"
    if mesh is not None and getattr(mesh, "frames", None) is not None and not solids.finite([mesh.frames]):
        return "the displacements on the way are not finite numbers"
    if mesh is not None and getattr(mesh, "pressures", None) is not None and not solids.finite([mesh.pressures]):
        return "the pressures are not finite numbers"
    if history is None:
        return None
    if not solids.finite([np.asarray(history.times), np.asarray(history.step_s), np.asarray(history.step_cpu_s)]):
        return "the times of the motion are not finite numbers"
    if not solids.finite([np.asarray(e) for e in history.energies.values()]):
        return "the energies of the motion are not finite numbers"
    return None


def loose(scene: Scene, models: Mapping[str, ModelResult]) -> list[Diagnostic]:
    """A warning where the analysis is solved less well than what is read from it."""
    if not (analyses := list(scene.of_kind("analysis").values())):
        return []
    analysis, tolerance = analyses[0], analyses[0].thing.tolerance
    for name, metric in scene.of_kind("metric").items():
        found = (m.metrics.get(name) for m in models.values() if m.status == "converged")
        values = sorted(m.value for m in found if m is not None and m.value is not None)
        if metric.thing.unit != "1" or getattr(metric.thing, "against", None) is None:
            continue
        gaps = (b - a for a, b in pairwise(values) if b - a > SEEN * abs(b))
        if (least := min(gaps, default=math.inf)) <= tolerance:
            return [_loose(analysis, f"tell models apart that differ by {100 * least:.2g} % in `{name}`")]
        if values and values[0] <= tolerance:
            return [_loose(analysis, f"vouch for an error of {100 * values[0]:.2g} % in `{name}`")]
    return []


def _loose(analysis: Declared, what: str) -> Diagnostic:
    at = analysis.at("tolerance")
    return Diagnostic(
        "W352",
        f"a tolerance of {analysis.thing.tolerance:.0e} cannot {what}",
        at.source,
        at.span,
        "solved less well than it is read",
        "use a tolerance well below the differences that matter; the usual one is 1e-8",
    )


# ------------------------------------------------------------------ checks


def _checked(
    scene: Scene, declared: Declared, case: Case, prepared: Any, solution: Solution
) -> tuple[dict[str, Any], str | None]:
    """What the report says of the checks, and why the solution is no answer, if it is none."""
    found = _cells(solution) | _fibres(declared.thing, case, solution) | _kept(declared.thing, case, solution)
    found |= {n: v for n, v in (solution.facts.get("energy") or {}).items() if n in ("drift", "gained")}
    if isinstance(case.analysis, Dynamic):
        return found, None
    try:
        result, claimed = _rebalanced(scene, declared, case, prepared, solution)
    except Unchecked as reason:
        return {"residual": None, "reason": str(reason), **found}, None
    found = {"residual": result.residual, "rounding": result.rounding, "nodes": result.nodes, **found}
    if not math.isfinite(result.residual):
        return found, "the forces of its solution are not finite numbers"
    # what meets the tolerance is what was asked for, however much better the solver thought it was
    allowed = max(AGREES * (claimed or 0.0), case.analysis.tolerance) + LEFT * result.rounding
    if claimed is None or result.residual <= allowed:
        return found, None
    problem = (
        f"its forces do not balance: found again by other formulas, {result.residual:.1e} of the loads is left, where "
        f"the solver says {claimed:.1e}"
    )
    return found, problem


def _cells(solution: Solution) -> dict[str, Any]:
    """Cells that are inside out, and the least volume ratio, at integration points and nodes of each."""
    mesh = solution.mesh
    if mesh is None or getattr(mesh, "cells", None) is None or mesh.kind not in ELEMENTS:
        return {}
    body = Body(mesh.points, mesh.cells, mesh.kind, np.asarray(mesh.displacement, dtype=np.float64), (), 0.0)
    least, strain = body.volumes()
    return {
        "inverted": int((~(least > 0.0)).sum()), "of_cells": len(least), "worst_J": float(least.min()),
        "largest_strain": float(strain.max()),
    }  # fmt: skip


def _fibres(model: Any, case: Case, solution: Solution) -> dict[str, Any]:
    """The largest strain of a beam: of the outermost fibre, with shear."""
    if not isinstance(model, Beam6Dof) or solution.displacement is None:
        return {}
    rod, arm = _Beam(model, case, np.array(model.stations(case))).rod(solution.displacement)
    u, v = (max(abs(p[i]) for p in case.shape.section.samples()) for i in (0, 1))
    bent, stretched = rod.strain(np.array([arm, v, u]))
    flat = rod.curvatures[:, 1 if v <= u else 2]  # about the axis along the wider side
    return {
        "largest_strain": bent + stretched, "bending_strain": bent, "axial_strain": stretched,
        "flat_curvature_per_m": float(np.abs(flat).max()),
    }  # fmt: skip


def _kept(model: Any, case: Case, solution: Solution) -> dict[str, Any]:
    """Of a solid that cannot change its volume: by how much a cell does, and the whole."""
    if not isinstance(model, Fem) or solution.mesh is None or case.material.poisson < 0.5:
        return {}
    try:
        most, whole = pressed(model, case, solution.mesh).grown()
    except Unchecked:  # the balance of forces says why
        return {}
    return {"volume": most, "body_volume": whole}


def _folded(declared: Declared, solution: Solution, found: Mapping[str, Any]) -> Iterator[Diagnostic]:
    """A warning where cells are inside out, unless the model said so itself."""
    if not found.get("inverted") or any(note.code == "W324" for note in solution.notes):
        return
    at = declared.at()
    yield Diagnostic(
        "W351",
        f"`{declared.name}` has {found['inverted']} of {found['of_cells']} cells inside out",
        at.source,
        at.span,
        "folded",
        "matter cannot do that; near those cells the displacements are those of no solid",
    )


def _unseen(declared: Declared, found: Mapping[str, Any]) -> Iterator[Diagnostic]:
    """A warning where forces should have been found again and were not, for whatever reason."""
    if found.get("residual", 0.0) is not None:
        return
    at = declared.at()
    yield Diagnostic(
        "W353",
        f"the forces of `{declared.name}` were not found again: {found['reason']}",
        at.source,
        at.span,
        "not checked by other formulas",
        "its answer stands on the word of its solver alone; compare it with another model",
    )


def _rebalanced(
    scene: Scene, declared: Declared, case: Case, prepared: Any, solution: Solution
) -> tuple[Balance, float | None]:
    """The balance of forces found again, and what the solver claims of it. Raises Unchecked."""
    claimed = solution.facts.get("residual")
    if isinstance(declared.thing, Fem):
        return _solid(declared.thing, case, solution.mesh), claimed
    if isinstance(declared.thing, MassSpring):
        return _springs(case, prepared, solution.mesh), claimed
    if isinstance(declared.thing, Beam6Dof):
        return _beam(declared.thing, case, solution), claimed
    full = scene.declared.get(getattr(declared.thing, "of", ""))
    if full is None or not isinstance(full.thing, Fem):
        raise Unchecked("there is no other formula for this model")
    reduced = solution.facts.get("reduced") or {}
    return _solid(full.thing, case_for(scene, full), solution.mesh), reduced.get("full_residual")


def _solid(model: Fem, case: Case, mesh: Any) -> Balance:
    if mesh is None or mesh.kind not in ELEMENTS:
        raise Unchecked(f"there is no other formula for {model.element}")
    u = np.asarray(mesh.displacement, dtype=np.float64)
    if model.formulation != "displacement":
        inside, lacking, noise = pressed(model, case, mesh).forces()
        outside, unsure = loads_on(case, mesh, u, model.strain == "small", model.mass)
        return solids.balance(inside, outside, held(case, mesh), noise + unsure / LEFT, lacking=lacking)
    terms, stiff = terms_of(model, case)
    body = Body(mesh.points, mesh.cells, mesh.kind, u, terms, stiff, turned=model.rotation == "element")
    chosen, cells = solids.sample(len(mesh.points), mesh.cells, len(solids.rule(mesh.kind)[1]))
    inside, noise = body.forces(cells)
    outside, unsure = loads_on(case, mesh, u, model.strain == "small", model.mass)
    return solids.balance(inside, outside, held(case, mesh), noise + unsure / LEFT, chosen)


def pressed(model: Fem, case: Case, mesh: Any) -> Pressed:
    """The solid of a formulation with pressures, deformed. Raises Unchecked."""
    E, nu = case.material.young, case.material.poisson
    split = split_of(case.material, model.strain, E, nu)
    if split is None:
        raise Unchecked(f"there is no other formula for a {type(case.material).__name__} with pressures")
    u, own = np.asarray(mesh.displacement, dtype=np.float64), None
    if model.formulation == "mixed":
        if (own := getattr(mesh, "pressures", None)) is None:
            raise Unchecked("its pressures are not known")
    elif model.formulation != "mean_dilatation":
        raise Unchecked(f"there is no other formula for formulation = {model.formulation}")
    return Pressed(mesh.points, mesh.cells, mesh.kind, u, split, E / (2.0 * (1.0 + nu)), own)


def terms_of(model: Fem, case: Case) -> tuple[tuple[Term, ...], float]:
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
        return (Term(law(mu, 0.0)), Term(law(0.0, lam), centre=True)), stiff
    return (Term(law(mu, lam)),), stiff


def _finite_terms(material: Any, selective: bool) -> tuple[Term, ...]:
    parts = material.finite_parts() if selective else None
    if parts is not None:
        return Term(parts[0].P), Term(parts[1].P, centre=True)
    return (Term(material.finite_law().P),)


def _springs(case: Case, prepared: Any, mesh: Any) -> Balance:
    springs = getattr(prepared, "springs", None)
    if springs is None:
        raise Unchecked("its springs are not known")
    u = np.asarray(mesh.displacement, dtype=np.float64)
    inside, noise = solids.spring_forces(mesh.points, springs.edges, springs.k, u)
    outside, unsure = loads_on(case, mesh, u, False, "lumped")
    return solids.balance(inside, outside, held(case, mesh), noise + unsure / LEFT, None)


# ------------------------------------------------------------------ supports of solids


def held(case: Case, mesh: Any) -> NDArray[np.bool_]:
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


# ------------------------------------------------------------------ beams


@dataclass(frozen=True)
class _Beam:
    """What of a beam model is known without its solver."""

    model: Beam6Dof
    case: Case
    s: Floats  # stations (n,), m

    @property
    def axes(self) -> Floats:
        """e1, e2, e3 at rest (3, 3), as rows."""
        from softmark.solvers.mesh.shapes import transverse

        return np.array([self.case.shape.axis, *transverse(self.case.shape.axis)])

    @property
    def stiffness(self) -> Floats:
        """EA, GA2, GA3, GJ, EI2, EI3."""
        section, material = self.case.shape.section, self.case.material
        E, G = material.young, material.young / (2.0 * (1.0 + material.poisson))
        shear = section.shear_factor(material.poisson) * G * section.area
        return np.array([E * section.area, shear, shear, G * section.torsion, *(E * I for I in section.moments)])

    def rod(self, displacement: Any) -> tuple[Rod, float]:
        """The deformed rod, from displacements of points on and beside its axis, and how far beside."""
        shape = self.case.shape
        arm = max(max(abs(u), abs(v)) for u, v in shape.section.samples())
        X = np.array(shape.root) + self.s[:, None] * self.axes[0]
        beside = X[:, None] + arm * self.axes[1:]
        x = X + displacement(X)
        tips = (beside + displacement(beside.reshape(-1, 3)).reshape(beside.shape)) - x[:, None]
        rigid = (() if self.model.axial else (0,)) + (() if self.model.shear else (1, 2))
        return Rod(x, frames(tips, arm * self.axes[1:]), np.diff(self.s), self.stiffness, rigid), arm

    def loads(self) -> Floats:
        """Forces at the nodes (n, 3), N. Raises Unchecked."""
        shape, f, l = self.case.shape, np.zeros((len(self.s), 3)), np.diff(self.s)
        for load in self.case.loads:
            match load.thing:
                case Gravity(magnitude=g, direction=direction):
                    w = self.case.material.density * shape.section.area * g * np.array(direction)
                    f[:-1] += 0.5 * l[:, None] * w
                    f[1:] += 0.5 * l[:, None] * w
                case Traction(where=where, vector=vector):
                    end = 0 if coverage(where, shape, 0.0) == "all" else -1
                    f[end] += shape.section.area * np.array(vector)
                case PointForce(at=at, vector=vector):
                    s = station(self.case, at) or 0.0
                    for node in range(len(self.s)):
                        f[node] += np.interp(s, self.s, np.eye(len(self.s))[node]) * np.array(vector)
                case _:
                    raise Unchecked(f"there is no other formula for `{load.name}`")
        return f

    def held(self) -> NDArray[np.bool_]:
        """Forces and moments that supports carry (n, 6); of a partly held section, all moments."""
        found = np.zeros((len(self.s), 6), dtype=np.bool_)
        for support in self.case.supports:
            for node, s in enumerate(self.s.tolist()):
                if coverage(support.thing.where, self.case.shape, s) == "all":
                    found[node, [*support.thing.components, 3, 4, 5]] = True
        return found


def _beam(model: Beam6Dof, case: Case, solution: Solution) -> Balance:
    beam = _Beam(model, case, np.array(model.stations(case)))
    if solution.displacement is None or (len(beam.s) > 200 and not (model.shear and model.axial)):
        raise Unchecked("constraints of so many elements are not looked at again")
    rod, arm = beam.rod(solution.displacement)
    inside, by = rod.forces()
    outside, fixed = np.zeros_like(inside), beam.held()
    outside[:, :3] = beam.loads()
    scale = np.array([1.0, 1.0, 1.0, *[1.0 / case.shape.length] * 3])
    inside, by = inside * scale, by * scale[:, None, None]
    if rod.rigid:
        inside = inside + _carried(inside - outside, by, fixed)
    noise = rod.rounding(arm)
    result = solids.balance(inside[:, :3], outside[:, :3], fixed[:, :3], noise, None)
    whole = solids.balance(inside, outside, fixed, noise, None)
    return whole if whole.residual >= result.residual else result


def _carried(left: Floats, by: Floats, fixed: NDArray[np.bool_]) -> Floats:
    """What constraints carry (n, 6): what of it balances the free nodes best."""
    B = by.reshape(left.size, -1)
    free = ~fixed.ravel()
    best, *_ = np.linalg.lstsq(B[free], -left.ravel()[free], rcond=None)
    return (B @ best).reshape(left.shape)
