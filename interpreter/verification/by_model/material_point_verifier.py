"""Verifier of a single material point, whose stress it computes by finite differences of the energy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.models.material_point.imposed_deformation import imposed_state
from softmark.interpreter.models.material_point.material_point_declaration import Homogeneous
from softmark.interpreter.models.postprocessing.nodal_forces import Wrench
from softmark.interpreter.problem.body_case import case_for
from softmark.interpreter.verification.by_model.solid_forces_check import LEFT
from softmark.interpreter.verification.by_model.verifier import VerifiedSolution, Verifier
from softmark.interpreter.verification.grid_convergence import HOPELESS
from softmark.interpreter.verification.probe_errors import NoErrorEstimate, ProbeResultUnderTest
from softmark.interpreter.verification.reaction_balance import sum_by_support
from softmark.interpreter.verification.solution_under_test import SolutionUnderTest
from softmark.interpreter.verification.unverified_model_error import NoIndependentFormula
from softmark.solvers.independent_forces import solid_forces
from softmark.solvers.independent_forces.solid_forces import Floats, ForceBalance
from softmark.solvers.independent_forces.stress_by_differences import EnergyStress
from softmark.solvers.materials import law_for, mixed_for
from softmark.solvers.mesh.shape import Prism


class MaterialPointVerifier(Verifier):
    """Verifier of a single material point: corner forces by finite differences of the energy, and no mesh to refine."""

    def facts(self, found: VerifiedSolution) -> dict[str, Any]:
        """Return the report entry `largest_strain`: the spectral norm of F - I, with F the deformation gradient."""
        if found.solution.displacement is None:
            return {}
        return {"largest_strain": float(np.linalg.norm(_gradient(found) - np.eye(3), 2))}

    def balance(self, found: VerifiedSolution) -> tuple[ForceBalance, float | None]:
        """Compute the balance of corner forces by finite differences of the energy. Raises NoIndependentFormula."""
        inside, outside, held, noise, lacking = self._forces(found)
        return solid_forces.force_balance(inside, outside, held, noise, None, lacking), found.solution.facts.get(
            "residual"
        )

    def reactions(self, found: VerifiedSolution) -> tuple[dict[str, Wrench], float]:
        """Compute the reactions of supports by finite differences of the energy. Raises NoIndependentFormula."""
        inside, outside, _, noise, _ = self._forces(found)
        X = _corners(found)
        x = X if found.declared.thing.strain == "small" else X + found.solution.displacement(X)  # type: ignore[misc]
        left = np.hstack([inside - outside, np.zeros_like(inside)])
        return sum_by_support(
            {s.name: _held_corner_components(found, s.thing) for s in found.case.supports}, left, x
        ), LEFT * noise

    def _forces(self, found: VerifiedSolution) -> tuple[Floats, Floats, NDArray[np.bool_], float, float]:
        if MaterialPointVerifier not in found.known:
            found.known[MaterialPointVerifier] = _corner_forces_with_errors(found)
        known: tuple[Floats, Floats, NDArray[np.bool_], float, float] = found.known[MaterialPointVerifier]
        return known

    def discretisation(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> float:
        """Return zero, because a single material point is not discretised."""
        return 0.0

    def model(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> float:
        """Return the difference from a material point with its most accurate strain measure. Raises NoErrorEstimate."""
        thing: Homogeneous = answer.declared.thing
        if imposed_state(answer.case, thing.state, answer.declared).let_go:
            raise NoErrorEstimate(
                "the supports prevent lateral contraction, which a material point leaves free; the size of this effect "
                "is unknown"
            )
        if thing.state == "simple_shear":
            raise NoErrorEstimate(
                "a material point in simple shear ignores the conditions on the sides of the body; the size of this "
                "effect is unknown"
            )
        best = "corotational" if answer.own.material.finite_law() is None else "finite"
        if thing.strain == best:
            return 0.0
        other = replace(answer.declared, thing=thing.plain(strain=best))
        right = seen.of(answer.solve_other_model("best", other, case_for(answer.scene, other), slight=True)[0])
        if not (apart := right.apart(seen)) <= HOPELESS * right.size:
            raise NoErrorEstimate("the most accurate strain measure for its material gives a very different solution")
        return apart


def _corner_forces_with_errors(found: VerifiedSolution) -> tuple[Floats, Floats, NDArray[np.bool_], float, float]:
    """Return corner forces of the stress and of the loads (8, 3), N, a mask of held components, and two errors, N.

    The errors are the rounding error and the error of the volume constraint.
    """
    case = found.case
    F, X = _gradient(found), _corners(found)
    out = np.sign(X - X.mean(axis=0))
    areas = _areas(found)
    P, noise, off = _stress_with_errors(found, F)
    inside = 0.25 * (out * areas) @ P.T
    outside = np.zeros_like(inside)
    for load in case.loads:
        on, t = _selected_corners(found, load.thing.action.where), np.array(load.thing.action.traction)
        for axis in range(3):
            for side in (-1.0, 1.0):
                face = out[:, axis] == side
                if on[face].all():
                    outside[face] += 0.25 * areas[axis] * t
    held = np.any([_held_corner_components(found, s.thing)[:, :3] for s in case.supports], axis=0)
    return inside, outside, held, noise * float(areas.max()), off * float(areas.max())


def _stress_with_errors(found: VerifiedSolution, F: Floats) -> tuple[Floats, float, float]:
    """Return the stress P (3, 3), Pa, its rounding error, Pa, and its error due to the volume constraint, Pa.

    P is the derivative of the energy at F by finite differences. For an incompressible solid, the pressure is the one
    that leaves the free sides with the stress of their loads only. Raises NoIndependentFormula.
    """
    material, thing = found.case.material, found.declared.thing
    strain = thing.strain
    if not material.incompressible:
        P, noise = differentiate_energy(law_for(material, strain).psi, F)
        return P, noise, 0.0
    split = mixed_for(material, strain)
    assert split is not None
    P, noise = differentiate_energy(split.shape.psi, F)
    g, more = differentiate_energy(split.constraint.value, F)
    made = imposed_state(found.case, thing.state, found.declared)
    free = [a for a in range(3) if made.stretches[a] is None]
    if made.shear is not None:  # the side beside its plane is free
        free = [3 - made.shear[0] - made.shear[1]]
    pull = np.array([_applied_stress(found, a) for a in free])
    n, t = g.diagonal()[free], P.diagonal()[free] - pull
    p = -float(n @ t) / float(n @ n)
    off = abs(float(split.constraint.value(F[None])[0]))
    return P + p * g, noise + abs(p) * more, float(np.abs(P).max()) * off


def differentiate_energy(psi: Any, F: Floats) -> tuple[Floats, float]:
    """Return dpsi/dF (3, 3), Pa, by central differences, and their error, Pa. Raises NoIndependentFormula."""
    try:
        P, error = EnergyStress(psi).with_error(F[None])
    except ValueError as reason:
        raise NoIndependentFormula(str(reason)) from reason
    return P[0], float(error[0])


def _gradient(found: VerifiedSolution) -> Floats:
    """Return the deformation gradient F (3, 3), from the displacements of the corners."""
    assert found.solution.displacement is not None
    X = _corners(found)
    u = found.solution.displacement(X)
    near = X - X.mean(axis=0)
    slope: Floats = np.linalg.lstsq(near, u - u.mean(axis=0), rcond=None)[0].T
    return slope + np.eye(3)


def _corners(found: VerifiedSolution) -> Floats:
    """Return the corners of the body's bounding box (8, 3), m."""
    assert found.case.shape.bounds is not None
    low, high = found.case.shape.bounds
    return np.array([[(low, high)[i][0], (low, high)[j][1], (low, high)[k][2]] for i in (0, 1) for j in (0, 1)
                     for k in (0, 1)])  # fmt: skip


