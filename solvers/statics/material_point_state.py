"""Imposed values of a material point, and the homogeneous state that results."""

from __future__ import annotations

from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass

Floats = NDArray[np.float64]
FARTHEST = 0.7  # by how much the logarithm of a free stretch changes at most in one iteration
STILL = 1e-14  # of a stretch: a smaller change is none
ROUNDING = 64.0 * 2.0**-52  # of the stiffness at rest: a stress below is none
SETTLED = 1e-9  # of the stiffness at rest: where no step lowers it, what is left of a stress may be rounding
HALVINGS = 12  # of a step that does not lower what is left
HELD = 1e-12  # of a volume: an imposed change that is less is none


class NoState(Exception):
    """Raised if the law has no state with the prescribed stress; `share` of the imposed values was reached."""

    def __init__(self, share: float, stretches: Floats) -> None:
        super().__init__(f"no state beyond a fraction {share:.3g} of the imposed loading")
        self.share = share
        self.stretches = stretches


@dataclass(frozen=True, eq=False)
class ImposedDeformation:
    """Imposed stretches along x, y and z (3,), nan where free, and nominal stresses on free axes (3,), Pa.

    `shear` has the indices (a, b) and the value of the off-diagonal entry of F. `driven` are the loaded axes. Without
    free stretches the pressure of an incompressible solid makes the stress on the axis `relieved` zero.
    """

    stretches: Floats
    stresses: Floats = field(default_factory=lambda: np.zeros(3))
    shear: tuple[int, int, float] | None = None
    driven: tuple[int, ...] = (0,)
    relieved: int = 2

    def at(self, share: float) -> ImposedDeformation:
        """Return a fraction of the imposed values."""
        sheared = None if self.shear is None else (*self.shear[:2], share * self.shear[2])
        grown = 1.0 + share * (self.stretches - 1.0)
        return ImposedDeformation(grown, share * self.stresses, sheared, self.driven, self.relieved)

    def F(self, t: Floats) -> Floats:
        """Return the deformation gradient (1, 3, 3) of stretches t (3,)."""
        F = np.diag(t)[None].copy()
        if self.shear is not None:
            F[0, self.shear[0], self.shear[1]] = self.shear[2]
        return F


@dataclass(frozen=True, eq=False)
class PointState:
    """Homogeneous state: F and P (3, 3), Pa, energy per reference volume, J/m^3, and pressure, positive in tension, Pa.

    `residual` is the unbalanced stress relative to the largest. `held` is the least stiffness of the free axes, `freed`
    that with driven axes also free under their force, both relative to the stiffness at rest: not positive means
    unstable.
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
