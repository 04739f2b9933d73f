"""Elastic energies of finite strain whose tangent can take a pressure from where the last Newton step was to lead.

In nearly incompressible cells a Newton step that turns them leaves volumes wrong to second order and so, times a large
bulk modulus, pressures wrong altogether; the tangent there is useless. The pressure that the linear equations of the
step promised is far nearer to that of the solution. Taking it is Newton's method for displacements and pressures as
unknowns of their own, with the pressures eliminated point by point; forces, and so the solution, are the same.
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
    add_cross,
    cofactor,
    components,
    determinant,
    inner,
    trace,
    write_symmetric,
)
from softmark.solvers.materials.volumetric_constraints import CorotationalDilatation

NEAR = 0.01  # of the volume of a cell: how far apart U' is looked at for U''


@dataclass(frozen=True)
class MixedPoints(Elastic):
    """`Elastic` with `volume`, the part U(det F) of its law, and the U' that is `expected` at each point (m q,), Pa.

    The tangent's term U' d(cof F)/dF is taken with the expected U'; without one it is that of `Elastic`. Source: the
    mixed integration point method of Magisano, Leonetti and Garcea (2017), "How to improve efficiency and robustness of
    the Newton method in geometrically non-linear structural problems", of which this is the volumetric part.
    """

    volume: ElasticLaw = field(kw_only=True)
    expected: Floats | None = None

    def expecting(self, x: Floats, d: Floats) -> MixedPoints:
        """The same energy with the pressures that a step d from x promises: U' + U'' cof F : dF."""
        f, h = components(self.F(x)), components(self.F(d))
        cof = cofactor(f)
        J = determinant(f, cof)
        grown = (inner(cof, h) - trace(cof)) / J  # cof F : dF over J, dF = h - I
        return replace(self, expected=self._slope(J) + self._rise(J) * grown)

    def corotated(self, x: Floats) -> MixedPoints:
        """The same energy with the pressures of its corotational twin in x: lam tr(S - I), F = R S."""
        F = self.F(x)
        f = components(F)
        stretched = inner(rotation(f), f) - 3.0
        lam = self._rise(np.ones(len(F) if self.varies else 1, dtype=F.dtype))
        return replace(self, expected=lam * stretched)

    def _rise(self, J: Floats) -> Floats:
        """J U''(J) (n,), Pa, by differences."""
        return (self._slope((1.0 + NEAR) * J) - self._slope((1.0 - NEAR) * J)) / (2.0 * NEAR)

    def _slope(self, J: Floats) -> Floats:
        """U'(J) (n,), Pa: of the pure dilatation of that volume, P = U' J^(2/3) I."""
        if isinstance(self.volume, InvariantLaw):
            with np.errstate(all="ignore"):
                return self.volume.slopes(np.zeros_like(J), J - 1.0)[1]
        stretch = np.cbrt(J)
        P = self.volume.P(stretch[:, None, None] * np.eye(3, dtype=J.dtype))
        slope: Floats = P[:, 0, 0] / stretch**2
        return slope

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Tangent stiffness, N/m; where a pressure is expected, with it. A projected one knows of none."""
        if self.expected is None or projected:
            Elastic.add_hessian(self, x, data, slots, scale, projected)
            return
        if self._of_invariants:
            f = components(self.F(x))
            more = self.expected - self._slope(determinant(f, cofactor(f)))
            self._add_invariant_hessian(x, data, slots, scale, more.reshape(self.w.shape))
            return
        Elastic.add_hessian(self, x, data, slots, scale)
        F = self.F(x)
        f, more = components(F), self.expected - self._slope(np.linalg.det(F))
        H = np.zeros((9, 9, len(F)), dtype=F.dtype)
        add_cross(H, f * more)
        A = np.empty((len(F), 3, 3, 3, 3), dtype=F.dtype)
        write_symmetric(H, A)
        self.add_moduli(A, slice(None), data, slots, scale)


@dataclass(frozen=True)
class Slack(Energy):
    """Corotational tetrahedra whose tangent takes no pressure at all, tr(S - I) = 0 in every cell."""

    tets: CorotationalTets

    @property
    def conservative(self) -> bool:
        """As the cells are."""
        return self.tets.conservative

    @property
    def stencils(self) -> Ints:
        """Those of the cells."""
        return self.tets.stencils

    def value(self, x: Floats) -> float:
        """Strain energy, J."""
        return self.tets.value(x)

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Nodal elastic forces, N."""
        self.tets.add_gradient(x, g, scale)

    def rounding(self, x: Floats) -> float:
        """Norm of what rounding leaves in the gradient, N."""
        return self.tets.rounding(x)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Tangent stiffness, N/m."""
        none = np.zeros(self.tets.kept)
        self.tets.add_both_lagged(x, np.zeros_like(x), data, slots, none)


def slack(assembly: Assembly) -> Assembly:
    """The assembly whose tangent takes no pressure: for a state of which only the shape is to be trusted."""
    return assembly.with_internal([_slack(e) for e in assembly.internal])


def _slack(energy: Energy) -> Energy:
    if isinstance(energy, EnergySum):
        return replace(energy, parts=tuple(_slack(part) for part in energy.parts))
    if isinstance(energy, CorotationalTets):
        return Slack(energy)
    if isinstance(energy, MeanDilatation):
        return energy.slack()
    if isinstance(energy, MixedPoints):
        return replace(energy, expected=np.zeros(energy.w.size, dtype=energy.w.dtype))
    return energy


def promised(assembly: Assembly, x: Floats, d: Floats | None) -> Assembly | None:
    """The assembly with the pressures that a step d from x promises, or without a step those of its corotational twin.

    None where no energy of it can use them.
    """
    if not any(_mixed(e) for e in assembly.internal):
        return None
    return assembly.with_internal([_expecting(e, x, d) for e in assembly.internal])


def _mixed(energy: Energy) -> bool:
    if isinstance(energy, EnergySum):
        return any(_mixed(part) for part in energy.parts)
    return isinstance(energy, MixedPoints | MeanDilatation)


def _expecting(energy: Energy, x: Floats, d: Floats | None) -> Energy:
    if isinstance(energy, EnergySum):
        return replace(energy, parts=tuple(_expecting(part, x, d) for part in energy.parts))
    if not isinstance(energy, MixedPoints | MeanDilatation):
        return energy
    if d is not None:
        return energy.expecting(x, d)
    return energy.under(CorotationalDilatation(), x) if isinstance(energy, MeanDilatation) else energy.corotated(x)


def volumetric(law: ElasticLaw) -> bool:
    """Whether a law knows of det F alone: with no stress at rest it then has none in shear, which keeps volumes."""
    F = np.eye(3)[None].copy()
    F[0, 0, 1], F[0, 2, 0] = 0.5, -0.3
    return bool(np.all(np.abs(law.P(F)) <= 1e-12 * np.abs(law.dPdF(np.eye(3)[None])).max()))
