"""Porous solids full of fluid: the energy of a step in time, and what their pores hold from step to step.

With both constituents incompressible the fluid that leaves a place is the volume that is lost there. Over a step
int N_b (J - 1) dV + span int grad N_b . K grad p dV = owed_b for every pressure, K = J F^-1 k F^-T and p in compression
positive; with -p for the pressure of `MixedSolid` it is the second equation of a saddle like its own, in which
span K stands for a compliance. At span = 0 it is the incompressible solid.

Steps are those of the method of two stages that is of second order and L-stable, so that what a jump leaves of high
modes is gone after a few steps: SDIRK2 (Alexander 1977, "Diagonally implicit Runge-Kutta methods for stiff ODEs").
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
from softmark.solvers.energies.viscoelastic_memory import Fades

INNER = 1.0 - 0.5**0.5  # of a step: where its first stage ends, and what either stage is implicit in
AFTER = (1.0 - INNER) / INNER
SEEN = 1e-3  # of all that has moved: what leaves at once and is less does not matter
ROUNDED = 1e-15  # of the volume of a body: what rounding of deformation gradients leaves of it
SOLVED = 1e-12  # of that volume, by pressures over the shear modulus: what forces leave of it that balance so well


class Permeable(Protocol):
    """Darcy's permeability as a function of the volume J, m^4/(N s)."""

    @property
    def permeability(self) -> float:
        """At rest."""

    @property
    def solid(self) -> float:
        """What J never falls to."""

    def permeable(self, J: Floats) -> Floats:
        """k (...)."""

    def permeable_slope(self, J: Floats) -> Floats:
        """dk/dJ (...)."""


