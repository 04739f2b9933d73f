"""Integral equation of a layer on a rigid base, indented by a rigid body of revolution without friction.

Strain is small. The surface displacement of a layer under a pressure p, by Hankel's transform, with w = k h, is

    u(k) = (2/E*) L(w) p(k) / k;   bonded L = (2 c sinh 2w - 4w) / (2 c cosh 2w + 1 + c^2 + 4w^2), c = 3 - 4 nu,
                                   sliding L = (cosh 2w - 1) / (sinh 2w + 2w);         a half-space: L = 1.

This leads to Fredholm's equation of the second kind for the shape of the tip (Lebedev and Ufliand 1958, PMM 22:442;
Hayes et al. 1972, J Biomech 5:541), with the tip's c t^n of `half_space_indentation`,

    y(t) - (1/pi) int_0^a y(s) (K(t + s) + K(t - s)) ds = (E*/pi) (d - c t^n),
    K(x) = int_0^oo (1 - L) cos(w x/h) dw / h,

where y(a) = 0 unless the tip has an edge. The force is 2 pi int y dt.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING

from softmark.records import dataclass
from softmark.references.half_space_indentation import Tip
from softmark.references.straight_cantilever import NotApplicable

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np

POINTS = 32  # Gauss-Legendre points over the contact radius
FARTHEST = 24.0  # w beyond which 1 - L is below rounding
THINNEST = 6.0  # radius of contact over thickness, up to which the points above are enough
CLOSEST = 1e-13  # relative, of the radius of contact


def base_stiffening(w: Array, poisson: float, bonded: bool) -> Array:
    """Return 1 - L (n,) for w > 0 (n,): the relative reduction of a half-space's surface displacement by the base."""
    if not bonded:
        sliding: Array = 1.0 - (np.cosh(2.0 * w) - 1.0) / (np.sinh(2.0 * w) + 2.0 * w)
        return sliding
    c = 3.0 - 4.0 * poisson
    rest = 1.0 + c**2 + 4.0 * w**2
    found: Array = (2.0 * c * np.exp(-2.0 * w) + rest + 4.0 * w) / (2.0 * c * np.cosh(2.0 * w) + rest)
    return found


