"""Poroelastic energy of one time step, and the pore-fluid state that is carried from step to step.

If solid and fluid are incompressible, the fluid that leaves a point equals the volume lost there. Over a step of
duration `span`, int N_b (J - 1) dV + span int grad N_b . K grad p dV = owed_b for every pressure shape function N_b,
with K = J F^-1 k F^-T and p positive in compression. With -p for the pressure of `MixedSolid` this is the second
equation of its saddle-point problem, where span K acts as a compliance. At span = 0 the solid is incompressible.

Time steps use the two-stage method SDIRK2 (Alexander 1977, "Diagonally implicit Runge-Kutta methods for stiff ODEs").
It is second-order and L-stable, so that high modes excited by a jump vanish after a few steps.
"""

from __future__ import annotations

from dataclasses import field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.local_blocks import add_blocks
from softmark.solvers.energies.mixed_displacement_pressure import MixedSolid
from softmark.solvers.energies.viscoelastic_memory import EnergyHistory

INNER = 1.0 - 0.5**0.5  # end of the first stage as a fraction of the step; also the implicit weight of both stages
AFTER = (1.0 - INNER) / INNER
SEEN = 1e-3  # fraction of all volume moved, below which an instantaneous outflow is ignored
ROUNDED = 1e-15  # fraction of the body volume: rounding error of deformation gradients
SOLVED = 1e-12  # fraction of that volume, times pressure / shear modulus: solver error


class PermeabilityLaw(Protocol):
    """Interface of a Darcy permeability k that depends on the volume ratio J, m^4/(N s)."""

    @property
    def permeability(self) -> float:
        """Permeability k at rest (J = 1), m^4/(N s)."""

    @property
    def solid(self) -> float:
        """Lower bound of J: the volume fraction of the solid."""

    def permeable(self, J: Floats) -> Floats:
        """Return the permeability k (...), m^4/(N s), at volume ratios J (...)."""

    def permeable_slope(self, J: Floats) -> Floats:
        """Return dk/dJ (...), m^4/(N s), at volume ratios J (...)."""


