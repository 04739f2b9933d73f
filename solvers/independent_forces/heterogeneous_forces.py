"""Independent forces of solids with spatially varying constants, evaluated at the quadrature points of the check.

The two moduli are means over the cell in two cases: in linear tetrahedra, whose gradients are uniform, and for a part
of the stress that is evaluated once per cell. The means use the quadrature rule of ten-node tetrahedra in the first
case, and that of the element in the second.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.independent_forces import solid_forces
from softmark.solvers.independent_forces.mixed_formulation_forces import MixedBody, SplitLaw, batch_constants, split_law
from softmark.solvers.independent_forces.solid_forces import CheckedBody, Floats, Ints, Stress, StressTerm
from softmark.solvers.independent_forces.stress_by_differences import (
    EnergyStress,
    PlaneStressLaw,
    Scalar,
    stress_with_error,
)
from softmark.solvers.materials.heterogeneous import with_constants

Constants = Callable[[Floats], tuple[Floats, Floats]]  # points (n, 3), m -> Young's modulus, Pa, and Poisson's ratio
Moduli = Callable[[Floats, Floats], Stress]  # mu and lam (n,), Pa -> stress as a function of F (n, 3, 3)


@dataclass(frozen=True)
class HeterogeneousTerm(StressTerm):
    """A part of the stress with spatially varying moduli; the function `of` makes it from mu and lam (n,), Pa."""

    of: Moduli | None = None


@dataclass(frozen=True)
class HeterogeneousBody(CheckedBody):
    """A deformed mesh with spatially varying constants.

    `constants` returns Young's modulus, Pa, and Poisson's ratio at points (n, 3), m.
    """

    constants: Constants | None = None

    def _stress(self, cells: Ints, term: StressTerm, F: Floats, at: slice) -> tuple[Floats, Any]:
        if not isinstance(term, HeterogeneousTerm) or term.of is None or self.constants is None:
            return super()._stress(cells, term, F, at)
        tetrahedra = len(solid_forces.node_positions(self.kind)) == 4
        kind = "tet10" if tetrahedra else self.kind
        xi, w = solid_forces.quadrature_rule(kind) if self.rules is None else (self.rules[0][at], self.rules[1][at])
        X = positions_in_cells(self.points, cells, self.kind, xi)
        E, nu = self.constants(X.reshape(-1, 3))
        mu, lam = (m.reshape(len(cells), -1) for m in lame_moduli(E, nu))
        if term.mean or tetrahedra:
            w = w if tetrahedra else w * solid_forces.gradients(self.points, cells, kind, xi)[1]
            w = w * X[..., 0] if self.depth else w  # of whole rings
            share = np.broadcast_to(w, mu.shape) / np.broadcast_to(w, mu.shape).sum(axis=1, keepdims=True)
            mu, lam = (mu * share).sum(axis=1), (lam * share).sum(axis=1)
        return stress_with_error(term.of(mu.ravel(), lam.ravel()), F)


@dataclass(frozen=True)
class HeterogeneousMixedBody(MixedBody):
    """A deformed mesh with pressure unknowns and varying constants.

    The function `apart` returns the split law at points (n, 3), m.
    """

    apart: Callable[[Floats], SplitLaw] | None = None

    def _split(self, some: slice) -> SplitLaw:
        if self.apart is None:
            return self.split
        X = positions_in_cells(self.points, self.cells[some], self.kind, self._rule(some)[0])
        return self.apart(X.reshape(-1, 3))


def positions_in_cells(points: Floats, cells: Ints, kind: str, xi: Floats) -> Floats:
    """Return the positions (m, q, 3), m, of the local points xi of cells.

    xi is (q, 3) for all cells, or (m, q, 3) for each.
    """
    found: Floats = solid_forces.shape_functions(kind, xi) @ points[cells]
    return found


def lame_moduli(E: Floats, nu: Floats) -> tuple[Floats, Floats]:
    """Return the Lame moduli mu and lam, Pa, from Young's modulus E, Pa, and Poisson's ratio nu."""
    return E / (2.0 * (1.0 + nu)), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))


def stress_terms(material: Any, strain: str, selective: bool) -> tuple[HeterogeneousTerm, ...] | None:
    """Return the parts of the stress of a law: one part, or the shear part and the remaining part if `selective`.

    Return None if the law has no finite-strain form, or cannot be split.
    """
    law: Moduli | None = {
        "small": solid_forces.small_strain_stress,
        "corotational": solid_forces.corotational_stress,
    }.get(strain)
    if law is None:
        return _finite_strain_terms(material, selective)
    if not selective:
        return (_make_heterogeneous_term(law),)
    known = law
    return _make_heterogeneous_term(lambda mu, lam: known(mu, 0.0 * lam)), _make_heterogeneous_term(
        lambda mu, lam: known(0.0 * mu, lam), mean=True
    )


def _make_heterogeneous_term(of: Moduli, mean: bool = False) -> HeterogeneousTerm:
    """Return the part of the stress that the function `of` makes from moduli; without moduli it cannot be evaluated."""

    def none(F: Floats) -> Floats:
        raise ValueError("the constants of the law vary in space, and their values were not given")

    return HeterogeneousTerm(none, mean, of)


def _finite_strain_terms(material: Any, selective: bool) -> tuple[HeterogeneousTerm, ...] | None:
    """Return the parts of the stress at finite strain, by differences of the energy.

    If `selective`, they are the shear part and the remaining part.
    """
    of = material.of if material.thin else material  # for a plate, the solid that it is made of
    if of.finite_law() is None or (selective and of.finite_parts() is None):
        return None

    def whole(mu: Floats, lam: Floats) -> Scalar:
        psi: Scalar = batch_constants(_with_moduli(of, mu, lam).finite_law()).psi
        return psi

    def shear(mu: Floats, lam: Floats) -> Scalar:
        psi: Scalar = batch_constants(_with_moduli(of, mu, lam).finite_parts()[0]).psi
        return psi

    def rest(mu: Floats, lam: Floats) -> Scalar:
        of_all, of_shear = whole(mu, lam), shear(mu, lam)
        return lambda F: of_all(F) - of_shear(F)

    if not selective:
        return (_make_heterogeneous_term(lambda mu, lam: EnergyStress(whole(mu, lam))),)
    return (
        _make_heterogeneous_term(lambda mu, lam: EnergyStress(shear(mu, lam))),
        _make_heterogeneous_term(lambda mu, lam: EnergyStress(rest(mu, lam)), mean=True),
    )


def _with_moduli(material: Any, mu: Floats, lam: Floats) -> Any:
    """Return the material with Lame moduli mu and lam (n,), Pa, at each point."""
    return assign_constants(material, mu * (3.0 * lam + 2.0 * mu) / (lam + mu), 0.5 * lam / (lam + mu))


def assign_constants(material: Any, young: Floats, poisson: Floats) -> Any:
    """Return the material with Young's modulus, Pa, and Poisson's ratio of each point (n,).

    A material whose constants cannot vary is returned unchanged.
    """
    if not {"young", "poisson"} <= {*material.varying}:
        return material
    return with_constants(material, {"young": young, "poisson": poisson})


def plane_stress_term(term: HeterogeneousTerm) -> HeterogeneousTerm:
    """Return the part of the stress for a plate with stress-free faces (plane stress)."""
    of = term.of
    return HeterogeneousTerm(
        term.stress, term.mean, None if of is None else lambda mu, lam: PlaneStressLaw(of(mu, lam))
    )


def split_at_points(material: Any, strain: str, constants: Constants) -> Callable[[Floats], SplitLaw]:
    """Return a function that returns the split law (`SplitLaw`) at points (n, 3), m."""

    def apart(X: Floats) -> SplitLaw:
        E, nu = constants(X)
        split = split_law(assign_constants(material, E, nu), strain, E, nu)
        if split is None:
            raise ValueError("this law cannot be split into isochoric and volumetric parts")
        return split

    return apart
