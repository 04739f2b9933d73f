"""Contracts of constitutive laws, tested with moduli near 1 Pa, where wrong digits show."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from softmark.interpreter.cli.conformance import Breach

STEP = 1e-6  # step of central differences
NEAR = 1e-6  # tolerance of finite differences: step squared, and rounding divided by step
EXACT = 1e-9  # tolerance of zero or equal values
ROUNDS = 4  # random states, each near rest


def law_breaches(law: Any, mu: float, lam: float) -> Iterator[Breach]:
    """Yield breaches of a constitutive law with functions psi(F), P(F) and dPdF(F) of F (n, 3, 3).

    The moduli of the law are near 1 Pa; `mu` and `lam` are its Lamé constants in the undeformed state, Pa.
    """
    with np.errstate(all="ignore"):
        rest = np.eye(3)[None]
        turn = _rotation(0.7)
        F = rest + 0.15 * np.random.default_rng(1).uniform(-1.0, 1.0, (ROUNDS, 3, 3))
        psi, P, A = (np.asarray(f(F)) for f in (law.psi, law.P, law.dPdF))
        if psi.shape != (ROUNDS,) or P.shape != (ROUNDS, 3, 3) or A.shape != (ROUNDS, 3, 3, 3, 3):
            shapes = f"{psi.shape}, {P.shape}, {A.shape}"
            yield Breach(
                f"for F of shape (4, 3, 3), psi, P and dPdF have the shapes {shapes}",
                "return the shapes (n,), (n, 3, 3), (n, 3, 3, 3, 3)",
            )
            return
        if not all(np.isfinite(one).all() for one in (psi, P, A)):
            yield Breach(
                "it is not finite at a strain of 0.15", "check logarithms and roots for arguments that are not positive"
            )
            return
        if abs(float(law.psi(rest)[0])) > EXACT or np.abs(law.P(rest)).max() > EXACT:
            yield Breach("it has an energy or a stress in the undeformed state", "subtract psi and P at F = 1")
        by_psi, by_P = np.zeros_like(P), np.zeros_like(A)
        for i, J in np.ndindex(3, 3):
            d = np.zeros((1, 3, 3))
            d[0, i, J] = STEP
            by_psi[:, i, J] = (law.psi(F + d) - law.psi(F - d)) / (2.0 * STEP)
            by_P[:, :, :, i, J] = (law.P(F + d) - law.P(F - d)) / (2.0 * STEP)
        yield from _derivative_breaches("P is not the derivative of psi", P, by_psi)
        yield from _derivative_breaches("dPdF is not the derivative of P", A, by_P)
        if np.abs(law.psi(turn @ F) - psi).max() > EXACT * max(1.0, np.abs(psi).max()):
            yield Breach("a rotation changes its energy", "let psi depend on F only through C = F^T F")
        yield from _moduli_breaches(np.asarray(law.dPdF(rest))[0], mu, lam)


def _derivative_breaches(what: str, own: Any, by_differences: Any) -> Iterator[Breach]:
    off = float(np.abs(own - by_differences).max() / max(1.0, np.abs(own).max()))
    if off > NEAR:
        yield Breach(f"{what}: off by {off:.1e}", "differentiate it again; check constants that are not whole numbers")


def _moduli_breaches(A: Any, mu: float, lam: float) -> Iterator[Breach]:
    I = np.eye(3)
    right = lam * np.einsum("iJ,kL->iJkL", I, I)
    right = right + mu * (np.einsum("ik,JL->iJkL", I, I) + np.einsum("iL,Jk->iJkL", I, I))
    off = float(np.abs(A - right).max() / np.abs(right).max())
    if off > NEAR:
        yield Breach(f"its initial stiffness is not that of Hooke's law with `young` and `poisson`: off by {off:.1e}",
                     "make its second derivative at F = 1 that of the moduli mu and lam")  # fmt: skip


def _rotation(angle: float) -> Any:
    """Return the matrix (3, 3) of a rotation by `angle`, rad, about the axis (1, 1, 1)."""
    k = np.array([[0.0, -1.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 1.0, 0.0]]) / 3.0**0.5
    return np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * (k @ k)
