"""Energies of incompressible isotropic rubber laws, for closed-form solutions.

The laws are implemented independently: a reference shares no code with the solvers that it checks. Stretches are given
by their logarithms e (3, n), whose sum is 0, so that small strains keep their digits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass
from softmark.references.straight_cantilever import NotApplicable

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np

Constants = Mapping[str, Any]
Of = Callable[[Constants, Any, Any], Any]  # of constants, I1 - 3 and I2 - 3 (n,)

INCOMPRESSIBLE = 0.5

CHAINS = (1.0 / 2.0, 1.0 / 20.0, 11.0 / 1050.0, 19.0 / 7000.0, 519.0 / 673750.0)


def _arruda_boyce_energy(c: Constants, i: Any, k: Any) -> Any:
    I = 3.0 + i
    return sum(c["m"] * a / c["limit"] ** (2 * n - 2) * (I**n - 3.0**n) for n, a in enumerate(CHAINS, 1))


def _arruda_boyce_derivatives(c: Constants, i: Any, k: Any) -> Any:
    I = 3.0 + i
    return sum(c["m"] * a * n / c["limit"] ** (2 * n - 2) * I ** (n - 1) for n, a in enumerate(CHAINS, 1)), 0.0


# of each law its energy, J/m^3, and its derivatives by I1 and I2, Pa, by the names that constants have in scenes
LAWS: dict[str, tuple[Of, Of]] = {
    "mooney_rivlin": (lambda c, i, k: c["c1"] * i + c["c2"] * k, lambda c, i, k: (c["c1"], c["c2"])),
    "yeoh": (
        lambda c, i, k: c["c1"] * i + c["c2"] * i**2 + c["c3"] * i**3,
        lambda c, i, k: (c["c1"] + 2.0 * c["c2"] * i + 3.0 * c["c3"] * i**2, 0.0),
    ),
    "gent": (
        lambda c, i, k: -0.5 * c["mu"] * c["limit"] * np.log1p(-i / c["limit"]),
        lambda c, i, k: (0.5 * c["mu"] * c["limit"] / np.where(i < c["limit"], c["limit"] - i, np.nan), 0.0),
    ),
    "fung": (
        lambda c, i, k: 0.5 * c["mu"] / c["b"] * np.expm1(c["b"] * i),
        lambda c, i, k: (0.5 * c["mu"] * np.exp(c["b"] * i), 0.0),
    ),
    "veronda_westmann": (
        lambda c, i, k: c["c"] * np.expm1(c["a"] * i) - 0.5 * c["c"] * c["a"] * k,
        lambda c, i, k: (c["c"] * c["a"] * np.exp(c["a"] * i), -0.5 * c["c"] * c["a"]),
    ),
    "arruda_boyce": (_arruda_boyce_energy, _arruda_boyce_derivatives),
}
KNOWN = (*LAWS, "ogden")


def require_incompressible(poisson: float) -> None:
    """Raise NotApplicable unless Poisson's ratio is 0.5, as closed-form solutions of rubber require."""
    if poisson != INCOMPRESSIBLE:
        raise NotApplicable(f"a Poisson's ratio of {poisson:g} lets the volume change",
                      "the closed form holds for `poisson = 0.5`; use it with `formulation = mixed`")  # fmt: skip


@dataclass(frozen=True)
class Rubber:
    """Incompressible rubber law, by the name and the constants that it has in scenes.

    Raises NotApplicable for an unknown law.
    """

    law: str
    constants: tuple[tuple[str, Any], ...]  # names and values, SI

    def __post_init__(self) -> None:
        if self.law not in KNOWN:
            raise NotApplicable(
                f"there is no closed form for `{self.law}`", f"supported are {', '.join(KNOWN)} and neo-Hookean solids"
            )

    @classmethod
    def neo_hookean(cls, mu: float) -> Rubber:
        """Return the neo-Hookean law mu/2 (I1 - 3), mu in Pa."""
        return cls("mooney_rivlin", (("c1", 0.5 * mu), ("c2", 0.0)))

    def energy(self, e: Array) -> Array:
        """Return the energy W (n,), J/m^3, at logarithms e (3, n) of the principal stretches."""
        c = dict(self.constants)
        if self.law == "ogden":
            found: Array = sum(m / a * np.expm1(a * e).sum(axis=0) for m, a in zip(c["mu"], c["alpha"], strict=True))
        else:
            found = LAWS[self.law][0](c, *_invariants(e))
        return found

    def tensions(self, e: Array) -> Array:
        """Return the principal stresses dW/de (3, n), Pa, at logarithms e (3, n) of the principal stretches.

        They are defined up to a common pressure. They are 0 at rest, and NaN beyond the domain of the law.
        """
        c = dict(self.constants)
        if self.law == "ogden":
            found: Array = sum(m * np.expm1(a * e) for m, a in zip(c["mu"], c["alpha"], strict=True))
        else:
            first, second = LAWS[self.law][1](c, *_invariants(e))
            found = 2.0 * first * np.expm1(2.0 * e) - 2.0 * second * np.expm1(-2.0 * e)
        return found


def _invariants(e: Array) -> tuple[Array, Array]:
    """Return the invariants I1 - 3 and I2 - 3 (n,)."""
    return np.expm1(2.0 * e).sum(axis=0), np.expm1(-2.0 * e).sum(axis=0)
