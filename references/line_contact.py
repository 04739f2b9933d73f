"""Frictionless line contact of a rigid cylinder with a strip in plane strain: half-width, pressure and depth.

Hertz: a = sqrt(4 P R / (pi E*)), p = 2 P / (pi a) sqrt(1 - x^2/a^2), for the force P per length. The depth d depends on
the thickness of the strip. With L(w) of `layer_integral_equation`,

    (2 / (pi E*)) int p(s) G((x - s)/h) ds = d - x^2 / (2 R),   G(y) = int_0^oo L(w) cos(w y) / w dw
                                                                     = ln(1 + 1/y^2) / 2 + a smooth function,

where p is sqrt(1 - (x/a)^2) times a polynomial, collocated at Chebyshev points.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING

from softmark.records import dataclass
from softmark.references.half_space_indentation import Surroundings
from softmark.references.indentation import WIDE, Indentation, require_distance
from softmark.references.layer_integral_equation import FARTHEST, THINNEST, base_stiffening
from softmark.references.straight_cantilever import NotApplicable, Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np

TERMS = 12  # terms of the even polynomial
POINTS = 48  # quadrature points for the smooth part


def half_width(force: float, radius: float, modulus: float) -> float:
    """Return Hertz's half-width of contact a, m.

    The force is per length, N/m; the modulus is the contact modulus, Pa.
    """
    return math.sqrt(4.0 * force * radius / (math.pi * modulus))


@dataclass(frozen=True)
class Strip:
    """Strip in plane strain, indented by a cylinder to a given depth. SI units, forces per length.

    The strip is bonded to its base or slides on it.
    """

    radius: float  # m, of the cylinder
    depth: float  # m
    young: float  # Pa
    poisson: float  # 1
    thickness: float  # m
    bonded: bool

    @property
    def modulus(self) -> float:
        """Contact modulus E* = E / (1 - nu^2), Pa."""
        return self.young / (1.0 - self.poisson**2)

    @cached_property
    def _base_kernel_quadrature(self) -> tuple[Array, Array]:
        """Quadrature points w (m,), and their weights times (exp(-w) - (1 - L)) / w (m,)."""
        x, weights = np.polynomial.legendre.leggauss(160)
        last = 1.5 * FARTHEST  # of exp(-w)
        w = 0.5 * last * (x + 1.0)
        return w, 0.5 * last * weights * (np.exp(-w) - base_stiffening(w, self.poisson, self.bonded)) / w

    def _depth_and_coefficients(self, a: float) -> tuple[float, Array]:
        """Return the depth, m, and the coefficients (n,), Pa, of U_0, U_2, ... in the pressure.

        a is the half-width of contact, m.
        """
        n = TERMS
        x = np.cos(math.pi * (np.arange(n + 1) + 0.5) / (2 * (n + 1)))
        theta = math.pi * (np.arange(POINTS) + 0.5) / POINTS
        s, c = np.cos(theta), np.sin(theta)
        w, base = self._base_kernel_quadrature
        y = a / self.thickness
        apart = x[:, None] - s[None, :]
        smooth = (np.cos(y * np.outer(x, w)) * base) @ np.cos(y * np.outer(w, s))
        smooth = smooth + (np.sin(y * np.outer(x, w)) * base) @ np.sin(y * np.outer(w, s))
        smooth += 0.5 * np.log1p((y * apart) ** 2) - math.log(y)
        system, right = np.zeros((n + 1, n + 1)), 0.5 * a**2 * x**2 / self.radius
        turn = np.arccos(x)
        for k in range(n):
            even = 2 * k
            weight = math.pi / POINTS * c * np.sin((even + 1) * theta)  # sqrt(1 - s^2) U ds
            log = -math.pi * math.log(2.0) if even == 0 else -math.pi / even * np.cos(even * turn)
            log = 0.5 * (log + math.pi / (even + 2) * np.cos((even + 2) * turn))
            system[:, k] = -2.0 * a / (math.pi * self.modulus) * (smooth @ weight - log)
        system[:, n] = 1.0
        found: Array = np.asarray(np.linalg.solve(system, right), dtype=np.float64)
        return float(found[n]), found[:n]

    @cached_property
    def half(self) -> float:
        """Half-width of contact, m. Raises NotApplicable if it is too large compared with the thickness."""
        if self.depth <= 0.0:
            return 0.0
        low, high = 0.0, min(2.5 * math.sqrt(2.0 * self.radius * self.depth), THINNEST * self.thickness)
        if self._depth_and_coefficients(high)[0] < self.depth:
            raise NotApplicable("the contact half-width is too large relative to the thickness", "reduce the depth")
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self._depth_and_coefficients(middle)[0] < self.depth else (low, middle)
        return 0.5 * (low + high)

    @cached_property
    def _pressure_coefficients(self) -> Array:
        return self._depth_and_coefficients(self.half)[1]

    @property
    def force(self) -> float:
        """Force per length, N/m."""
        return float(0.5 * math.pi * self.half * self._pressure_coefficients[0]) if self.depth > 0.0 else 0.0

    def pressure(self, x: Array) -> Array:
        """Return the contact pressure (n,), Pa, at distances x from the centre (n,), m."""
        t = np.asarray(x, dtype=float) / (self.half or 1.0)
        inside = (np.abs(t) < 1.0) & (self.depth > 0.0)
        turn = np.arccos(np.where(inside, t, 0.0))
        found = (
            sum(b * np.sin((2 * k + 1) * turn) for k, b in enumerate(self._pressure_coefficients))
            if inside.any()
            else 0.0 * t
        )
        return np.where(inside, found, 0.0)


@dataclass(frozen=True)
class LineContact:
    """Line contact of a cylinder with a slice of a body in plane strain. SI units.

    Forces and areas are those of the slice.
    """

    strip: Strip
    slice: float  # m
    at: Vector
    around: Surroundings

    @property
    def gap(self) -> float:
        """Remaining gap, m; 0 in contact."""
        return max(-self.strip.depth, 0.0)

    @property
    def push(self) -> float:
        """Force into the body, N."""
        return self.slice * self.strip.force

    @property
    def radius(self) -> float:
        """Hertz's half-width of contact for this force, m."""
        return half_width(self.strip.force, self.strip.radius, self.strip.modulus)

    @property
    def area(self) -> float:
        """Contact area, m^2."""
        return 2.0 * self.slice * self.radius

    @property
    def largest_pressure(self) -> float:
        """Largest contact pressure 2 P / (pi a), Pa."""
        return 2.0 * self.strip.force / (math.pi * self.radius) if self.radius else 0.0

    def pressure(self, x: Array) -> Array:
        """Return the contact pressure (n,), Pa, at distances x from the centre (n,), m."""
        t = np.minimum(np.abs(np.asarray(x, dtype=float)) / (self.radius or 1.0), 1.0)
        found: Array = self.largest_pressure * np.sqrt(1.0 - t**2)
        return found

    @property
    def relative_errors(self) -> dict[str, float]:
        """Estimated relative errors of the theory, by name of the effect that it neglects.

        `pressure`: finite thickness of the strip, as the relative difference of the largest pressure from that of its
        integral equation. `depth`: depth of the indentation divided by the radius of the cylinder. `sides`: finite
        width of
        the body, as an order of magnitude of the relative error of the force.
        """
        if self.strip.depth <= 0.0:
            return {"depth": 0.0, "pressure": 0.0, "sides": 0.0}
        at_middle = float(self.strip.pressure(np.zeros(1))[0])
        return {
            "depth": self.strip.depth / self.strip.radius,
            "pressure": at_middle / self.largest_pressure - 1.0,
            "sides": -math.exp(-2.0 * self.around.width / self.strip.thickness),  # an order of magnitude
        }

    displacement = None

    @property
    def estimated_error(self) -> float:
        """Rounding error of the indentation depth for the given force, m."""
        return 1e-10 * abs(self.strip.depth)


def solve_line_contact(pressed: Indentation) -> LineContact:
    """Return the solution for a cylinder along z that indents a slice in plane strain. Raises NotApplicable."""
    p = pressed
    assert p.slice is not None
    if math.isinf(p.around.thickness):
        raise NotApplicable("no face opposite to the contact is held", "hold the opposite face")
    strip = Strip(p.size, p.depth, p.young, p.poisson, p.around.thickness, p.around.bonded)
    require_distance(strip.half, p.around.width, "the nearest free side", WIDE, "use a wider body")
    return LineContact(strip, p.slice, p.at, p.around)
