"""Inflation of a thick-walled sphere of incompressible rubber by an inner pressure.

States beyond the pressure maximum are included.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.beam_centre_line import as_points
from softmark.references.reference_base import Reference
from softmark.references.rubber_energies import Rubber, require_incompressible
from softmark.references.straight_cantilever import NotApplicable, Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np

POINTS = 64  # Gauss-Legendre points across the wall: smooth integrands to rounding
LARGEST, STEP = 50.0, 0.002  # stretch of the hollow up to which the path is looked at, and by which of its logarithm
HALVINGS = 200
ROUNDING = 16.0 * 2.0**-52  # relative, of a pressure


@dataclass(frozen=True)
class BlownBall:
    """Thick-walled sphere of incompressible rubber under an inner pressure p. SI units.

    The inner radius A is stretched by l, and a point at radius R moves to r, r^3 = R^3 + (l^3 - 1) A^3; B is the outer
    radius. Equilibrium of the wall, dt_r/dr = (t_theta - t_r) 2 / r, gives with s = r/R

        p = int from m to l of 2 (t_theta - t_r) / (s (s^3 - 1)) ds, m^3 = 1 + (l^3 - 1) A^3/B^3,

    and for W(s^-2, s, s) the stress difference is s W'(s) / 2. The state is the first with this pressure on the path
    from rest. Raises NotApplicable if no state has this pressure, or if the body is not of that kind.
    """

    inner: float  # m, A
    outer: float  # m, B
    rubber: Rubber
    poisson: float  # 1
    pressure: float  # Pa
    centre: Vector  # m

    def __post_init__(self) -> None:
        if not (math.isfinite(self.outer) and 0.0 < self.inner < self.outer):
            raise NotApplicable(
                f"the radii are {self.inner:g} and {self.outer:g}",
                "the inner radius must be smaller than the outer one",
            )
        require_incompressible(self.poisson)
        if not (math.isfinite(self.pressure) and self.pressure > 0.0):
            raise NotApplicable(
                f"the pressure is {self.pressure:g} Pa", "it must be an inner pressure, positive outward"
            )

    def at(self, e: Array) -> Array:
        """Return the pressures (n,), Pa, at logarithms e of the inner stretch (n,); NaN beyond the law's domain."""
        least = np.log1p(np.expm1(3.0 * e) * (self.inner / self.outer) ** 3) / 3.0
        x, w = self._gauss_rule
        half = 0.5 * (e - least)
        s = (least + half)[:, None] + half[:, None] * x
        tensions = self.rubber.tensions(np.stack([-2.0 * s, s, s]).reshape(3, -1))
        across = (tensions[1] - tensions[0]).reshape(s.shape)
        found: Array = half * ((2.0 * across / np.expm1(3.0 * s)) @ w)
        return found

    @cached_property
    def _gauss_rule(self) -> tuple[Array, Array]:
        return np.polynomial.legendre.leggauss(POINTS)

    def _pressure_at_log(self, e: float) -> float:
        return float(self.at(np.array([e]))[0])

    @cached_property
    def path(self) -> tuple[Array, Array]:
        """Logarithms of the inner stretch, from rest outward, and pressures, Pa, up to the end of the law's domain."""
        e = np.arange(STEP, math.log(LARGEST), STEP)
        with np.errstate(all="ignore"):
            p = self.at(e)
        known = np.isfinite(p)
        end = len(p) if known.all() else int(np.argmin(known))
        return e[:end], p[:end]

    @cached_property
    def limit(self) -> tuple[float, float] | None:
        """Inner stretch and pressure, Pa, at the first pressure maximum; None if the pressure always increases."""
        e, p = self.path
        falls = np.flatnonzero(p[1:] < p[:-1])
        if not len(falls):
            return None
        low, high = float(e[max(falls[0] - 1, 0)]), float(e[min(falls[0] + 1, len(e) - 1)])
        for _ in range(HALVINGS):  # thirds
            a, b = low + (high - low) / 3.0, high - (high - low) / 3.0
            if not low < a < b < high:
                break
            low, high = (a, high) if self._pressure_at_log(a) < self._pressure_at_log(b) else (low, b)
        top = 0.5 * (low + high)
        return math.exp(top), self._pressure_at_log(top)

    @cached_property
    def opened(self) -> float:
        """Logarithm of the inner stretch in the first state that has the given pressure. Raises NotApplicable."""
        e, p = self.path
        above = np.flatnonzero(p >= self.pressure)
        limit = self.limit
        if limit is not None and limit[1] >= self.pressure and (not len(above) or math.log(limit[0]) < e[above[0]]):
            low, high = 0.0, math.log(limit[0])
        elif len(above):
            low, high = (float(e[above[0] - 1]) if above[0] else 0.0), float(e[above[0]])
        else:
            most = float(p.max()) if len(p) else 0.0
            raise NotApplicable(
                f"no state has a pressure of {self.pressure:g} Pa", f"the largest pressure is {most:.6g} Pa"
            )
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            if not low < middle < high:
                break
            low, high = (middle, high) if self._pressure_at_log(middle) < self.pressure else (low, middle)
        return 0.5 * (low + high)

    @property
    def stretch(self) -> float:
        """Stretch l of the inner radius."""
        return math.exp(self.opened)

    @property
    def estimated_error(self) -> float:
        """Error of the deformed inner radius, m, due to rounding; it is large near a pressure maximum."""
        e = self.opened
        slope = (self._pressure_at_log(e + 1e-5) - self._pressure_at_log(e - 1e-5)) / 2e-5
        least = ROUNDING * self.outer * self.stretch
        return least + ROUNDING * abs(self.pressure / slope) * self.inner * self.stretch if slope else math.inf

    def displacement(self, X: Array) -> Array:
        """Return displacements (n, 3), m, of points X (n, 3) of the undeformed body. Raises NotApplicable."""
        away = as_points(X) - np.asarray(self.centre)
        R = np.linalg.norm(away, axis=1)
        more = math.expm1(3.0 * self.opened) * self.inner**3
        grown = np.expm1(np.log1p(more / R**3) / 3.0)
        found: Array = grown[:, None] * away
        return found


