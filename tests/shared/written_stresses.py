"""Stresses of every law, written out by hand from the sources that its documentation names.

They share nothing with the energies that solve, of which the force check takes differences: a wrong energy density is
caught here. Laws of invariants by Holzapfel (2000), "Nonlinear Solid Mechanics", section 6.4, of principal stretches
by Ogden (1984), section 6.1, fibres by S = 2 dpsi/dC in axes along them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.independent_forces.solid_forces import Floats, Stress, cofactor
from softmark.solvers.materials.arruda_boyce import ArrudaBoyce
from softmark.solvers.materials.fung import Fung
from softmark.solvers.materials.fung_orthotropic import FungOrthotropic
from softmark.solvers.materials.gent import Gent
from softmark.solvers.materials.guccione import Guccione
from softmark.solvers.materials.holzapfel_gasser_ogden import HolzapfelGasserOgden
from softmark.solvers.materials.holzapfel_ogden import HolzapfelOgden
from softmark.solvers.materials.isochoric_split import IsochoricMaterial
from softmark.solvers.materials.mooney_rivlin import MooneyRivlin
from softmark.solvers.materials.neo_hookean import NeoHookean
from softmark.solvers.materials.neo_hookean_isochoric import NeoHookeanIsochoric
from softmark.solvers.materials.ogden import Ogden
from softmark.solvers.materials.st_venant_kirchhoff import StVenantKirchhoff
from softmark.solvers.materials.stable_neo_hookean import StableNeoHookean
from softmark.solvers.materials.transversely_isotropic import TransverselyIsotropic
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

    material: IsochoricMaterial

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


# ------------------------------------------------------------------ laws of two moduli: P over mu, with s = lam / mu


def _cofactor(F: Floats) -> Floats:
    found: Floats = cofactor(F)[0]
    return found


def _logarithm(F: Floats) -> Floats:
    found: Floats = np.log1p(grown(F))
    return found


def _inverse(F: Floats) -> Floats:
    """F^-T."""
    found: Floats = _cofactor(F) / (1.0 + grown(F))[:, None, None]
    return found


def _stretch(F: Floats) -> Floats:
    """I1 - 3."""
    found: Floats = 2.0 * _green_trace(F)
    return found


def _green(F: Floats) -> Floats:
    return 0.5 * (F.transpose(0, 2, 1) @ F - np.eye(3))


def _green_trace(F: Floats) -> Floats:
    found: Floats = np.trace(_green(F), axis1=1, axis2=2)
    return found


def _neo_hookean(F: Floats, s: float) -> Floats:
    """mu/2 (I1 - 3) - mu ln J + s mu/2 (ln J)^2, all over mu."""
    inverse = _inverse(F)
    return F - inverse + (s * _logarithm(F))[:, None, None] * inverse


def _isochoric(F: Floats, s: float) -> Floats:
    """mu/2 (J^(-2/3) I1 - 3) + (s + 2/3) mu/2 (J - 1)^2, all over mu."""
    third, kept = (1.0 + _stretch(F) / 3.0)[:, None, None], (s + 2.0 / 3.0) * grown(F)
    shape = np.exp(-2.0 / 3.0 * _logarithm(F))[:, None, None] * (F - third * _inverse(F))
    return shape + kept[:, None, None] * _cofactor(F)


def _kirchhoff(F: Floats, s: float) -> Floats:
    """mu tr(E^2) + s mu/2 (tr E)^2."""
    E = _green(F)
    return F @ (2.0 * E + (s * _green_trace(F))[:, None, None] * np.eye(3))


def _stable(F: Floats, s: float) -> Floats:
    """m/2 (I1 - 3) + l/2 (J - a)^2 - m/2 ln((I1 + 1)/4), m = 4 mu/3, l = (s + 5/6) mu, l (a - 1) = 3m/4 = mu."""
    first = 4.0 / 3.0 * (1.0 - 1.0 / (_stretch(F) + 4.0))
    second = (s + 5.0 / 6.0) * grown(F) - 1.0
    return first[:, None, None] * F + second[:, None, None] * _cofactor(F)


FINITE: dict[type, tuple[Callable[[Floats, Any], Floats], Callable[[Floats], Floats], Stress]] = {
    NeoHookean: (_neo_hookean, _logarithm, _inverse),
    NeoHookeanIsochoric: (_isochoric, grown, _cofactor),
    StVenantKirchhoff: (_kirchhoff, _green_trace, lambda F: F),
    StableNeoHookean: (_stable, grown, _cofactor),
}


def stress_of(material: Any) -> Stress:
    """P of F (n, 3, 3), Pa, of an isotropic law, whose moduli are numbers."""
    if isinstance(material, IsochoricMaterial):
        return Written(material).terms(False)[0]
    mu, nu = material.young / (2.0 * (1.0 + material.poisson)), material.poisson
    shape = FINITE[type(material)][0]
    return lambda F: mu * shape(F, 2.0 * nu / (1.0 - 2.0 * nu))


# ------------------------------------------------------------------ S of C (n, 3, 3) in the axes of the fibres

EYE = np.eye(3)


def _guccione(m: Guccione, C: Floats) -> Floats:
    b = np.array([[m.bf, m.bfs, m.bfs], [m.bfs, m.bt, m.bt], [m.bfs, m.bt, m.bt]])
    return _of_strain(m.stiffness, b, C)


def _fung(m: FungOrthotropic, C: Floats) -> Floats:
    b = np.array([[m.bff, m.bfs, m.bfn], [m.bfs, m.bss, m.bsn], [m.bfn, m.bsn, m.bnn]])
    return _of_strain(m.stiffness, b, C)


def _of_strain(c: float, b: Floats, C: Floats) -> Floats:
    E = 0.5 * (C - EYE)
    S: Floats = c * np.exp((b * E * E).sum(axis=(1, 2)))[:, None, None] * b * E
    return S


def _strand(k1: float, k2: float, E: Floats, onset: float | None) -> Floats:
    """dpsi/dE (n,): k1 E exp(k2 E^2), and from 0 to the onset Hermite's cubic with what this has there."""
    if onset is None:
        return k1 * E * np.exp(k2 * E**2)
    t = np.clip(E / onset, 0.0, 1.0)
    end = k1 * onset * np.exp(k2 * onset**2)
    steep = end * (1.0 + 2.0 * k2 * onset**2)  # the slope times the onset
    begun = end * t**2 * (3.0 - 2.0 * t) + steep * t**2 * (t - 1.0)
    return np.where(onset <= E, k1 * E * np.exp(k2 * E**2), begun)