@dataclass(frozen=True)
class Seeping(MixedSolid):
    """`MixedSolid` without a compliance whose pressures let fluid seep for `span` s: `owed` (b,), m^3, is left to it.

    `dNpdX` (m, q, b, 3), 1/m, are the gradients of the shape functions of pressures. Where strains are small, `turns`
    is false and K = k. The pressures of the state are those of `MixedSolid`, positive in tension.
    """

    dNpdX: Floats = field(kw_only=True)
    pores: Permeable = field(kw_only=True)
    turns: bool = field(kw_only=True)
    span: float = 0.0
    owed: Floats | None = None

    def value(self, x: Floats) -> float:
        """Energy of the skeleton, J; infinite outside the domain of its law, and where its pores are closed."""
        if self.turns and not bool(np.all(self._constraint(x) > self.pores.solid - 1.0)):
            return np.inf
        return self._shape.value(self.displacements(x))

    def volumes(self, x: Floats) -> Floats:
        """int N_b (J - 1) dV (b,), m^3."""
        return self._gathered((self.w * self._constraint(x)) @ self.Np)

    def seeping(self, x: Floats) -> Floats:
        """-int grad N_b . K grad p dV (b,): what flows to each pressure, m^3/s."""
        return self._gathered(-np.einsum("mq,mqbI,mqI->mb", self.w, self.dNpdX, self._pulled(x), optimize=True))

    def heat(self, x: Floats) -> float:
        """int grad p . K grad p dV, W: what the flow dissipates."""
        return float(np.einsum("mq,mqI,mqI->", self.w, self._slopes(x), self._pulled(x), optimize=True))

    def held_in(self, x: Floats) -> Floats:
        """The pressures of a state (b,), Pa, in compression positive."""
        found: Floats = -self.unit * x[3 * self.nodes : self.dofs]
        return found

    def _gathered(self, each: Floats) -> Floats:
        """Sums over cells (m, b) at each pressure (count,)."""
        found = np.zeros(self.dofs - 3 * self.nodes)
        np.add.at(found, self.pressures - 3 * self.nodes, each)
        return found

    def _slopes(self, x: Floats) -> Floats:
        """grad_X p (m, q, 3), Pa/m, p in compression positive."""
        found: Floats = np.einsum("mqbI,mb->mqI", self.dNpdX, -self.unit * x[self.pressures], optimize=True)
        return found

    def _pulled(self, x: Floats) -> Floats:
        """K grad p (m, q, 3), m/s."""
        slopes = self._slopes(x)
        if not self.turns:
            return self.pores.permeability * slopes
        G, kJ, _ = self._deformed(x)
        found: Floats = kJ[..., None] * np.einsum("mqIi,mqLi,mqL->mqI", G, G, slopes, optimize=True)
        return found

    def _deformed(self, x: Floats) -> tuple[Floats, Floats, Floats]:
        """F^-1 (m, q, 3, 3), k J and J d(k J)/dJ (m, q), m^4/(N s)."""
        J = 1.0 + self._constraint(x)
        G: Floats = np.linalg.inv(self.F(x)).reshape(*self.w.shape, 3, 3).astype(np.float64, copy=False)
        k = self.pores.permeable(J)
        return G, k * J, J * (k + J * self.pores.permeable_slope(J))

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Nodal forces, N, and what is out of the balance of fluid, in N as well."""
        MixedSolid.add_gradient(self, x, g, scale)
        rows = g[3 * self.nodes : self.dofs]
        if self.owed is not None:
            rows -= (scale * self.unit) * self.owed
        if self.span:
            rows -= (scale * self.unit * self.span) * self.seeping(x)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """The saddle's matrix, N/m. That of finite strain is not symmetric: K moves with the solid."""
        MixedSolid.add_hessian(self, x, data, slots, scale, projected)
        if not self.span:
            return
        width, flow = 3 * self.cells.shape[1], scale * self.unit * self.span
        if not self.turns:
            D = np.einsum("mq,mqbI,mqcI->mbc", self.pores.permeability * self.w, self.dNpdX, self.dNpdX, optimize=True)
            add_blocks((-flow * self.unit) * D, slots[:, width:, width:], data)
            return
        G, kJ, slope = self._deformed(x)
        spatial = np.einsum("mqbI,mqIi->mqbi", self.dNpdX, G, optimize=True)
        D = np.einsum("mq,mqbi,mqci->mbc", kJ * self.w, spatial, spatial, optimize=True)
        add_blocks((-flow * self.unit) * D, slots[:, width:, width:], data)
        add_blocks(flow * self._turned(x, G, kJ, slope, spatial), slots[:, width:, :width], data)

    def _turned(self, x: Floats, G: Floats, kJ: Floats, slope: Floats, spatial: Floats) -> Floats:
        """int grad N_b . dK/du grad p dV (m, b, 3a), m^2/s.

        With g = F^-T grad p and s_b = F^-T grad N_b: s_b . g J d(kJ)/dJ (F^-T : dF) - k J (s_b . dF F^-1 g + the same
        with s_b and g exchanged).
        """
        g = np.einsum("mqI,mqIi->mqi", self._slopes(x), G, optimize=True)
        found = []
        for b in range(spatial.shape[2]):
            s = spatial[:, :, b]
            Gg, Gs = (np.einsum("mqLi,mqi->mqL", G, v)[..., None, :] for v in (g, s))
            M = (slope * np.einsum("mqi,mqi->mq", s, g))[..., None, None] * G.swapaxes(2, 3)
            M = M - kJ[..., None, None] * (s[..., None] * Gg + g[..., None] * Gs)
            found.append(np.einsum("mq,mqa->ma", self.w, self._shape.slope(M)))
        return np.stack(found, axis=1)


@dataclass(frozen=True)
class Stage:
    """The first stage of a step: how long it was, s; what pores gained and what left by held ones (b,), m^3; W."""

    span: float
    gained: Floats  # span times the rate at its end
    left: Floats
    heat: float
    pumped: float  # J, that held pressures have brought


