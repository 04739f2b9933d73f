"""Imposed values of a material point, and the homogeneous state that results."""

from __future__ import annotations

from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass

Floats = NDArray[np.float64]
FARTHEST = 0.7  # largest change of the logarithm of a free stretch in one iteration
STILL = 1e-14  # of a stretch: smaller changes are zero
ROUNDING = 64.0 * 2.0**-52  # of the stiffness at rest: smaller stresses are zero
SETTLED = 1e-9  # of the stiffness at rest: largest residual accepted as rounding if no step lowers it
HALVINGS = 12  # largest number of halvings of a step that does not lower the residual
HELD = 1e-12  # of a volume: smaller imposed changes are zero


class NoState(Exception):
    """Error raised if no state has the prescribed stresses.

    `share` is the fraction of the imposed values that was reached, and `stretches` (3,) are those of the last state.
    """

    def __init__(self, share: float, stretches: Floats) -> None:
        super().__init__(f"no state beyond a fraction {share:.3g} of the imposed loading")
        self.share = share
        self.stretches = stretches


@dataclass(frozen=True, eq=False)
class ImposedDeformation:
    """Imposed stretches (3,) along x, y and z (nan where free), and nominal stresses (3,), Pa, on free axes.

    `shear` has the indices (a, b) and the value of the off-diagonal entry of F. `driven` are the loaded axes. If no
    stretch is free, the pressure of an incompressible solid follows from zero stress on the axis `relieved`.
    """

    stretches: Floats
    stresses: Floats = field(default_factory=lambda: np.zeros(3))
    shear: tuple[int, int, float] | None = None
    driven: tuple[int, ...] = (0,)
    relieved: int = 2

    def at(self, share: float) -> ImposedDeformation:
        """Return a fraction `share` of the imposed values."""
        sheared = None if self.shear is None else (*self.shear[:2], share * self.shear[2])
        grown = 1.0 + share * (self.stretches - 1.0)
        return ImposedDeformation(grown, share * self.stresses, sheared, self.driven, self.relieved)

    def F(self, t: Floats) -> Floats:
        """Return the deformation gradient (1, 3, 3) with the stretches t (3,) and the imposed shear."""
        F = np.diag(t)[None].copy()
        if self.shear is not None:
            F[0, self.shear[0], self.shear[1]] = self.shear[2]
        return F


@dataclass(frozen=True, eq=False)
class PointState:
    """Homogeneous state: F (3, 3), nominal stress P (3, 3), Pa, energy density, J/m^3, and pressure, Pa.

    The energy is per reference volume, and the pressure is positive in tension. `residual` is the unbalanced stress
    relative to the largest one. `held` is the least stiffness if only the free axes may stretch. `freed` is the least
    stiffness if the driven axes may stretch too, under constant force. Both are relative to the stiffness at rest. A
    state is unstable if they are not positive.
    """

    F: Floats
    P: Floats
    psi: float
    pressure: float
    residual: float
    iterations: int
    held: float
    freed: float

    @property
    def volume(self) -> float:
        """Volume ratio J = det F."""
        (a, b, c), (d, e, f), (g, h, i) = self.F.tolist()
        return float(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g))
