"""Pressure predictor: finite-strain energies whose tangent uses the pressure predicted by the last Newton step.

In nearly incompressible cells a Newton step with rotation leaves volume errors of second order. Multiplied by a large
bulk modulus, these errors make the pressures completely wrong, and the tangent useless. The pressure predicted by the
linear equations of the step is far closer to the solution. Using it is Newton's method with displacements and pressures
as independent unknowns, with the pressures eliminated at each point. Forces, and so the solution, are the same.
"""

from __future__ import annotations

from dataclasses import field, replace

import numpy as np

from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.corotational_tets import CorotationalTets
from softmark.solvers.energies.elastic_energy import Elastic, ElasticLaw, EnergySum, InvariantLaw
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.mixed_displacement_pressure import MeanDilatation
from softmark.solvers.materials.polar_decomposition import rotation
from softmark.solvers.materials.tensor_components import (
    add_tensor_cross_product,
    cofactor,
    components,
    determinant,
    inner,
    trace,
    write_symmetric,
)
from softmark.solvers.materials.volumetric_constraints import CorotationalDilatation

NEAR = 0.01  # relative to the volume: step of the difference quotient of U' for U''


@dataclass(frozen=True)
class ElasticWithGivenPressures(Elastic):
    """`Elastic` energy whose tangent can use given pressures at its n integration points.

    `volume` is the volumetric part U(det F) of the law. `expected` (n,), Pa, are the given pressures U'. The term U'
    d(cof F)/dF of the tangent uses them; if they are None, the tangent is that of `Elastic`.
    Source: the mixed integration point method of Magisano, Leonetti and Garcea (2017), "How to improve efficiency and
    robustness of the Newton method in geometrically non-linear structural problems", here its volumetric part.
    """

    volume: ElasticLaw = field(kw_only=True)
    expected: Floats | None = None

    def with_predicted_pressures(self, x: Floats, d: Floats) -> ElasticWithGivenPressures:
        """Return the energy with the pressures U' + U'' cof F : dF that a step d from x predicts."""
        f, h = components(self.F(x)), components(self.F(d))
        cof = cofactor(f)
        J = determinant(f, cof)
        grown = (inner(cof, h) - trace(cof)) / J  # cof F : dF over J, dF = h - I
        return replace(self, expected=self._volumetric_pressure(J) + self._volumetric_stiffness(J) * grown)

    def with_corotational_pressures(self, x: Floats) -> ElasticWithGivenPressures:
        """Return the energy with the pressures of a corotational law at x: lam tr(S - I), with F = R S."""
        F = self.F(x)
        f = components(F)
        stretched = inner(rotation(f), f) - 3.0
        lam = self._volumetric_stiffness(np.ones(len(F) if self.has_varying_constants else 1, dtype=F.dtype))
        return replace(self, expected=lam * stretched)

    def _volumetric_stiffness(self, J: Floats) -> Floats:
        """Return J U''(J) (n,), Pa, at volume ratios J (n,), by differences of U'."""
        return (self._volumetric_pressure((1.0 + NEAR) * J) - self._volumetric_pressure((1.0 - NEAR) * J)) / (
            2.0 * NEAR
        )

    def _volumetric_pressure(self, J: Floats) -> Floats:
        """Return U'(J) (n,), Pa, at volume ratios J (n,).

        It follows from the stress P = U' J^(2/3) I of a pure dilatation.
        """
        if isinstance(self.volume, InvariantLaw):
            with np.errstate(all="ignore"):
                return self.volume.slopes(np.zeros_like(J), J - 1.0)[1]
        stretch = np.cbrt(J)
        P = self.volume.P(stretch[:, None, None] * np.eye(3, dtype=J.dtype))
        slope: Floats = P[:, 0, 0] / stretch**2
        return slope

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent stiffness, N/m; it uses the given pressures, if any, unless it is `projected`."""
        if self.expected is None or projected:
            Elastic.add_hessian(self, x, data, slots, scale, projected)
            return
        if self._has_invariant_law:
            f = components(self.F(x))
            more = self.expected - self._volumetric_pressure(determinant(f, cofactor(f)))
            self._add_invariant_hessian(x, data, slots, scale, more.reshape(self.w.shape))
            return
        Elastic.add_hessian(self, x, data, slots, scale)
        F = self.F(x)
        f, more = components(F), self.expected - self._volumetric_pressure(np.linalg.det(F))
        H = np.zeros((9, 9, len(F)), dtype=F.dtype)
        add_tensor_cross_product(H, f * more)
        A = np.empty((len(F), 3, 3, 3, 3), dtype=F.dtype)
        write_symmetric(H, A)
        self.add_moduli(A, slice(None), data, slots, scale)


@dataclass(frozen=True)
class EnergyWithoutPressure(Energy):
    """Energy of corotational tetrahedra whose tangent assumes zero pressure: tr(S - I) = 0 in every cell."""

    tets: CorotationalTets

    @property
    def conservative(self) -> bool:
        """True if the energy of the cells is conservative."""
        return self.tets.conservative

    @property
    def stencils(self) -> Ints:
        """Degrees of freedom of the cells."""
        return self.tets.stencils

    def value(self, x: Floats) -> float:
        """Return the strain energy, J."""
        return self.tets.value(x)

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the nodal elastic forces, N."""
        self.tets.add_gradient(x, g, scale)

    def rounding(self, x: Floats) -> float:
        """Return the norm of the rounding error of the gradient, N."""
        return self.tets.rounding(x)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent stiffness, N/m."""
        none = np.zeros(self.tets.lagged_size)
        self.tets.add_both_lagged(x, np.zeros_like(x), data, slots, none)


def with_zero_pressures(assembly: Assembly) -> Assembly:
    """Return the assembly with a tangent for zero pressures, for states whose pressures are not reliable."""
    return assembly.with_internal([_zero_pressure_energy(e) for e in assembly.internal])


def _zero_pressure_energy(energy: Energy) -> Energy:
    """Return an energy with a tangent for zero pressures; unchanged if its tangent needs no pressures."""
    if isinstance(energy, EnergySum):
        return replace(energy, parts=tuple(_zero_pressure_energy(part) for part in energy.parts))
    if isinstance(energy, CorotationalTets):
        return EnergyWithoutPressure(energy)
    if isinstance(energy, MeanDilatation):
        return energy.without_pressure_stress()
    if isinstance(energy, ElasticWithGivenPressures):
        return replace(energy, expected=np.zeros(energy.w.size, dtype=energy.w.dtype))
    return energy


def with_predicted_pressures(assembly: Assembly, x: Floats, d: Floats | None) -> Assembly | None:
    """Return the assembly with a tangent that uses the pressures predicted by a step d from x.

    If d is None, it uses the pressures of a corotational law at x. Return None if no energy of the assembly can use
    predicted pressures.
    """
    if not any(_can_use_pressures(e) for e in assembly.internal):
        return None
    return assembly.with_internal([_energy_with_predicted_pressures(e, x, d) for e in assembly.internal])


def _can_use_pressures(energy: Energy) -> bool:
    """Return whether an energy can use predicted pressures."""
    if isinstance(energy, EnergySum):
        return any(_can_use_pressures(part) for part in energy.parts)
    return isinstance(energy, ElasticWithGivenPressures | MeanDilatation)


def _energy_with_predicted_pressures(energy: Energy, x: Floats, d: Floats | None) -> Energy:
    """Return an energy whose tangent uses predicted pressures (see `with_predicted_pressures`)."""
    if isinstance(energy, EnergySum):
        return replace(energy, parts=tuple(_energy_with_predicted_pressures(part, x, d) for part in energy.parts))
    if not isinstance(energy, ElasticWithGivenPressures | MeanDilatation):
        return energy
    if d is not None:
        return energy.with_predicted_pressures(x, d)
    return (
        energy.with_constraint_pressures(CorotationalDilatation(), x)
        if isinstance(energy, MeanDilatation)
        else energy.with_corotational_pressures(x)
    )


def is_volumetric(law: ElasticLaw) -> bool:
    """Return whether a law depends only on det F.

    The test is that the stress is zero at rest and in a volume-preserving deformation.
    """
    F = np.eye(3)[None].copy()
    F[0, 0, 1], F[0, 2, 0] = 0.5, -0.3
    return bool(np.all(np.abs(law.P(F)) <= 1e-12 * np.abs(law.dPdF(np.eye(3)[None])).max()))
