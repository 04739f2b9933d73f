"""What vouches for one material point: stress by finite differences of its energy, and nothing of its solver."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.models.material_point.imposed_deformation import driven
from softmark.interpreter.models.material_point.material_point_declaration import Homogeneous
from softmark.interpreter.models.postprocessing.nodal_forces import Wrench
from softmark.interpreter.problem.body_case import case_for
from softmark.interpreter.verification.by_model.solid_forces_check import LEFT
from softmark.interpreter.verification.by_model.verifier import Found, Voucher
from softmark.interpreter.verification.grid_convergence import HOPELESS
from softmark.interpreter.verification.probe_errors import ProbeAnswer, Unknown
from softmark.interpreter.verification.reaction_balance import summed
from softmark.interpreter.verification.solution_under_test import Answer
from softmark.interpreter.verification.unverified_models import Unchecked
from softmark.solvers.independent_forces import solid_forces
from softmark.solvers.independent_forces.solid_forces import Floats, ForceBalance
from softmark.solvers.independent_forces.stress_by_differences import EnergyStress
from softmark.solvers.materials import law_for, mixed_for
from softmark.solvers.mesh.shape import Prism


class Points(Voucher):
    """Of one material point: forces of corners from differences of the energy; it has no mesh to refine."""

    def facts(self, found: Found) -> dict[str, Any]:
        """The largest strain."""
        if found.solution.displacement is None:
            return {}
        return {"largest_strain": float(np.linalg.norm(_gradient(found) - np.eye(3), 2))}

    def balance(self, found: Found) -> tuple[ForceBalance, float | None]:
        """Forces at the corners by differences of the energy. Raises Unchecked."""
        inside, outside, held, noise, lacking = self._forces(found)
        return solid_forces.force_balance(inside, outside, held, noise, None, lacking), found.solution.facts.get(
            "residual"
        )

    def reactions(self, found: Found) -> tuple[dict[str, Wrench], float]:
        """By the same. Raises Unchecked."""
        inside, outside, _, noise, _ = self._forces(found)
        X = _corners(found)
        x = X if found.declared.thing.strain == "small" else X + found.solution.displacement(X)  # type: ignore[misc]
        left = np.hstack([inside - outside, np.zeros_like(inside)])
        return summed({s.name: _holds(found, s.thing) for s in found.case.supports}, left, x), LEFT * noise

    def _forces(self, found: Found) -> tuple[Floats, Floats, NDArray[np.bool_], float, float]:
        if Points not in found.known:
            found.known[Points] = _looked_at(found)
        known: tuple[Floats, Floats, NDArray[np.bool_], float, float] = found.known[Points]
        return known

    def discretisation(self, answer: Answer, seen: ProbeAnswer) -> float:
        """Nothing is discretised."""
        return 0.0

    def model(self, answer: Answer, seen: ProbeAnswer) -> float:
        """How far it is from the same with the law of its material. Raises Unknown."""
        thing: Homogeneous = answer.declared.thing
        if driven(answer.case, thing.state, answer.declared).let_go:
            raise Unknown("its supports hold a width that one material point lets go, and what that does is not known")
        if thing.state == "simple_shear":
            raise Unknown(
                "its sides are taken to be held as simple shear needs, and what they do otherwise is not known"
            )
        best = "corotational" if answer.own.material.finite_law() is None else "finite"
        if thing.strain == best:
            return 0.0
        other = replace(answer.declared, thing=thing.plain(strain=best))
        right = seen.of(answer.solved("best", other, case_for(answer.scene, other), slight=True)[0])
        if not (apart := right.apart(seen)) <= HOPELESS * right.size:
            raise Unknown("the best strain of its material leads to quite another state")
        return apart


def _looked_at(found: Found) -> tuple[Floats, Floats, NDArray[np.bool_], float, float]:
    """What stress and what loads do at the corners (8, 3), N; what is held; rounding, N; what a constraint lacks, N."""
    case = found.case
    F, X = _gradient(found), _corners(found)
    out = np.sign(X - X.mean(axis=0))
    areas = _areas(found)
    P, noise, off = _stress(found, F)
    inside = 0.25 * (out * areas) @ P.T
    outside = np.zeros_like(inside)
    for load in case.loads:
        on, t = _on(found, load.thing.action.where), np.array(load.thing.action.traction)
        for axis in range(3):
            for side in (-1.0, 1.0):
                face = out[:, axis] == side
                if on[face].all():
                    outside[face] += 0.25 * areas[axis] * t
    held = np.any([_holds(found, s.thing)[:, :3] for s in case.supports], axis=0)
    return inside, outside, held, noise * float(areas.max()), off * float(areas.max())


def _stress(found: Found, F: Floats) -> tuple[Floats, float, float]:
    """P (3, 3), Pa, by differences of the energy at F, its rounding, Pa, and what a constraint lacks, Pa.

    Of a solid that keeps its volume, the pressure is what leaves no stress on the sides that nothing holds. Raises
    Unchecked.
    """
    material, thing = found.case.material, found.declared.thing
    strain = thing.strain
    if not material.incompressible:
        P, noise = differences(law_for(material, strain).psi, F)
        return P, noise, 0.0
    split = mixed_for(material, strain)
    assert split is not None
    P, noise = differences(split.shape.psi, F)
    g, more = differences(split.constraint.value, F)
    made = driven(found.case, thing.state, found.declared)
    free = [a for a in range(3) if made.stretches[a] is None]
    if made.shear is not None:  # the side beside its plane is free
        free = [3 - made.shear[0] - made.shear[1]]
    pull = np.array([_pull(found, a) for a in free])
    n, t = g.diagonal()[free], P.diagonal()[free] - pull
    p = -float(n @ t) / float(n @ n)
    off = abs(float(split.constraint.value(F[None])[0]))
    return P + p * g, noise + abs(p) * more, float(np.abs(P).max()) * off


def differences(psi: Any, F: Floats) -> tuple[Floats, float]:
    """dpsi/dF (3, 3), Pa, by central differences, and their error, Pa. Raises Unchecked."""
    try:
        P, error = EnergyStress(psi).with_error(F[None])
    except ValueError as reason:
        raise Unchecked(str(reason)) from reason
    return P[0], float(error[0])


def _gradient(found: Found) -> Floats:
    """F (3, 3), from where the corners go."""
    assert found.solution.displacement is not None
    X = _corners(found)
    u = found.solution.displacement(X)
    near = X - X.mean(axis=0)
    slope: Floats = np.linalg.lstsq(near, u - u.mean(axis=0), rcond=None)[0].T
    return slope + np.eye(3)


def _corners(found: Found) -> Floats:
    """Of what the body spans (8, 3), m."""
    assert found.case.shape.bounds is not None
    low, high = found.case.shape.bounds
    return np.array([[(low, high)[i][0], (low, high)[j][1], (low, high)[k][2]] for i in (0, 1) for j in (0, 1)
                     for k in (0, 1)])  # fmt: skip


def _areas(found: Found) -> Floats:
    """Of the faces (3,), m^2: the section of a straight body, and of its sides what its volume needs."""
    shape, lengths = found.case.shape, np.ptp(_corners(found), axis=0)
    assert isinstance(shape, Prism)
    volume = shape.section.area * shape.length
    areas: Floats = volume / lengths
    return areas


def _on(found: Found, where: Any) -> NDArray[np.bool_]:
    """Which of the corners a condition selects (8,)."""
    X = _corners(found)
    extent = float(np.linalg.norm(np.ptp(X, axis=0)))
    return np.array([where.holds(*x, extent) for x in X.tolist()], dtype=np.bool_)


def _holds(found: Found, thing: Any) -> NDArray[np.bool_]:
    """What a support holds of the corners (8, 6): of whole faces that it selects."""
    mask = np.zeros((8, 6), dtype=np.bool_)
    mask[np.ix_(np.flatnonzero(_on(found, thing.where)), list(thing.components))] = True
    return mask


def _pull(found: Found, axis: int) -> float:
    """The nominal stress that loads leave on a free axis, Pa."""
    X, total = _corners(found), 0.0
    for load in found.case.loads:
        on, traction = _on(found, load.thing.action.where), load.thing.action.traction
        for side, level in ((-1.0, X[:, axis].min()), (1.0, X[:, axis].max())):
            if on[X[:, axis] == level].all():
                total += side * float(traction[axis])
    return total


VOUCHER = Points()