@dataclass(frozen=True, eq=False)
class Pores(Fades):
    """What the pores of a porous solid hold: `account` (b,), m^3, since rest; what left by `held` ones so far, `out`.

    What the equations of a step leave of the balance stays in the account, so that the next step makes up for it.
    `lost` is what was dissipated and `pumped` what held pressures have brought in time, J; `moved` the volume that has
    changed places within, `passed` what came or left, m^3; `volumes` (b,) those now; `pressed` the largest, Pa.
    `rough` is how far the last step is from what a method of first order makes of it, m^3: about that if it is short,
    and as much as has moved in it if fluid has come to rest within.
    """

    energy: Seeping
    held: NDArray[np.bool_]
    account: Floats
    volumes: Floats
    out: Floats
    lost: float = 0.0
    pumped: float = 0.0
    moved: float = 0.0
    passed: float = 0.0
    pressed: float = 0.0
    rough: float = 0.0
    stage: Stage | None = None

    @classmethod
    def at_rest(cls, energy: Seeping, held: NDArray[np.bool_]) -> Pores:
        """Those of what has always been at rest."""
        none = np.zeros(len(held))
        return cls(energy, held, none, none, none)

    @property
    def _owed(self) -> Floats:
        return self.account if self.stage is None else self.account + AFTER * self.stage.gained

    def over(self, h: float) -> Energy:
        """The energy of a stage that ends h s from here: the first at INNER of a step, or the second at its end."""
        return replace(self.energy, owed=self._owed, span=h if self.stage is None else self.stage.span)

    def accepted(self, x: Floats, h: float) -> Pores:
        """The pores after a stage, or a jump with h = 0, that ends in the state x."""
        owed, span = self._owed, h if self.stage is None else self.stage.span
        V, flow, heat = self.energy.volumes(x), span * self.energy.seeping(x), self.energy.heat(x)
        now = np.where(self.held, V, owed + flow)
        left = np.where(self.held, owed + flow - V, 0.0)
        p = self.energy.held_in(x)
        pumped, pressed = -float(p @ left), max(self.pressed, float(np.abs(p).max(initial=0.0)))
        if self.stage is None and h > 0.0:
            return replace(self, stage=Stage(h, now - self.account, left, heat, pumped), volumes=V, pressed=pressed)
        lost, out = self.lost + span * heat, self.out + left
        pumped = self.pumped + (pumped if span else 0.0)  # at once it is in the energy
        moved = 0.5 * float(np.abs(now - self.account).sum())
        whole = self.moved + moved
        rough = whole if moved > SEEN * whole else moved  # of what leaves at once cells show nothing
        if self.stage is not None:
            lost, out = lost + AFTER * span * self.stage.heat, out + AFTER * self.stage.left
            pumped += AFTER * self.stage.pumped
            rough = 0.5 * float(np.abs(self.stage.gained - (now - owed)).sum())
        passed = self.passed + 0.5 * float(np.abs(out - self.out).sum())
        return replace(self, account=now, volumes=V, out=out, lost=lost, pumped=pumped, moved=whole, passed=passed,
                       pressed=pressed, rough=rough, stage=None)  # fmt: skip

    @property
    def _nothing(self) -> float:
        """What is no volume but what rounding leaves, and solving, m^3."""
        return float(self.energy.w.sum()) * (ROUNDED + SOLVED * self.pressed / self.energy.shear)

    @property
    def balance(self) -> float:
        """What the body has gained and what has left it together, over what has moved: nothing but what is unsolved."""
        amiss = max(0.0, abs(float(self.volumes.sum()) + float(self.out.sum())) - self._nothing)
        return amiss / (self.moved + self.passed) if amiss else 0.0

    @property
    def unresolved(self) -> float:
        """`rough` over all that has moved within."""
        return self.rough / self.moved if self.moved > self._nothing else 0.0

    @property
    def stored(self) -> float:
        """Beside the energy of the skeleton nothing, J."""
        return 0.0

    @property
    def dissipated(self) -> float:
        """Since the start, J; within a step by its first stage."""
        return self.lost if self.stage is None else self.lost + self.stage.span * self.stage.heat


def pores_of(memories: Any) -> Pores:
    """Those among the memories of a body that has some."""
    found: Pores = next(own for own in memories.each if isinstance(own, Pores))
    return found
