"""Straight bar whose stiffness varies along its axis, under axial load, by numerical integration."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.beam_centre_line import as_points
from softmark.references.reference_base import Reference
from softmark.references.straight_cantilever import NotApplicable, Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np

Along = Callable[["Array"], "Array"]  # a constant at distances s (n,) from the held end, m

PANELS = 64  # pieces of the bar, each integrated by itself
POINTS = 10  # Gauss points in a piece
TIGHT = 1e-12  # relative tolerance of the checking quadrature
MOST = 400  # pieces into which it may cut the bar
LOOSE = 1e-2  # relative: a larger difference of two quadratures is an error; a smaller one is stated
ROUNDING = 64.0 * 2.0**-52


@dataclass(frozen=True)
class PulledBar:
    """Bar of constant section, held at one end, whose material constants vary only along its axis. SI units.

    The axial force N(s) = F + g A int_s^L rho dt is in equilibrium at every section. Without lateral contraction each
    section keeps its shape, so that u(s) = int_0^s N / (E A) dt is the exact solution of small strain in three
    dimensions. Raises NotApplicable if the bar is not of that kind.
    """

    length: float  # m
    area: float  # m^2
    root: Vector  # m, the centre of the held end
    axis: Vector  # unit vector, from the held end to the free one
    force: float  # N, of the free end along the axis
    pull: float  # m/s^2, along the axis
    young: Along  # Pa
    density: Along  # kg/m^3
    poisson: float  # 1

    def __post_init__(self) -> None:
        for name, value in (("length", self.length), ("section", self.area)):
            if not (math.isfinite(value) and value > 0.0):
                raise NotApplicable(f"the {name} is {value:g}", "it must be positive")
        if self.poisson != 0.0:
            raise NotApplicable(
                f"with a Poisson's ratio of {self.poisson:g} sections contract by different amounts",
                "if E varies along the bar, the stress is uniaxial only with `poisson = 0`",
            )
        if not (self.force or self.pull):
            raise NotApplicable(
                "no load acts along the axis of the bar", "declare a traction on its free end, or gravity along it"
            )

    def strain(self, s: Array) -> Array:
        """Return the axial strain N / (E A) (n,) at distances s (n,), m, from the held end."""
        flat = np.ravel(s)
        E = self.young(flat)
        if not (np.isfinite(E).all() and (E > 0.0).all()):
            raise NotApplicable("its Young's modulus is not positive everywhere", "check its range")
        carried = self.force + (self.pull * self.area * self._mass_beyond(flat) if self.pull else 0.0)
        found: Array = (carried / (E * self.area)).reshape(np.shape(s))
        return found

    def _mass_beyond(self, s: Array) -> Array:
        """Return the mass per area beyond s, int_s^L rho dt (n,), kg/m^2."""
        whole = _cumulative_integral(self.density, self.length, np.array([self.length]))
        found: Array = whole - _cumulative_integral(self.density, self.length, s)
        return found

    def stretched(self) -> StretchedBar:
        """Return the solution. Raises NotApplicable if its integrals cannot be computed."""
        from scipy import integrate  # adaptive, and no code of the panels: it checks them

        whole = float(_cumulative_integral(self.strain, self.length, np.array([self.length]))[0])
        again, left, *_ = integrate.quad(
            lambda s: float(self.strain(np.array([s]))[0]), 0.0, self.length, epsrel=TIGHT, epsabs=0.0, limit=MOST,
            full_output=1,
        )  # fmt: skip
        apart = abs(whole - float(again)) + float(left)
        if not apart <= LOOSE * abs(again):
            reason = f"two quadratures of its strain differ by a fraction of {apart / abs(again):.1e}"
            raise NotApplicable(reason, "its stiffness has jumps or varies too rapidly")
        return StretchedBar(self, apart + ROUNDING * abs(whole))


@dataclass(frozen=True)
class StretchedBar:
    """Solution of a bar under axial load: its displacements."""

    bar: PulledBar
    estimated_error: float  # m

    def displacement(self, X: Array) -> Array:
        """Return displacements (n, 3), m, of points X (n, 3) of the undeformed body. Raises NotApplicable."""
        s = (as_points(X) - np.asarray(self.bar.root)) @ np.asarray(self.bar.axis)
        u = _cumulative_integral(self.bar.strain, self.bar.length, np.clip(s, 0.0, self.bar.length))
        found: Array = u[:, None] * np.asarray(self.bar.axis)
        return found


def _cumulative_integral(f: Along, length: float, s: Array) -> Array:
    """Return int_0^s f dt (n,) by Gauss's rule, over whole panels and a part of the last panel."""
    t, w = np.polynomial.legendre.leggauss(POINTS)
    t, w = 0.5 * (1.0 + t), 0.5 * w
    step = length / PANELS
    starts = step * np.arange(PANELS)
    panels = step * (f((starts[:, None] + step * t).ravel()).reshape(PANELS, -1) @ w)
    before = np.concatenate([[0.0], np.cumsum(panels)])
    last = np.minimum((s / step).astype(int), PANELS - 1)
    rest = s - step * last
    part = rest * (f((step * last[:, None] + rest[:, None] * t).ravel()).reshape(len(s), -1) @ w)
    found: Array = before[last] + part
    return found


@dataclass(frozen=True)
class GradedBar(Reference):
    """A straight bar whose constants vary along it, under axial load: u = int N / (E A) ds.

    It applies to a cylinder, a box or a tube that is held at one whole end face, and loaded by a traction along the
    axis on the whole other end face, by gravity along the axis, or by both. Its Young's modulus and its density may
    vary along the axis, not across it; `poisson` is 0, since otherwise sections would contract by different amounts,
    and the stress would not be uniaxial. Strains are small. The integral is computed by Gauss's rule on pieces of the
    bar, and again by adaptive QUADPACK; their difference is its error.
    Source: Timoshenko, "Strength of Materials" I (1955), article 3 (bars of varying section); Piessens et al. 1983.
    """

    body: Annotated[Any, "body", "the bar"]

    supports_varying_constants: ClassVar[bool] = True
    problem_kind: ClassVar[str] = "bar"
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Timoshenko 1955, Strength of Materials I, article 3"
    error_meaning: ClassVar[str] = (
        "error of the displacement of the free end, m: difference of two quadratures, and rounding"
    )

    def solve(self, bar: PulledBar) -> StretchedBar:
        """Return the solution. Raises NotApplicable."""
        return bar.stretched()
