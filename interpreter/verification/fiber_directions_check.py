"""Independent formulas for materials with fibres: fibre directions, and bodies whose nodal forces can be computed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from softmark.interpreter.language.spatial_profiles import DirectionProfile
from softmark.interpreter.models.shared.material_regions import stiffness_points
from softmark.interpreter.models.shared.prepared_model import DeformedMesh
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.verification.cell_materials_check import split_by_material
from softmark.interpreter.verification.heterogeneous_constants_check import constant_values
from softmark.interpreter.verification.unverified_model_error import NoIndependentFormula
from softmark.interpreter.vocabulary.fiber_words import Helix
from softmark.solvers.independent_forces import fiber_axes_by_differences
from softmark.solvers.independent_forces.heterogeneous_forces import HeterogeneousMixedBody
from softmark.solvers.independent_forces.mixed_formulation_forces import MixedBody, SplitLaw, split_law
from softmark.solvers.independent_forces.solid_forces import CheckedBody, Floats, Stress, StressTerm
from softmark.solvers.independent_forces.stress_by_differences import EnergyStress
from softmark.solvers.materials.active_strain import ActiveStrain

HALVINGS = 60


def fiber_vectors(direction: Any, X: Floats) -> tuple[Floats, Floats | None]:
    """Return fibre directions (n, 3) at points X (n, 3), m, not normalised, and sheet normals or None.

    Raises NoIndependentFormula.
    """
    match direction:
        case Helix():
            return helix_vectors(direction, X)
        case DirectionProfile(components=parts):
            return np.stack([constant_values(part, X) for part in parts], axis=1), None
        case tuple():
            return np.broadcast_to(np.array(direction, dtype=float), X.shape), None
    raise NoIndependentFormula(
        f"no independent formula is available for fibre directions of the type {type(direction).__name__}"
    )


def helix_vectors(rule: Helix, X: Floats) -> tuple[Floats, Floats]:
    """Return fibre directions (n, 3) of a helix rule at points X (n, 3), m, and the normals of its ellipsoids (n, 3).

    The fibres are tangents of x = (a(t) sin u cos v, a(t) sin u sin v, b(t) cos u), at an angle to the direction of v.
    """
    e3 = np.array(rule.axis)
    e1 = np.cross(e3, np.eye(3)[np.argmin(np.abs(e3))])
    e1 /= np.linalg.norm(e1)
    Q = np.stack([e1, np.cross(e3, e1), e3])  # rows: the axes of the ellipsoids
    x, y, z = Q @ (X - np.array(rule.origin)).T
    low, high = np.full(len(X), -0.5), np.full(len(X), 1.5)
    for _ in range(HALVINGS):
        t = 0.5 * (low + high)
        a = rule.inner + t * (rule.outer - rule.inner)
        b = rule.inner_along + t * (rule.outer_along - rule.inner_along)
        inside = (x**2 + y**2) / a**2 + z**2 / b**2 < 1.0
        low, high = np.where(inside, low, t), np.where(inside, t, high)
    u, v = np.arctan2(np.hypot(x, y) / a, z / b), np.arctan2(y, x)
    by_u = np.stack([a * np.cos(u) * np.cos(v), a * np.cos(u) * np.sin(v), -b * np.sin(u)], axis=1)
    by_v = np.stack([-np.sin(v), np.cos(v), 0.0 * v], axis=1)
    up = -by_u / np.linalg.norm(by_u, axis=1, keepdims=True)  # u is 0 at the apex
    angle = (rule.endo + np.clip(t, 0.0, 1.0) * (rule.epi - rule.endo))[:, None]
    return (np.cos(angle) * by_v + np.sin(angle) * up) @ Q, np.cross(by_v, up) @ Q


def axes_of(law: Any) -> fiber_axes_by_differences.Axes:
    """Return a function from points to material axes: the fibre, across it in the sheet, and normal to both.

    Raises NoIndependentFormula.
    """

    def axes(X: Floats) -> Floats:
        f, known = fiber_vectors(law.fibres, X)
        s = known if law.sheets is None else fiber_vectors(law.sheets, X)[0]
        f = f / np.linalg.norm(f, axis=1, keepdims=True)
        if s is None:  # arbitrary sheet direction
            s = np.cross(f, np.eye(3)[np.argmin(np.abs(f), axis=1)])
        n = np.cross(f, s)
        n /= np.linalg.norm(n, axis=1, keepdims=True)
        return np.stack([f, np.cross(n, f), n], axis=1)

    return axes


TERM = (StressTerm(lambda F: F),)  # for bodies that compute their own stress


def body_of(case: Case, points: Floats, cells: Any, kind: str, u: Floats, rules: Any = None) -> CheckedBody:
    """Return the deformed body of cells of one material with fibres, from which nodal forces are computed.

    `u` (n, 3), m, are nodal displacements. `rules` are local points (m, q, 3) and weights (m, q) of each cell, if
    they differ from those of the element. Raises NoIndependentFormula.
    """
    if isinstance(case.material, ActiveStrain):
        return _active_strain_body(case, points, cells, kind, u, rules)
    material: Any = case.material
    axes = axes_of(material)
    stiff = 6.0 * material.shear_modulus + 9.0 * abs(material.lame_lambda)

    def at(X: Floats) -> Stress:
        return EnergyStress(fiber_axes_by_differences.energy_along_axes(material, axes(X), material.bulk))

    return fiber_axes_by_differences.AnisotropicBody(points, cells, kind, u, TERM, stiff, False, case.depth, rules, at)


def mixed_body_of(
    case: Case, points: Floats, cells: Any, kind: str, u: Floats, pressures: Floats | None, rules: Any = None
) -> MixedBody:
    """Return the deformed body of cells with fibres in mixed formulation, with nodal `pressures`, Pa.

    Raises NoIndependentFormula.
    """
    if isinstance(case.material, ActiveStrain):
        return _active_strain_mixed_body(case, points, cells, kind, u, pressures, rules)
    material: Any = case.material
    axes, mu = axes_of(material), material.shear_modulus
    anywhere = fiber_axes_by_differences.split_off_pressure(material, np.eye(3)[None])
    return HeterogeneousMixedBody(
        points, cells, kind, u, anywhere, mu, pressures, case.depth, rules,
        apart=lambda X: fiber_axes_by_differences.split_off_pressure(material, axes(X)),
    )  # fmt: skip


def _active_strain_body(case: Case, points: Floats, cells: Any, kind: str, u: Floats, rules: Any) -> CheckedBody:
    """Return the deformed body of cells of muscle with active strain.

    Its stress is the stress of the passive law, pulled back by the active strain. Raises NoIndependentFormula.
    """
    muscle: Any = case.material
    law = muscle.law

    def at(X: Floats) -> Stress:
        psi = (
            fiber_axes_by_differences.energy_along_axes(law, axes_of(law)(X), law.bulk)
            if _has_fiber_directions(law)
            else law.finite_law().psi
        )
        return EnergyStress(
            fiber_axes_by_differences.energy_with_shortening(
                psi, constant_values(muscle.shortening, X), fiber_vectors(muscle.fibres, X)[0]
            )
        )

    stiff = 6.0 * law.shear_modulus + 9.0 * abs(law.lame_lambda)
    return fiber_axes_by_differences.AnisotropicBody(points, cells, kind, u, TERM, stiff, False, case.depth, rules, at)


def _active_strain_mixed_body(
    case: Case, points: Floats, cells: Any, kind: str, u: Floats, pressures: Floats | None, rules: Any
) -> MixedBody:
    """Return the deformed body of cells of muscle with active strain in mixed formulation. Raises NoIndependentFormula.

    Active strain preserves the volume, so the pressures are not changed.
    """
    muscle: Any = case.material
    law = muscle.law
    plain = None if _has_fiber_directions(law) else split_law(law, "finite", law.young, law.poisson)
    if plain is None and not _has_fiber_directions(law):
        raise NoIndependentFormula(
            f"the material {type(law).__name__} cannot be split into isochoric and volumetric parts"
        )

    def apart(X: Floats) -> SplitLaw:
        split = fiber_axes_by_differences.split_off_pressure(law, axes_of(law)(X)) if plain is None else plain
        of: Any = split.shape
        psi = fiber_axes_by_differences.energy_with_shortening(
            of.psi, constant_values(muscle.shortening, X), fiber_vectors(muscle.fibres, X)[0]
        )
        return replace(split, shape=EnergyStress(psi))

    some = plain or fiber_axes_by_differences.split_off_pressure(law, np.eye(3)[None])
    return HeterogeneousMixedBody(
        points, cells, kind, u, some, law.shear_modulus, pressures, case.depth, rules, apart=apart
    )


def _has_fiber_directions(law: Any) -> bool:
    return bool(getattr(law, "directed", False))


def passive_case(case: Case) -> Case:
    """Return the case with the passive law of a muscle in place of the active one; other cases are unchanged."""
    return replace(case, other_material=case.material.passive) if getattr(case.material, "pulls", False) else case


def muscle_forces(case: Case, mesh: DeformedMesh, u: Floats) -> Floats:
    """Return the nodal forces (n, 3), N, of muscle tension, which counts as a load because it grows with the loads."""
    found = np.zeros_like(mesh.points)
    for own, which in split_by_material(case, mesh):
        muscle = own.material
        if getattr(muscle, "pulls", False):
            cells, at = mesh.cells[which], _muscle_stress(muscle)
            most = float(abs(constant_values(muscle.tension, mesh.points[cells].reshape(-1, 3))).max(initial=0.0))
            rules = stiffness_points(own, mesh.mesh, which, False)
            body = fiber_axes_by_differences.AnisotropicBody(
                mesh.points, cells, mesh.kind, u, TERM, most, False, case.depth, rules, at
            )
            found -= body.forces(cells)[0]
    return found


def _muscle_stress(muscle: Any) -> Callable[[Floats], Stress]:
    """Return a function that gives the stress of muscle tension at points."""
    return lambda X: fiber_axes_by_differences.active_stress(
        constant_values(muscle.tension, X), fiber_vectors(muscle.fibres, X)[0]
    )
