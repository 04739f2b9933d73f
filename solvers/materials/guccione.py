"""Guccione-McCulloch-Waldman material for passive heart muscle."""

from __future__ import annotations

from typing import Annotated

from softmark.records import dataclass
from softmark.solvers.materials.anisotropic_material import Bulk, Density, Fibres
from softmark.solvers.materials.fung_orthotropic import ExponentialStrainLaw


@dataclass(frozen=True)
class Guccione(ExponentialStrainLaw):
    """Passive heart muscle (Guccione): an exponential of Green's strain, transversely isotropic about the fibres.

    psi = C/2 (exp Q - 1) + K/2 (J - 1)^2, with Green's strain E along fibres f and two directions s, n across them
    Q = bf Eff^2 + bt (Ess^2 + Enn^2 + 2 Esn^2) + 2 bfs (Efs^2 + Efn^2)
    With bf = bt = bfs it is isotropic. Compression is resisted like tension. Without `bulk` J = 1, and `formulation =
    mixed` finds the pressure.
    Source: Guccione, McCulloch, Waldman (1991), "Passive material properties of intact ventricular myocardium";
    Land et al. (2015), Proc. R. Soc. A 471:20150641, with C = 2 kPa, bf = 8, bt = 2 and bfs = 4.
    """

    stiffness: Annotated[float, "Pa in (0, inf)", "C, factor of all stresses"]
    bf: Annotated[float, "1 in (0, inf)", "coefficient in Q of the strain along the fibres"]
    bt: Annotated[float, "1 in (0, inf)", "coefficient in Q of strains normal to the fibres"]
    bfs: Annotated[float, "1 in (0, inf)", "coefficient in Q of shear along the fibres"]
    density: Density
    fibres: Fibres
    bulk: Bulk = None

    @property
    def exponents(self) -> tuple[float, ...]:
        """Coefficients b_ab in the order of PAIRS: ff, ss, nn, fs, fn, sn."""
        return self.bf, self.bt, self.bt, self.bfs, self.bfs, self.bt