def _outer(a: Any) -> Floats:
    return np.outer(a, a)


def _grown(C: Floats, a: Any) -> Floats:
    """a . C a - 1 (n,)."""
    found: Floats = np.einsum("i,nij,j->n", a, C - EYE, a)
    return found


def _first(C: Floats) -> Floats:
    """tr C - 3 (n,)."""
    found: Floats = np.trace(C - EYE, axis1=1, axis2=2)
    return found


def _scaled(k: Floats | float, A: Floats) -> Floats:
    return np.reshape(k, (-1, 1, 1)) * A


def _transverse(m: TransverselyIsotropic, C: Floats) -> Floats:
    f = np.array([1.0, 0.0, 0.0])
    slope = _strand(m.k1, m.k2, _grown(C, f), m.onset if m.resists == "tension" else None)
    return m.shear * (EYE - np.linalg.inv(C)) + _scaled(2.0 * slope, _outer(f))


def _artery(m: HolzapfelGasserOgden, C: Floats) -> Floats:
    S = m.c * (EYE - np.linalg.inv(C))
    for sign in (1.0, -1.0):
        a = np.array([np.cos(m.angle), sign * np.sin(m.angle), 0.0])
        shape = m.kappa * EYE + (1.0 - 3.0 * m.kappa) * _outer(a)  # the structure tensor of Gasser et al.
        E = np.einsum("ij,nij->n", shape, C - EYE)
        S = S + _scaled(2.0 * _strand(m.k1, m.k2, E, m.onset), shape)
    return S


def _heart(m: HolzapfelOgden, C: Floats) -> Floats:
    f, s = EYE[0], EYE[1]
    S = m.a * (_scaled(np.exp(m.b * _first(C)), EYE) - np.linalg.inv(C))
    S = S + _scaled(2.0 * _strand(m.a_f, m.b_f, _grown(C, f), m.onset), _outer(f))
    S = S + _scaled(2.0 * _strand(m.a_s, m.b_s, _grown(C, s), m.onset), _outer(s))
    shear = _strand(m.a_fs, m.b_fs, C[:, 0, 1], None)
    return S + _scaled(shear, np.outer(f, s) + np.outer(s, f))


KNOWN: dict[type, Callable[[Any, Floats], Floats]] = {
    Guccione: _guccione, FungOrthotropic: _fung, TransverselyIsotropic: _transverse,
    HolzapfelGasserOgden: _artery, HolzapfelOgden: _heart,
}  # fmt: skip


def directed_stress(material: Any, axes: Floats, bulk: float) -> Stress:
    """P of F (n, 3, 3) with the axes of the material (n, 3, 3), rows f, s and n, or (1, 3, 3); K in Pa is given."""

    def stress(F: Floats) -> Floats:
        R = np.broadcast_to(axes, F.shape)
        G = F @ R.swapaxes(1, 2)  # into the axes of the material
        S = KNOWN[type(material)](material, G.swapaxes(1, 2) @ G)
        C, J = cofactor(F)
        P: Floats = G @ S @ R + _scaled(bulk * (J - 1.0), C)
        return P

    return stress