@dataclass(frozen=True)
class PoroelasticSolid(MixedSolid):
    """Mixed energy of a porous solid over a time step of `span` s, during which its fluid flows.

    It is a `MixedSolid` without compliance. `owed` (b,), m^3, is the right-hand side of the fluid equation at each of
    the b pressure nodes. `dNpdX` (m, q, b, 3), 1/m, are the gradients of the pressure shape functions, and `pores` is
    the permeability law. `turns` is False for small strains, where K = k. Pressures in the state are positive in
    tension, as in `MixedSolid`.
    """

    dNpdX: Floats = field(kw_only=True)
    pores: PermeabilityLaw = field(kw_only=True)
    turns: bool = field(kw_only=True)
    span: float = 0.0
    owed: Floats | None = None

    def value(self, x: Floats) -> float:
        """Return the energy of the skeleton, J; infinite outside the domain of its law, or if pores are closed."""
        if self.turns and not bool(np.all(self._constraint(x) > self.pores.solid - 1.0)):
            return np.inf
        return self._shape_energy.value(self.displacements(x))

    def volumes(self, x: Floats) -> Floats:
        """Return the volume change int N_b (J - 1) dV at each pressure node (b,), m^3."""
        return self._sum_at_pressures((self.w * self._constraint(x)) @ self.Np)

    def inflow(self, x: Floats) -> Floats:
        """Return the fluid inflow rate -int grad N_b . K grad p dV at each pressure node (b,), m^3/s."""
        return self._sum_at_pressures(
            -np.einsum("mq,mqbI,mqI->mb", self.w, self.dNpdX, self._negative_fluid_flux(x), optimize=True)
        )

    def dissipated_power(self, x: Floats) -> float:
        """Return the power dissipated by the flow, int grad p . K grad p dV, W."""
        return float(
            np.einsum("mq,mqI,mqI->", self.w, self._pressure_gradients(x), self._negative_fluid_flux(x), optimize=True)
        )

    def pore_pressures(self, x: Floats) -> Floats:
        """Return the pore pressures in the state x (b,), Pa, positive in compression."""
        found: Floats = -self.unit * x[3 * self.nodes : self.dofs]
        return found

    def _sum_at_pressures(self, each: Floats) -> Floats:
        """Return the sum of cell values (m, b) at each pressure node (count,)."""
        found = np.zeros(self.dofs - 3 * self.nodes)
        np.add.at(found, self.pressures - 3 * self.nodes, each)
        return found

    def _pressure_gradients(self, x: Floats) -> Floats:
        """Return the pressure gradient grad_X p at each point (m, q, 3), Pa/m, with p positive in compression."""
        found: Floats = np.einsum("mqbI,mb->mqI", self.dNpdX, -self.unit * x[self.pressures], optimize=True)
        return found

    def _negative_fluid_flux(self, x: Floats) -> Floats:
        """Return the negative fluid flux K grad p at each point (m, q, 3), m/s, per undeformed area."""
        slopes = self._pressure_gradients(x)
        if not self.turns:
            return self.pores.permeability * slopes
        G, kJ, _ = self._inverse_gradient_and_permeability(x)
        found: Floats = kJ[..., None] * np.einsum("mqIi,mqLi,mqL->mqI", G, G, slopes, optimize=True)
        return found

    def _inverse_gradient_and_permeability(self, x: Floats) -> tuple[Floats, Floats, Floats]:
        """Return F^-1 (m, q, 3, 3), k J (m, q) and J d(k J)/dJ (m, q), m^4/(N s), in the state x."""
        J = 1.0 + self._constraint(x)
        G: Floats = np.linalg.inv(self.F(x)).reshape(*self.w.shape, 3, 3).astype(np.float64, copy=False)
        k = self.pores.permeable(J)
        return G, k * J, J * (k + J * self.pores.permeable_slope(J))

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the nodal forces, N, and the residual of the fluid balance, also in N."""
        MixedSolid.add_gradient(self, x, g, scale)
        rows = g[3 * self.nodes : self.dofs]
        if self.owed is not None:
            rows -= (scale * self.unit) * self.owed
        if self.span:
            rows -= (scale * self.unit * self.span) * self.inflow(x)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the saddle-point matrix, N/m.

        At finite strain it is not symmetric, because K depends on the deformation.
        """
        MixedSolid.add_hessian(self, x, data, slots, scale, projected)
        if not self.span:
            return
        width, flow = 3 * self.cells.shape[1], scale * self.unit * self.span
        if not self.turns:
            D = np.einsum("mq,mqbI,mqcI->mbc", self.pores.permeability * self.w, self.dNpdX, self.dNpdX, optimize=True)
            add_blocks((-flow * self.unit) * D, slots[:, width:, width:], data)
            return
        G, kJ, slope = self._inverse_gradient_and_permeability(x)
        spatial = np.einsum("mqbI,mqIi->mqbi", self.dNpdX, G, optimize=True)
        D = np.einsum("mq,mqbi,mqci->mbc", kJ * self.w, spatial, spatial, optimize=True)
        add_blocks((-flow * self.unit) * D, slots[:, width:, width:], data)
        add_blocks(flow * self._flow_derivative(x, G, kJ, slope, spatial), slots[:, width:, :width], data)

    def _flow_derivative(self, x: Floats, G: Floats, kJ: Floats, slope: Floats, spatial: Floats) -> Floats:
        """Return int grad N_b . dK/du grad p dV (m, b, 3a), m^2/s.

        With g = F^-T grad p and s_b = F^-T grad N_b, the integrand is s_b . g J d(kJ)/dJ (F^-T : dF) - k J (s_b . dF
        F^-1 g + g . dF F^-1 s_b).
        """
        g = np.einsum("mqI,mqIi->mqi", self._pressure_gradients(x), G, optimize=True)
        found = []
        for b in range(spatial.shape[2]):
            s = spatial[:, :, b]
            Gg, Gs = (np.einsum("mqLi,mqi->mqL", G, v)[..., None, :] for v in (g, s))
            M = (slope * np.einsum("mqi,mqi->mq", s, g))[..., None, None] * G.swapaxes(2, 3)
            M = M - kJ[..., None, None] * (s[..., None] * Gg + g[..., None] * Gs)
            found.append(np.einsum("mq,mqa->ma", self.w, self._shape_energy.derivative_by_displacements(M)))
        return np.stack(found, axis=1)


@dataclass(frozen=True)
class FirstStage:
    """Results of the first of the two stages of a time step, which the second stage needs.

    `span` is its duration, s. `gained` (b,), m^3, is the fluid volume gained at each pressure node, and `left` (b,),
    m^3, the volume that left the body at nodes of prescribed pressure. `heat` is the dissipated power, W.
    """

    span: float
    gained: Floats  # span times the inflow rate at its end, m^3
    left: Floats
    heat: float
    pumped: float  # work of prescribed pressures, J


