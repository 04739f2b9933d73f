"""What is imposed on one material point, and the state that it finds."""

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
    """The law has no state that is free of stress where it should be; `share` of what is imposed was reached."""

    def __init__(self, share: float, stretches: Floats) -> None:
        super().__init__(f"no state beyond {share:.3g} of what is imposed")
        self.share = share
        self.stretches = stretches


@dataclass(frozen=True, eq=False)
class Drive:
    """What is imposed: stretches along x, y and z (3,), nan where free, the nominal stress on these (3,), Pa.

    `shear` is the entry (a, b) of F beside its diagonal and its size. `driven` are the axes of what is pulled; where no
    stretch is free and the solid keeps its volume, its pressure is what relieves the axis `relieved`.
    """

    stretches: Floats
    stresses: Floats = field(default_factory=lambda: np.zeros(3))
    shear: tuple[int, int, float] | None = None
    driven: tuple[int, ...] = (0,)
    relieved: int = 2

    def at(self, share: float) -> Drive:
        """The same at a part of its full size."""
        sheared = None if self.shear is None else (*self.shear[:2], share * self.shear[2])
        grown = 1.0 + share * (self.stretches - 1.0)
        return Drive(grown, share * self.stresses, sheared, self.driven, self.relieved)

    def F(self, t: Floats) -> Floats:
        """The deformation gradient (1, 3, 3) of stretches t (3,)."""
        F = np.diag(t)[None].copy()
        if self.shear is not None:
            F[0, self.shear[0], self.shear[1]] = self.shear[2]
        return F


@dataclass(frozen=True, eq=False)
class PointState:
    """A homogeneous state: F and P (3, 3), Pa, the energy per volume at rest, J/m^3, the pressure in tension, Pa.

    `residual` is what is left of stress where there should be none, relative to the largest; `held` is the least
    stiffness of what is free, `freed` the same with what is driven set free under its force, relative to that at rest:
    what is not positive gives way.
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
        """J = det F, of a diagonal and one entry beside it."""
        (a, b, c), (d, e, f), (g, h, i) = self.F.tolist()
        return float(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g))
