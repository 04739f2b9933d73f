"""Stresses of laws with shape and volume apart, written out again from the energies that their documentation states.

Of the invariants I1 and I2 of b' = J^(-2/3) F F^T the stress of Kirchhoff is dev(2 W1 b' - 2 W2 b'^-1), of principal
stretches sum of mu_n (t_a^alpha_n - mean) over the axes of b', and of the volume K g dg/d ln J.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.checks.solids import Floats, Stress, cofactor
from softmark.solvers.materials.arruda_boyce import ArrudaBoyce
from softmark.solvers.materials.fung import Fung
from softmark.solvers.materials.gent import Gent
from softmark.solvers.materials.isochoric import Isochoric
from softmark.solvers.materials.mooney_rivlin import MooneyRivlin
from softmark.solvers.materials.ogden import Ogden
from softmark.solvers.materials.veronda_westmann import VerondaWestmann
from softmark.solvers.materials.yeoh import Yeoh

Slopes = Callable[[Any, Floats], tuple[Any, Any]]  # of a material and I1 (n,): dW/dI1 and dW/dI2, Pa


def _chains(m: Any, I1: Floats) -> tuple[Any, Any]:
    """Half, a twentieth, 11/1050, 19/7000 and 519/673750 of powers of I1."""
    x = I1 / m.limit**2
    return m.m * (0.5 + x / 10.0 + 11.0 / 350.0 * x**2 + 19.0 / 1750.0 * x**3 + 519.0 / 134750.0 * x**4), 0.0


SLOPES: dict[type, Slopes] = {
    MooneyRivlin: lambda m, I1: (m.c1, m.c2),
    Yeoh: lambda m, I1: (m.c1 + 2.0 * m.c2 * (I1 - 3.0) + 3.0 * m.c3 * (I1 - 3.0) ** 2, 0.0),
    Gent: lambda m, I1: (0.5 * m.mu * m.limit / (m.limit + 3.0 - I1), 0.0),
    Fung: lambda m, I1: (0.5 * m.mu * np.exp(m.b * (I1 - 3.0)), 0.0),
    VerondaWestmann: lambda m, I1: (m.c * m.a * np.exp(m.a * (I1 - 3.0)), -0.5 * m.c * m.a),
    ArrudaBoyce: _chains,
}


def known(material: object) -> bool:
    """Whether the stress of a material is written out here."""
    return type(material) in SLOPES or isinstance(material, Ogden)


def grown(F: Floats) -> Floats:
    """J - 1, from the invariants of F - I: near rest det F has few digits to spare."""
    H = F - np.eye(3)
    tr = np.trace(H, axis1=1, axis2=2)
    second = 0.5 * (tr**2 - np.trace(H @ H, axis1=1, axis2=2))
    found: Floats = tr + second + np.linalg.det(H)
    return found


@dataclass(frozen=True)
class Written:
    """A material whose stress is known here."""

    material: Isochoric

    def g(self, F: Floats) -> Floats:
        """What K/2 g^2 is of (n,)."""
        j = grown(F)
        if self.material.volumetric == "squared":
            return j
        found: Floats = np.log1p(j) if self.material.volumetric == "logarithmic" else 0.5 * (j + j / (1.0 + j))
        return found

    def dg(self, F: Floats) -> Floats:
        """dg/dF (n, 3, 3)."""
        J = 1.0 + grown(F)
        slope = {"squared": J**0, "logarithmic": 1.0 / J, "reciprocal": 0.5 + 0.5 / J**2}[self.material.volumetric]
        found: Floats = slope[:, None, None] * cofactor(F)[0]
        return found

    def shape(self, F: Floats) -> Floats:
        """P of W alone, Pa (n, 3, 3)."""
        J = 1.0 + grown(F)
        b = J[:, None, None] ** (-2.0 / 3.0) * (F @ F.transpose(0, 2, 1))
        tau = self._of_powers(b) if isinstance(self.material, Ogden) else self._of_invariants(b)
        tau = tau - np.trace(tau, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
        found: Floats = tau @ cofactor(F)[0] / J[:, None, None]
        return found

    def _of_invariants(self, b: Floats) -> Floats:
        first, second = SLOPES[type(self.material)](self.material, np.trace(b, axis1=1, axis2=2))
        tau = 2.0 * np.reshape(first, (-1, 1, 1)) * b
        return tau - 2.0 * second * np.linalg.inv(b) if np.any(second) else tau

    def _of_powers(self, b: Floats) -> Floats:
        squares, axes = np.linalg.eigh(b)
        each = zip(self.material.mu, self.material.alpha, strict=True)  # type: ignore[attr-defined]
        along = sum(mu * squares ** (0.5 * alpha) for mu, alpha in each)
        found: Floats = np.einsum("nia,na,nja->nij", axes, along, axes)
        return found

    def stress(self, F: Floats, K: Any) -> Floats:
        """P, Pa, with a bulk modulus K."""
        return self.shape(F) + np.reshape(K * self.g(F), (-1, 1, 1)) * self.dg(F)

    def terms(self, selective: bool) -> tuple[Stress, ...]:
        """All of it; or what is taken at every point, with K of lam = mu or less, and what at the centre of a cell."""
        E, nu = self.material.young, self.material.poisson
        K, mu = E / (3.0 * (1.0 - 2.0 * nu)), E / (2.0 * (1.0 + nu))
        if not selective:
            return (lambda F: self.stress(F, K),)
        kept = mu * (2.0 / 3.0 + min(1.0, max(-1.0, 2.0 * nu / (1.0 - 2.0 * nu))))
        return (lambda F: self.stress(F, kept), lambda F: np.reshape((K - kept) * self.g(F), (-1, 1, 1)) * self.dg(F))
