"""Guccione-McCulloch-Waldman material for passive heart muscle."""

from __future__ import annotations

from typing import Annotated

from softmark.records import dataclass
from softmark.solvers.materials.anisotropic_material import Bulk, Density, Fibres
from softmark.solvers.materials.fung_orthotropic import ExponentialStrainLaw


@dataclass(frozen=True)
class Guccione(ExponentialStrainLaw):
    """Passive heart muscle after Guccione: an exponential of Green's strain, alike in all directions across fibres.

    psi = C/2 (exp Q - 1) + K/2 (J - 1)^2, with Green's strain E along fibres f and two directions s, n across them
    Q = bf Eff^2 + bt (Ess^2 + Enn^2 + 2 Esn^2) + 2 bfs (Efs^2 + Efn^2)
    With bf = bt = bfs it is isotropic. It resists compression as it does tension. With bulk left out J = 1, and
    `formulation = mixed` finds the pressure.
    Source: Guccione, McCulloch, Waldman (1991), "Passive material properties of intact ventricular myocardium";
    Land et al. (2015), Proc. R. Soc. A 471:20150641, of which C = 2 kPa, 8, 2 and 4 are.
    """

    stiffness: Annotated[float, "Pa in (0, inf)", "C, a factor of all stresses"]
    bf: Annotated[float, "1 in (0, inf)", "exponent coefficient of the strain along the fibres"]
    bt: Annotated[float, "1 in (0, inf)", "exponent coefficient of the strains across the fibres"]
    bfs: Annotated[float, "1 in (0, inf)", "exponent coefficient of the shear along the fibres"]
    density: Density
    fibres: Fibres
    bulk: Bulk = None

    @property
    def exponents(self) -> tuple[float, ...]:
        """Coefficients b_ab in the order of PAIRS: ff, ss, nn, fs, fn, sn."""
        return self.bf, self.bt, self.bt, self.bfs, self.bfs, self.bt