def _areas(found: VerifiedSolution) -> Floats:
    """Return the face areas (3,), m^2: the cross-section of a straight body, and side areas that match its volume."""
    shape, lengths = found.case.shape, np.ptp(_corners(found), axis=0)
    assert isinstance(shape, Prism)
    volume = shape.section.area * shape.length
    areas: Floats = volume / lengths
    return areas


def _selected_corners(found: VerifiedSolution, where: Any) -> NDArray[np.bool_]:
    """Return a mask of the corners that a condition selects (8,)."""
    X = _corners(found)
    extent = float(np.linalg.norm(np.ptp(X, axis=0)))
    return np.array([where.holds(*x, extent) for x in X.tolist()], dtype=np.bool_)


def _held_corner_components(found: VerifiedSolution, thing: Any) -> NDArray[np.bool_]:
    """Return a mask of the components that a support holds at the corners (8, 6), on faces that it selects wholly."""
    mask = np.zeros((8, 6), dtype=np.bool_)
    mask[np.ix_(np.flatnonzero(_selected_corners(found, thing.where)), list(thing.components))] = True
    return mask


def _applied_stress(found: VerifiedSolution, axis: int) -> float:
    """Return the nominal stress, Pa, that loads apply along a free axis."""
    X, total = _corners(found), 0.0
    for load in found.case.loads:
        on, traction = _selected_corners(found, load.thing.action.where), load.thing.action.traction
        for side, level in ((-1.0, X[:, axis].min()), (1.0, X[:, axis].max())):
            if on[X[:, axis] == level].all():
                total += side * float(traction[axis])
    return total


VERIFIER = MaterialPointVerifier()
