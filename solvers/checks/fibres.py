"""Stresses of materials that know directions, written out once more: by S = 2 dpsi/dC, in axes along the fibres.

What solves adds up derivatives of invariants by F, component by component. Here F is turned into the axes of the
material, the second Piola-Kirchhoff stress is made of right Cauchy-Green tensors and their inverses, and turned back.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.checks.pressures import Split
from softmark.solvers.checks.solids import CheckedBody, Floats, Ints, Stress, StressTerm, cofactor, shape
from softmark.solvers.materials.fung_orthotropic import FungOrthotropic
from softmark.solvers.materials.guccione import Guccione
from softmark.solvers.materials.holzapfel_gasser_ogden import HolzapfelGasserOgden
from softmark.solvers.materials.holzapfel_ogden import HolzapfelOgden
from softmark.solvers.materials.transversely_isotropic import TransverselyIsotropic

Axes = Callable[[Floats], Floats]  # of points (n, 3), m: rows f, s and f x s (n, 3, 3)
EYE = np.eye(3)


# ------------------------------------------------------------------ S of C (n, 3, 3) in the axes of the material


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


def known(material: Any) -> bool:
    """Whether there are formulas for it."""
    return type(material) in KNOWN


def stress_of(material: Any, axes: Floats, bulk: float) -> Stress:
    """P of F (n, 3, 3) with the axes of the material (n, 3, 3), rows f, s and n, or (1, 3, 3); K in Pa is given."""

    def stress(F: Floats) -> Floats:
        R = np.broadcast_to(axes, F.shape)
        G = F @ R.swapaxes(1, 2)  # into the axes of the material
        S = KNOWN[type(material)](material, G.swapaxes(1, 2) @ G)
        C, J = cofactor(F)
        P: Floats = G @ S @ R + _scaled(bulk * (J - 1.0), C)
        return P

    return stress


def pull_of(tension: Floats, f: Floats) -> Stress:
    """What muscle of tensions (n,) adds to P of F (n, 3, 3), along fibres f (n, 3), of any length: F T f (x) f."""
    unit = f / np.linalg.norm(f, axis=1, keepdims=True)
    S = tension[:, None, None] * unit[:, :, None] * unit[:, None, :]
    return lambda F: F @ S


def shortened(stress: Stress, s: Floats, f: Floats) -> Stress:
    """P of F (n, 3, 3) of what is at rest where fibres f (n, 3), of any length, are shorter by parts s (n,).

    Of the stress of its law, by eigenvalues of what the muscle does by itself: det Fa P(F Fa^-1) Fa^-T.
    """
    f = f / np.linalg.norm(f, axis=1, keepdims=True)
    dyads = f[:, :, None] * f[:, None, :]
    each = np.log1p(-s)[:, None, None] * (1.5 * dyads - 0.5 * EYE)  # without a trace: it keeps the volume
    values, vectors = np.linalg.eigh(each)
    Fa = (vectors * np.exp(values)[:, None, :]) @ vectors.swapaxes(1, 2)
    back = np.linalg.inv(Fa)
    return lambda F: np.linalg.det(Fa)[:, None, None] * stress(F @ back) @ back.swapaxes(1, 2)


def split_of(material: Any, axes: Floats) -> Split:
    """What a pressure takes of K (J - 1)^2 / 2: all but a third of the shear modulus, or half of it."""
    third, K = material.shear_modulus / 3.0, material.bulk
    kept = third if K is None else min(third, 0.5 * K)
    compliance = 0.0 if K is None else 1.0 / (K - kept)

    def swelling(F: Floats) -> Floats:
        return cofactor(F)[1] - 1.0

    return Split(stress_of(material, axes, kept), swelling, lambda F: cofactor(F)[0], swelling, compliance)


@dataclass(frozen=True)
class DirectedBody(CheckedBody):
    """A body whose material knows directions: `at` tells its stress at points (n, 3), m."""

    at: Callable[[Floats], Stress] | None = None

    def _stress(self, cells: Ints, term: StressTerm, F: Floats, at: slice) -> Floats:
        if self.at is None:
            raise TypeError("a material without its directions")
        X = (shape(self.kind, self._rule(at)[0]) @ self.points[cells]).reshape(-1, 3)
        return self.at(X)(F)