@dataclass(frozen=True)
class Layer:
    """Layer indented by a tip to a given depth. SI units.

    Raises NotApplicable if the layer is too thin for the contact radius.
    """

    tip: Tip
    depth: float  # m, that the tip has moved since it touched
    young: float  # Pa
    poisson: float  # 1
    thickness: float  # m
    bonded: bool  # to its base; else it slides on it

    @property
    def modulus(self) -> float:
        """Contact modulus E* = E / (1 - nu^2), Pa."""
        return self.young / (1.0 - self.poisson**2)

    @cached_property
    def _gauss_rule(self) -> tuple[Array, Array]:
        x, w = np.polynomial.legendre.leggauss(POINTS)
        return 0.5 * (x + 1.0), 0.5 * w

    @cached_property
    def _base_kernel_quadrature(self) -> tuple[Array, Array]:
        """Quadrature points w (m,), and their weights times 1 - L (m,)."""
        x, weights = np.polynomial.legendre.leggauss(120)
        w = 0.5 * FARTHEST * (x + 1.0)
        return w, 0.5 * FARTHEST * weights * base_stiffening(w, self.poisson, self.bonded)

    def _solve_at_radius(self, a: float) -> tuple[Array, Array]:
        """Return two solutions y (n + 1,), at the quadrature points and last at the contact radius a.

        The first is for a depth of 1 m, Pa, the second for -c t^n, Pa m.
        """
        x, weights = self._gauss_rule
        t = a * np.append(x, 1.0)
        w, base = self._base_kernel_quadrature
        waves = np.cos(np.outer(t / self.thickness, w))
        kernel = 2.0 * (waves * base) @ waves[:-1].T / self.thickness  # cos(x + y) + cos(x - y) = 2 cos x cos y
        system = np.eye(len(t))
        system[:, :-1] -= kernel * (a * weights) / math.pi
        right = np.stack([np.ones(len(t)), -self.tip.at(t)], axis=1)
        found: Array = np.asarray(np.linalg.solve(system, right) * self.modulus / math.pi, dtype=np.float64)
        return found[:, 0], found[:, 1]

    @cached_property
    def radius(self) -> float:
        """Contact radius a, m, at which y(a) = 0. Raises NotApplicable."""
        if self.depth <= 0.0:
            return 0.0
        if self.tip.edge is not None:
            return self._check_contact_radius(self.tip.edge)
        low, high = self.tip.radius(self.depth) * 0.2, self.tip.radius(self.depth) * 2.5
        self._check_contact_radius(0.4 * high)
        while high - low > CLOSEST * high:
            middle = 0.5 * (low + high)
            one, other = self._solve_at_radius(middle)
            low, high = (middle, high) if self.depth * one[-1] + other[-1] > 0.0 else (low, middle)
        return self._check_contact_radius(low)

    def _check_contact_radius(self, a: float) -> float:
        if a > THINNEST * self.thickness:
            raise NotApplicable(f"the contact radius is {a / self.thickness:.3g} times the thickness",
                          "use a thicker layer or a smaller depth")  # fmt: skip
        return a

    @cached_property
    def _solution_values(self) -> Array:
        one, other = self._solve_at_radius(self.radius)
        found: Array = self.depth * one + other
        return found

    @property
    def push(self) -> float:
        """Force into the layer, N."""
        if self.depth <= 0.0:
            return 0.0
        return float(2.0 * math.pi * self.radius * self._gauss_rule[1] @ self._solution_values[:-1])

    @property
    def area(self) -> float:
        """Contact area, m^2."""
        return math.pi * self.radius**2

    @property
    def largest_pressure(self) -> float:
        """Largest contact pressure, Pa: at the centre for a sphere, infinite for other tips."""
        if self.depth <= 0.0:
            return 0.0
        return float(self.pressure(np.zeros(1))[0]) if self.tip.power == 2 else math.inf

    def pressure(self, r: Array) -> Array:
        """Return the contact pressure (n,), Pa, at distances r from the axis (n,), m.

        It is y(a) / sqrt(a^2 - r^2) - int_r^a y'(t) / sqrt(t^2 - r^2) dt.
        """
        r, a = np.abs(np.asarray(r, dtype=float)), self.radius
        if a == 0.0:
            return np.zeros_like(r)
        t = a * self._gauss_rule[0]
        # y minus the half-space solution is even and smooth
        smooth = self._solution_values - self.modulus / math.pi * (
            self.depth - self.tip.at(a * np.append(self._gauss_rule[0], 1.0))
        )
        even = np.polynomial.chebyshev.Chebyshev.fit((t / a) ** 2, smooth[:-1], 12, domain=[0.0, 1.0]).deriv()
        inside = r < a
        s, weights = self._gauss_rule
        found = np.zeros_like(r)
        for i in np.flatnonzero(inside):
            v = s * math.sqrt(1.0 - (r[i] / a) ** 2)  # v^2 = (t^2 - r^2) / a^2: t' / sqrt(t^2 - r^2) dt = dv a / t
            x = (r[i] / a) ** 2 + v**2
            found[i] = -2.0 / a * math.sqrt(1.0 - (r[i] / a) ** 2) * float(weights @ even(x))
            if self.tip.edge is not None:
                found[i] += self._solution_values[-1] / math.sqrt(a**2 - r[i] ** 2)
        with np.errstate(divide="ignore", invalid="ignore"):
            own = {
                2: 2.0 * self.tip.rate * np.sqrt(np.maximum(a**2 - r**2, 0.0)),
                1: self.tip.rate * np.arccosh(np.maximum(a / r, 1.0)),
                0: 0.0 * r,
            }[self.tip.power]
        return np.where(inside, found + self.modulus / math.pi * own, 0.0)

    def surface_displacement(self, r: float) -> float:
        """Return the downward displacement of the surface, m, at a distance r from the axis, m, far from the contact.

        It is P / (pi E*) (1 / r - int_0^oo (1 - L) J0(w r/h) dw / h), with the force P as a point load.
        """
        from scipy.special import j0

        w, base = self._base_kernel_quadrature
        taken = float(base @ j0(w * r / self.thickness)) / self.thickness
        return self.push / (math.pi * self.modulus) * (1.0 / r - taken)
