"""First Piola-Kirchhoff stress of an energy density, by central differences of the energy.

The solver's stress is hand-written, compiled, or split into invariants; a mistake in it would make it differ from the
derivative of the material's energy. Differences need only the energy, so that they give the stress of every law,
including those of plugins. The step is a small part of the least stretch. If the error estimated from differences of
second, fourth and sixth order exceeds the rounding error, a smaller step is tried.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass

Floats = NDArray[np.float64]
Stress = Callable[[Floats], Floats]  # F (n, 3, 3) -> first Piola-Kirchhoff stress P (n, 3, 3), Pa
Scalar = Callable[[Floats], Floats]  # F (n, 3, 3) -> (n,): an energy density, Pa, or a measure of volume, no unit

EPS = float(np.finfo(np.float64).eps)
STEP = 1e-3  # of the least stretch: rounding of 2e-13 of the energy, and h^6 / 140 of its seventh derivative
LEAST = 1e-2  # least stretch for the step: flatter cells use this value
SMALLER, TIMES = 8.0, 6  # by which factor a step is divided, and how often: laws of fibres bend at strains of 1e-4
FINE = 1e-12  # relative to the stress: error below which no smaller step is tried
ORDERS = {2: (0.5, 0.0, 0.0), 4: (2 / 3, -1 / 12, 0.0), 6: (3 / 4, -3 / 20, 1 / 60)}  # Fornberg (1988), table 1
ALL = tuple(product(range(3), range(3)))


@dataclass(frozen=True)
class EnergyStress:
    """Derivative of an energy density `psi`, or of another scalar, with respect to F, by differences."""

    psi: Scalar

    def __call__(self, F: Floats) -> Floats:
        """Return P (n, 3, 3), Pa, at F (n, 3, 3).

        Raises ValueError if F is outside the law's domain or at its edge.
        """
        return self.with_error(F)[0]

    def with_error(self, F: Floats) -> tuple[Floats, Floats]:
        """Return P (n, 3, 3) and a bound of the error of its entries (n,), Pa.

        Raises ValueError if F is outside the law's domain or at its edge.
        """
        P, error = self._derivatives_with_error(F, ALL)
        return np.ascontiguousarray(P.T).reshape(F.shape), error

    def entry(self, F: Floats, i: int, J: int) -> Floats:
        """Return the entry P_iJ (n,), Pa.

        Raises ValueError if F is outside the law's domain or at its edge.
        """
        found: Floats = self._derivatives_with_error(F, ((i, J),))[0][0]
        return found

    def _derivatives_with_error(self, F: Floats, entries: tuple[tuple[int, int], ...]) -> tuple[Floats, Floats]:
        """Return the derivatives by some entries (i, J) of F (k, n), and a bound of their error (n,)."""
        f, h = np.ascontiguousarray(F.transpose(1, 2, 0)), STEP * np.clip(least_stretch(F), LEAST, 1.0)
        found, left, rounding = self._derivatives_by_steps(f, h, entries)
        for _ in range(TIMES):
            poor = ~(left <= rounding + FINE * np.abs(found).max(axis=0))  # not a number is poor too
            if not poor.any():
                break
            h = np.where(poor, h / SMALLER, h)
            again, less, more = self._derivatives_by_steps(f, h, entries)
            better = poor & ~(less + more >= left + rounding)
            found[:, better], left[better], rounding[better] = again[:, better], less[better], more[better]
        if not np.all(np.isfinite(found)):
            raise ValueError("the state is too close to the limit of the law for finite differences of the energy")
        return found, left + rounding

    def _derivatives_by_steps(
        self, f: Floats, h: Floats, entries: tuple[tuple[int, int], ...]
    ) -> tuple[Floats, Floats, Floats]:
        """Return derivatives (k, n), truncation errors (n,) and rounding errors (n,) at f (3, 3, n) by steps h (n,)."""
        g = f.copy()
        apart = np.empty((len(ORDERS), len(entries), len(h)))  # psi(F + k h) - psi(F - k h), k = 1, 2, 3
        size = curvature = np.zeros(len(h))
        with np.errstate(all="ignore"):
            for column, (i, J) in enumerate(entries):
                mean = []
                for far in range(3):
                    g[i, J] = f[i, J] + (far + 1.0) * h
                    ahead = self.psi(g.transpose(2, 0, 1))
                    g[i, J] = f[i, J] - (far + 1.0) * h
                    behind = self.psi(g.transpose(2, 0, 1))
                    apart[far, column] = ahead - behind
                    mean.append(0.5 * (ahead + behind))
                g[i, J] = f[i, J]
                size = np.maximum(size, np.abs(mean[2]) + np.abs(apart[2, column]))
                curvature = np.maximum(curvature, np.abs(mean[2] - mean[0]))
            second, fourth, sixth = (np.tensordot(w, apart, 1) / h for w in ORDERS.values())
            lower, higher = np.abs(fourth - second).max(axis=0), np.abs(sixth - fourth).max(axis=0)
            # orders go on as they began, at worst half as well: a law that bends within the step has no more orders
            left = np.where(higher > 0.0, higher * np.minimum(1.0, np.sqrt(higher / lower)), 0.0)
            size_of_F = np.abs(f).max(axis=(0, 1))
            rounding = EPS * (size / h + size_of_F * (np.abs(sixth).max(axis=0) / h + 0.25 * curvature / h**2))
        return sixth, left, rounding


def least_stretch(F: Floats) -> Floats:
    """Return a lower bound of the smallest principal stretch (n,): |det F| over the norm of its cofactor."""
    a, b, c = F[:, :, 0], F[:, :, 1], F[:, :, 2]
    sides = np.cross(b, c), np.cross(c, a), np.cross(a, b)
    norm = np.sqrt(sum(np.einsum("ni,ni->n", s, s) for s in sides))
    with np.errstate(divide="ignore", invalid="ignore"):
        found: Floats = np.nan_to_num(np.abs(np.einsum("ni,ni->n", a, sides[0])) / norm)
    return found


def stress_with_error(stress: Stress, F: Floats) -> tuple[Floats, Any]:
    """Return P (n, 3, 3), Pa, at F (n, 3, 3), and the error of its entries, Pa.

    The error is (n,) if the stress is computed by differences of an energy, and 0 if it is computed by a formula.
    """
    own = getattr(stress, "with_error", None)
    return (stress(F), 0.0) if own is None else own(F)


@dataclass(frozen=True)
class PlaneStressLaw:
    """Plane stress of a solid's law: the stretch along z is the solution of P33 = 0.

    The solution is found by bisection, after a search from 1 outward for a sign change of P33.
    """

    solid: Stress

    def __call__(self, F: Floats) -> Floats:
        """Return P (n, 3, 3), Pa, at F (n, 3, 3).

        Raises ValueError if no stretch makes P33 zero.
        """
        return self.with_error(F)[0]

    def with_error(self, F: Floats) -> tuple[Floats, Any]:
        """Return P (n, 3, 3) and the error of its entries, Pa.

        Raises ValueError if no stretch makes P33 zero.
        """
        low, high, step = np.ones(len(F)), np.ones(len(F)), 1.25
        for _ in range(40):
            pulled, pushed = self._transverse_stress(F, low) > 0.0, self._transverse_stress(F, high) < 0.0
            if not (pulled.any() or pushed.any()):
                break
            low, high = np.where(pulled, low / step, low), np.where(pushed, high * step, high)
        else:
            raise ValueError("no thickness change makes the plate free of normal stress")
        for _ in range(60):
            middle = 0.5 * (low + high)
            up = self._transverse_stress(F, middle) < 0.0
            low, high = np.where(up, middle, low), np.where(up, high, middle)
        G = F.copy()
        G[:, 2, 2] = 0.5 * (low + high)
        P, error = stress_with_error(self.solid, G)
        P[:, 2, 2] = 0.0
        return P, error

    def _transverse_stress(self, F: Floats, s: Floats) -> Floats:
        """Return P33 (n,), Pa, at stretches s (n,) along z."""
        G = F.copy()
        G[:, 2, 2] = s
        entry = getattr(self.solid, "entry", None)
        found: Floats = self.solid(G)[:, 2, 2] if entry is None else entry(G, 2, 2)
        return found
