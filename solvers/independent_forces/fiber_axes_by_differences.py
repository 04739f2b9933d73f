"""Independent stress of anisotropic materials, by differences of the energy in independently computed axes.

Material directions are evaluated at the quadrature points of the independent forces. Active muscle tension is S = T f
(x) f, and active shortening is evaluated by eigenvalues.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.independent_forces.mixed_formulation_forces import SplitLaw, batch_constants
from softmark.solvers.independent_forces.solid_forces import (
    CheckedBody,
    Floats,
    Ints,
    Stress,
    StressTerm,
    cofactor,
    shape_functions,
)
from softmark.solvers.independent_forces.stress_by_differences import EnergyStress, Scalar, stress_with_error
from softmark.solvers.materials.material_axes import MaterialFrame

Axes = Callable[[Floats], Floats]  # of points (n, 3), m: rows f, s and f x s (n, 3, 3)
EYE = np.eye(3)


def energy_along_axes(material: Any, axes: Floats, bulk: float | None) -> Scalar:
    """Return the energy density psi(F), Pa, of a material with given axes, as a function of F (n, 3, 3).

    The rows of `axes`, (n, 3, 3) or (1, 3, 3), are f, s and n. `bulk` is the bulk modulus, Pa; None or 0 omits its
    term.
    """
    f, s = (axes[:, i] for i in (0, 1))
    columns = (*f.T, *s.T) if len(axes) > 1 else (*map(float, f[0]), *map(float, s[0]))
    new: dict[str, Any] = {"fibres": MaterialFrame(*columns), "bulk": bulk or None}
    if "sheets" in vars(material):
        new["sheets"] = None
    psi: Scalar = batch_constants(replace(material, **new)).psi
    return psi


def active_stress(tension: Floats, f: Floats) -> Stress:
    """Return the active stress of muscle P = F T f (x) f, Pa, as a function of F (n, 3, 3).

    `tension` (n,), Pa, is T, and f (n, 3) are fibre directions of any length, which are normalised.
    """
    unit = f / np.linalg.norm(f, axis=1, keepdims=True)
    S = tension[:, None, None] * unit[:, :, None] * unit[:, None, :]
    return lambda F: F @ S


def energy_with_shortening(psi: Scalar, s: Floats, f: Floats) -> Scalar:
    """Return the energy density psi(F Fa^-1), Pa, of muscle with active shortening, as a function of F (n, 3, 3).

    `f` (n, 3) are fibre directions, of any length, and `s` (n,) the fractions by which fibres are shorter at rest. The
    active stretch Fa preserves the volume, and is found by its eigenvalues.
    """
    f = f / np.linalg.norm(f, axis=1, keepdims=True)
    dyads = f[:, :, None] * f[:, None, :]
    each = np.log1p(-s)[:, None, None] * (1.5 * dyads - 0.5 * EYE)  # without a trace: it keeps the volume
    values, vectors = np.linalg.eigh(each)
    back = (vectors * np.exp(-values)[:, None, :]) @ vectors.swapaxes(1, 2)
    return lambda F: psi(F @ back)


def split_off_pressure(material: Any, axes: Floats) -> SplitLaw:
    """Return the law of a mixed formulation: without the part of K (J - 1)^2 / 2 that a pressure replaces.

    A bulk modulus of a third of the shear modulus, or K / 2 if that is less, stays in the law.
    """
    third, K = material.shear_modulus / 3.0, material.bulk
    kept = third if K is None else min(third, 0.5 * K)
    compliance = 0.0 if K is None else 1.0 / (K - kept)

    def swelling(F: Floats) -> Floats:
        return cofactor(F)[1] - 1.0

    stress = EnergyStress(energy_along_axes(material, axes, kept))
    return SplitLaw(stress, swelling, lambda F: cofactor(F)[0], swelling, compliance)


@dataclass(frozen=True)
class AnisotropicBody(CheckedBody):
    """A deformed mesh of anisotropic material; `at` returns the stress law at points (n, 3), m."""

    at: Callable[[Floats], Stress] | None = None

    def _rule(self, at: slice, centre: bool = False) -> tuple[Floats, Floats]:
        if self.rules is None or centre:
            return super()._rule(at, centre)
        return self.rules[0][at], self.rules[1][at]  # linear tetrahedra too: only their strain is uniform

    def _stress(self, cells: Ints, term: StressTerm, F: Floats, at: slice) -> tuple[Floats, Any]:
        if self.at is None:
            raise TypeError("a material without its directions")
        X = (shape_functions(self.kind, self._rule(at)[0]) @ self.points[cells]).reshape(-1, 3)
        return stress_with_error(self.at(X), F)
