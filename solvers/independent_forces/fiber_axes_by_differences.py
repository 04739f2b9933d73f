"""Independent stress of anisotropic materials: differences of the energy density in independently computed axes.

Directions are evaluated by the check's own quadrature; active muscle tension is S = T f (x) f, and active shortening is
evaluated by eigenvalues.
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
    """Return psi of F (n, 3, 3), Pa, with a material's axes (n, 3, 3) or (1, 3, 3), rows f, s and n, and K in Pa."""
    f, s = (axes[:, i] for i in (0, 1))
    columns = (*f.T, *s.T) if len(axes) > 1 else (*map(float, f[0]), *map(float, s[0]))
    new: dict[str, Any] = {"fibres": MaterialFrame(*columns), "bulk": bulk or None}
    if "sheets" in vars(material):
        new["sheets"] = None
    psi: Scalar = batch_constants(replace(material, **new)).psi
    return psi


def active_stress(tension: Floats, f: Floats) -> Stress:
    """Return the active stress that muscle tensions (n,) add to P of F (n, 3, 3), fibres f (n, 3) of any length: F T f
    (x) f.
    """
    unit = f / np.linalg.norm(f, axis=1, keepdims=True)
    S = tension[:, None, None] * unit[:, :, None] * unit[:, None, :]
    return lambda F: F @ S


def energy_with_shortening(psi: Scalar, s: Floats, f: Floats) -> Scalar:
    """Return the energy density of muscle, Pa, as a function of F (n, 3, 3), with active shortening along fibres.

    `f` (n, 3) are fibre directions, of any length, and `s` (n,) the fractions by which fibres are shorter at rest. The
    energy is psi(F Fa^-1): the active stretch Fa keeps the volume, and is found by its eigenvalues.
    """
    f = f / np.linalg.norm(f, axis=1, keepdims=True)
    dyads = f[:, :, None] * f[:, None, :]
    each = np.log1p(-s)[:, None, None] * (1.5 * dyads - 0.5 * EYE)  # without a trace: it keeps the volume
    values, vectors = np.linalg.eigh(each)
    back = (vectors * np.exp(-values)[:, None, :]) @ vectors.swapaxes(1, 2)
    return lambda F: psi(F @ back)


def split_off_pressure(material: Any, axes: Floats) -> SplitLaw:
    """Return law split for a pressure that replaces K (J - 1)^2 / 2 except a third, or half, of the shear modulus."""
    third, K = material.shear_modulus / 3.0, material.bulk
    kept = third if K is None else min(third, 0.5 * K)
    compliance = 0.0 if K is None else 1.0 / (K - kept)

    def swelling(F: Floats) -> Floats:
        return cofactor(F)[1] - 1.0

    stress = EnergyStress(energy_along_axes(material, axes, kept))
    return SplitLaw(stress, swelling, lambda F: cofactor(F)[0], swelling, compliance)


@dataclass(frozen=True)
class AnisotropicBody(CheckedBody):
    """A body of anisotropic material: `at` returns its stress at points (n, 3), m."""

    at: Callable[[Floats], Stress] | None = None

    def _rule(self, at: slice, centre: bool = False) -> tuple[Floats, Floats]:
        if self.rules is None or centre:
            return super()._rule(at, centre)
        return self.rules[0][at], self.rules[1][at]  # of linear tetrahedra too: what they have one of is the strain

    def _stress(self, cells: Ints, term: StressTerm, F: Floats, at: slice) -> tuple[Floats, Any]:
        if self.at is None:
            raise TypeError("a material without its directions")
        X = (shape_functions(self.kind, self._rule(at)[0]) @ self.points[cells]).reshape(-1, 3)
        return stress_with_error(self.at(X), F)