@dataclass(frozen=True)
class Inflation(Reference):
    """Inflation of a thick-walled sphere of incompressible rubber by an inner pressure.

    It is the first state with that pressure on the path from rest. For many laws the pressure has a maximum, beyond
    which the sphere grows while the pressure falls, and often a minimum, after which it rises again. A pressure above
    the maximum is reached only on that last branch, which `static(path = arc_length)` can follow; the report gives the
    `limit` of both. It applies to a `spherical_shell(part = octant)`, or a revolved `quarter_ring` of circles, held by
    `symmetric` on its planes, with `poisson = 0.5`, of `neo_hookean`, `mooney_rivlin`, `ogden`, `yeoh`, `gent`, `fung`,
    `veronda_westmann` or `arruda_boyce`, and one `pressure` on all of its hollow.
    Source: Green and Shield 1950, Finite elastic deformation of incompressible isotropic bodies, Proc. R. Soc. A 202,
    407-419; Ogden 1984, Non-linear elastic deformations, section 5.3.
    """

    body: Annotated[Any, "body", "spherical shell"]

    problem_kind: ClassVar[str] = "inflation"
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Green and Shield 1950, Proc. R. Soc. A 202, 407-419; Ogden 1984, section 5.3"
    error_meaning: ClassVar[str] = "rounding of the displacement, m: one integral, by Gauss's rule to rounding"

    def solve(self, ball: BlownBall) -> BlownBall:
        """Return the sphere itself, whose class contains the solution.

        Raises NotApplicable if no state has this pressure.
        """
        ball.opened  # noqa: B018
        return ball
