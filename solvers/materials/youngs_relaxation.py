"""Prony series of Young's modulus for a solid whose shear modulus relaxes and whose bulk modulus does not.

In s-multiplied Laplace transforms, G(s) = G0 (1 - sum g a / (s + a)) with a = 1 / tau, and E = 9 K G / (3 K + G). The
poles of E are the roots of 3 K + G(s) = 0, one between each -a and the next. So E is a Prony series with as many terms
as G.
Source: Tschoegl (1989), "The Phenomenological Theory of Linear Viscoelastic Behavior", section 11.1.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array
else:
    from softmark.solvers.runtime.lazy_modules import np

HALVED = 200  # largest number of bisections: full precision


def young_series(g: Array, tau: Array, shear: float, bulk: float) -> tuple[Array, Array]:
    """Return shares and times, s, of the Prony series of Young's modulus.

    `g` (k,) and `tau` (k,), s, are the series of the shear modulus; `shear` and `bulk` are the instantaneous shear
    modulus and the bulk modulus, Pa.
    """
    if np.isinf(bulk):
        return g, tau
    rates, which = np.unique(1.0 / tau, return_inverse=True)
    shares = np.bincount(which, g)
    whole = (3.0 * bulk + shear) / shear
    low, high = -rates, np.concatenate([[0.0], -rates[:-1]])  # brackets: each root lies between neighbouring rates
    for _ in range(HALVED):
        r = 0.5 * (low + high)
        if ((r <= low) | (r >= high)).all():
            break
        with np.errstate(divide="ignore"):
            above = whole - (shares * rates / (r[:, None] + rates)).sum(axis=1) > 0.0
        low, high = np.where(above, low, r), np.where(above, r, high)
    slope = (shares * rates / (r[:, None] + rates) ** 2).sum(axis=1)
    young = 9.0 * bulk * shear / (3.0 * bulk + shear)
    found: Array = 27.0 * bulk**2 / (shear * slope) / (young * -r)
    return found, -1.0 / r