@dataclass(frozen=True, eq=False)
class PoreFluid(EnergyHistory):
    """Pore-fluid state of a porous solid, carried from time step to time step; there are b pressure nodes.

    - `account` (b,), m^3: fluid volume gained since rest. It keeps the balance error of a step, so that the next step
    corrects this error.
    - `held` (b,): mask of nodes with prescribed pressure; `out` (b,), m^3: volume that left the body at these nodes.
    - `volumes` (b,), m^3: current volume changes.
    - `lost`, J: dissipated energy; `pumped`, J: work of prescribed pressures.
    - `moved`, m^3: fluid volume moved inside the body so far; `passed`, m^3: volume that entered or left the body.
    - `pressed`, Pa: largest pore pressure so far.
    - `rough`, m^3: error estimate of the last step, its difference from a first-order method. After a jump it is the
    volume moved in the jump, or `moved` if the jump moved more than the fraction SEEN of it.
    """

    energy: PoroelasticSolid
    held: NDArray[np.bool_]
    account: Floats
    volumes: Floats
    out: Floats
    lost: float = 0.0
    pore_pressure_work: float = 0.0
    moved: float = 0.0
    passed: float = 0.0
    pressed: float = 0.0
    rough: float = 0.0
    stage: FirstStage | None = None

    @classmethod
    def at_rest(cls, energy: PoroelasticSolid, held: NDArray[np.bool_]) -> PoreFluid:
        """Return the pore fluid of a body that has always been at rest."""
        none = np.zeros(len(held))
        return cls(energy, held, none, none, none)

    @property
    def _fluid_right_hand_side(self) -> Floats:
        """Right-hand side of the fluid equation of the next stage (b,), m^3."""
        return self.account if self.stage is None else self.account + AFTER * self.stage.gained

    def over(self, h: float) -> Energy:
        """Return the energy of the next stage of the time step.

        h, s, is the duration of the first stage, which is the fraction INNER of the step. In the second stage h is
        ignored: it has the duration of the first stage and ends with the step.
        """
        return replace(self.energy, owed=self._fluid_right_hand_side, span=h if self.stage is None else self.stage.span)

    def history_after_step(self, x: Floats, h: float) -> PoreFluid:
        """Return the pore fluid after a stage of h seconds that ends in state x, or after a jump if h = 0."""
        owed, span = self._fluid_right_hand_side, h if self.stage is None else self.stage.span
        V, flow, heat = self.energy.volumes(x), span * self.energy.inflow(x), self.energy.dissipated_power(x)
        now = np.where(self.held, V, owed + flow)
        left = np.where(self.held, owed + flow - V, 0.0)
        p = self.energy.pore_pressures(x)
        pumped, pressed = -float(p @ left), max(self.pressed, float(np.abs(p).max(initial=0.0)))
        if self.stage is None and h > 0.0:
            return replace(
                self, stage=FirstStage(h, now - self.account, left, heat, pumped), volumes=V, pressed=pressed
            )
        lost, out = self.lost + span * heat, self.out + left
        pumped = self.pore_pressure_work + (pumped if span else 0.0)  # work in a jump is part of the energy
        moved = 0.5 * float(np.abs(now - self.account).sum())
        whole = self.moved + moved
        rough = whole if moved > SEEN * whole else moved  # meshes cannot resolve an instantaneous outflow
        if self.stage is not None:
            lost, out = lost + AFTER * span * self.stage.heat, out + AFTER * self.stage.left
            pumped += AFTER * self.stage.pumped
            rough = 0.5 * float(np.abs(self.stage.gained - (now - owed)).sum())
        passed = self.passed + 0.5 * float(np.abs(out - self.out).sum())
        return replace(
            self,
            account=now,
            volumes=V,
            out=out,
            lost=lost,
            pore_pressure_work=pumped,
            moved=whole,
            passed=passed,
            pressed=pressed,
            rough=rough,
            stage=None,
        )

    @property
    def _volume_tolerance(self) -> float:
        """Largest volume that rounding and solver errors can explain, m^3."""
        return float(self.energy.w.sum()) * (ROUNDED + SOLVED * self.pressed / self.energy.shear)

    @property
    def fluid_balance_error(self) -> float:
        """Relative error of the fluid balance: |volume gained + volume that left| over the volume moved so far."""
        amiss = max(0.0, abs(float(self.volumes.sum()) + float(self.out.sum())) - self._volume_tolerance)
        return amiss / (self.moved + self.passed) if amiss else 0.0

    @property
    def unresolved(self) -> float:
        """Ratio of the error estimate `rough` of the last step to the fluid volume `moved` inside the body so far."""
        return self.rough / self.moved if self.moved > self._volume_tolerance else 0.0

    @property
    def stored(self) -> float:
        """Zero, J: the fluid stores no energy; all elastic energy is in the skeleton."""
        return 0.0

    @property
    def dissipated(self) -> float:
        """Energy dissipated since the start, J; inside a step it includes the first stage."""
        return self.lost if self.stage is None else self.lost + self.stage.span * self.stage.heat


def find_pore_fluid(memories: Any) -> PoreFluid:
    """Return the pore-fluid state among the histories of a body (`BodyHistory`)."""
    found: PoreFluid = next(own for own in memories.each if isinstance(own, PoreFluid))
    return found
