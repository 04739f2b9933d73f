"""Drained skeletons in confined compression: uniaxial-strain stress as a function of stretch, for each law.

The laws are implemented independently, since a reference shares no code with the solvers that it checks. F = diag(J, 1,
1) and P = d psi / dJ.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from softmark.records import dataclass
from softmark.references.rubber_energies import Constants, Rubber
from softmark.references.straight_cantilever import NotApplicable

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np

HALVINGS = 200
LEAST, MOST = 1e-3, 1e2  # stretches between which one is looked for


def _stable_neo_hookean_stress(c: Constants, J: Array) -> Array:
    m, l = 4.0 / 3.0 * c["mu"], c["lam"] + 5.0 / 6.0 * c["mu"]
    found: Array = m * (1.0 - 1.0 / (J * J + 3.0)) * J + l * (J - 1.0 - 0.75 * m / l)
    return found


# P of laws by mu and lam, Pa
WHOLE: dict[str, Callable[[Constants, Array], Array]] = {
    "neo_hookean": lambda c, J: c["mu"] * (J - 1.0 / J) + c["lam"] * np.log(J) / J,
    "st_venant_kirchhoff": lambda c, J: (0.5 * c["lam"] + c["mu"]) * J * (J * J - 1.0),
    "stable_neo_hookean": _stable_neo_hookean_stress,
}

# (K/2 g^2)' / K by J
VOLUMES: dict[str, Callable[[Array], Array]] = {
    "squared": lambda J: J - 1.0,
    "logarithmic": lambda J: np.log(J) / J,
    "reciprocal": lambda J: 0.25 * (J - 1.0 / J) * (1.0 + J**-2),
}


@dataclass(frozen=True)
class Skeleton:
    """Material law of a drained skeleton: its name and its constants mu and lam, Pa.

    A rubber law has a volumetric term with a bulk modulus, Pa, instead of lam. Raises NotApplicable for an unknown law.
    """

    law: str
    mu: float
    lam: float
    rubber: Rubber | None = None
    volumetric: str = "squared"

    def __post_init__(self) -> None:
        if self.rubber is None and self.law not in WHOLE:
            raise NotApplicable(f"`{self.law}` is not supported in confined compression",
                          f"supported are {', '.join(WHOLE)}, `neo_hookean_isochoric` and rubbers")  # fmt: skip

    def stress(self, J: Array) -> Array:
        """Return the nominal stress P (n,), Pa, at stretches J (n,)."""
        if self.rubber is None:
            return WHOLE[self.law]({"mu": self.mu, "lam": self.lam}, J)
        third = np.log(J) / 3.0
        tensions = self.rubber.tensions(np.stack([2.0 * third, -third, -third]))
        bulk = self.lam + 2.0 / 3.0 * self.mu
        found: Array = 2.0 / 3.0 * (tensions[0] - tensions[1]) / J + bulk * VOLUMES[self.volumetric](J)
        return found

    def slope(self, J: Array) -> Array:
        """Return the derivative dP/dJ (n,), Pa, by differences of fourth order, accurate to ten digits."""
        h = 1e-3 * J
        near = self.stress(J + h) - self.stress(J - h)
        far = self.stress(J + 2.0 * h) - self.stress(J - 2.0 * h)
        found: Array = (8.0 * near - far) / (12.0 * h)
        return found

    def stretch(self, stress: float) -> float:
        """Return the stretch at a nominal stress P, Pa, the first on the path from rest.

        Raises NotApplicable if there is none.
        """
        if stress == 0.0:
            return 1.0
        way = np.exp(np.linspace(0.0, np.log(LEAST if stress < 0.0 else MOST), 2001))
        with np.errstate(all="ignore"):
            carried = self.stress(way) / stress
        over = np.flatnonzero(carried >= 1.0)
        if not len(over) or not np.isfinite(carried[: over[0] + 1]).all():
            raise NotApplicable(
                f"its skeleton cannot carry a stress of {stress:g} Pa", "reduce the load, or use a stiffer skeleton"
            )
        low, high = float(way[over[0] - 1]), float(way[over[0]])
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            if middle in (low, high):
                break
            less = float(self.stress(np.array([middle]))[0]) / stress < 1.0
            low, high = (middle, high) if less else (low, middle)
        return 0.5 * (low + high)
