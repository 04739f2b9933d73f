"""Viscoelastic bar with a Prony series under axial load: closed forms for every amplitude."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise
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

ROUNDING = 1e-12  # relative, of a displacement: poles are roots of a polynomial
POLISHED = 3  # largest ratio of times: roots of polynomials with widely spread rates are inaccurate
PANELS, POINTS = 12, 10  # in which a dissipated energy is integrated between two breaks of a course, at least
NARROWS = 0.3  # ratio of neighbouring panels, which narrow towards a break
SOON = 0.3  # largest first panel, relative to the shortest relaxation time


@dataclass(frozen=True)
class HarmonicAmplitudeSegment:
    """Smooth part of an amplitude between two times, s, with slope Re(a exp(i w (t - begin))), 1/s.

    w = 0 gives a straight line.
    """

    begin: float
    end: float
    a: complex
    w: float = 0.0

    def hereditary_integral(self, rate: float, t: float) -> float:
        """Return int exp(-rate (t - s)) dc(s) over the part of the segment before time t, s."""
        passed = min(self.end, t) - self.begin
        if passed <= 0.0:
            return 0.0
        p = complex(rate, self.w)
        late = cmath.exp(complex(-rate * (t - self.begin - passed), self.w * passed))
        if p == 0.0:  # nothing relaxes
            return (self.a * late).real * passed
        return (self.a * late * -complex(np.expm1(-p * passed)) / p).real


@dataclass(frozen=True)
class Amplitude:
    """Amplitude c(t) of a load or displacement: jumps (time, s, and size), and smooth segments between them."""

    jumps: Sequence[tuple[float, float]]
    swings: Sequence[HarmonicAmplitudeSegment]

    def hereditary_integral(self, rate: float, t: float) -> float:
        """Return int exp(-rate (t - s)) dc(s) up to time t, s, including jumps at t; for rate = 0 it is c(t)."""
        jumped = sum(size * math.exp(-rate * (t - at)) for at, size in self.jumps if at <= t)
        return jumped + sum(swing.hereditary_integral(rate, t) for swing in self.swings)

    def breaks(self, t: float) -> list[float]:
        """Return the times up to t, s, at which the amplitude is not smooth."""
        found = {0.0, t, *(at for at, _ in self.jumps), *(at for s in self.swings for at in (s.begin, s.end))}
        for swing in self.swings:
            if swing.w:
                quarter = 0.5 * math.pi / swing.w
                found |= {swing.begin + quarter * i for i in range(1, int((min(t, swing.end) - swing.begin) / quarter))}
        return sorted(at for at in found if 0.0 <= at <= t)


@dataclass(frozen=True)
class RelaxingBar:
    """Viscoelastic bar in uniaxial stress, held at one end, with constant Poisson's ratio. SI units.

    Its modulus is E(t) = E (1 - sum g (1 - exp(-t/tau))). Its other end is moved (`force` false, `amount` in m) or
    pulled (`force` true, `amount` in N) by the amplitude `driven`, up to the time `now`. Raises NotApplicable if the
    bar is not of that kind.
    """

    length: float  # m
    area: float  # m^2
    root: Vector  # m, the centre of the held end
    axis: Vector  # unit vector, from there to the moved one
    still: Vector  # m, a point that does not move across the axis
    young: float  # Pa, at once
    poisson: float
    g: tuple[float, ...]
    tau: tuple[float, ...]  # s
    force: bool
    amount: float
    driven: Amplitude
    now: float  # s

    def __post_init__(self) -> None:
        if self.force and 1.0 - sum(self.g) < 1e-9:
            raise NotApplicable(
                "the stress relaxes completely, so the bar flows under a force without limit",
                "displace its end, or keep the sum of `g` below 1",
            )
        if len(set(self.tau)) < len(self.tau):
            raise NotApplicable(
                "two terms of its series have the same relaxation time",
                "replace them by one term with the sum of their shares",
            )

    @property
    def _relaxation_rates(self) -> Array:
        return 1.0 / np.array(self.tau)

    @cached_property
    def _creep_function_terms(self) -> tuple[Array, Array, Array]:
        """Poles of the creep function (k,), -1/s, their shares in the strain (k,), and branch stresses (k, k)."""
        a, g = self._relaxation_rates, np.array(self.g)
        product = np.polynomial.polynomial.polyfromroots
        N = product(-a)
        for i, gi in enumerate(g):
            N = np.polynomial.polynomial.polysub(N, gi * a[i] * product(-np.delete(a, i)))
        r = np.polynomial.polynomial.polyroots(N).real
        for _ in range(POLISHED):  # 1 = sum g a / (s + a), by Newton's method
            r = r + (1.0 - (g * a / (r[:, None] + a)).sum(axis=1)) / -(g * a / (r[:, None] + a) ** 2).sum(axis=1)
        slope = (g * a / (r[:, None] + a) ** 2).sum(axis=1)
        strain = 1.0 / (r * slope)
        branches = g[:, None] / ((r + a[:, None]) * slope)
        return r, strain, branches

    def strain_at(self, t: float) -> float:
        """Return the axial strain at time t, s."""
        if not self.force:
            return self.amount / self.length * self.driven.hereditary_integral(0.0, t)
        r, strain, _ = self._creep_function_terms
        creep = self.driven.hereditary_integral(0.0, t) / (1.0 - sum(self.g))
        creep += sum(c * self.driven.hereditary_integral(-p, t) for c, p in zip(strain, r, strict=True))
        return self.amount / (self.area * self.young) * float(creep)

    def branches_at(self, t: float) -> Array:
        """Return the stress of each branch of the Prony series (k,), Pa, at time t, s."""
        if not self.force:
            each = [
                g * self.driven.hereditary_integral(rate, t)
                for g, rate in zip(self.g, self._relaxation_rates, strict=True)
            ]
            return self.young * self.amount / self.length * np.array(each)
        r, _, branches = self._creep_function_terms
        found: Array = (
            self.amount / self.area * (branches @ np.array([self.driven.hereditary_integral(-p, t) for p in r]))
        )
        return found

    def stress_at(self, t: float) -> float:
        """Return the axial stress at time t, s, Pa."""
        return self.young * (1.0 - sum(self.g)) * self.strain_at(t) + float(self.branches_at(t).sum())

    @property
    def pull(self) -> float:
        """Present force on the moved end, N."""
        return self.area * self.stress_at(self.now)

    @property
    def stored(self) -> float:
        """Present energy stored in the springs of all branches, J."""
        lasting = 0.5 * self.young * (1.0 - sum(self.g)) * self.strain_at(self.now) ** 2
        springs = float((self.branches_at(self.now) ** 2 / np.array(self.g)).sum()) / (2.0 * self.young)
        return self.area * self.length * (lasting + springs)

    @cached_property
    def dissipated(self) -> float:
        """Energy dissipated since the start, J: int sum sigma_i^2 / (E g_i tau_i) dt times the volume.

        The integral is computed by Gauss panels, refined at the breaks of the amplitude.
        """
        if self.now <= 0.0:
            return 0.0
        xi, w = np.polynomial.legendre.leggauss(POINTS)
        total = 0.0
        weights = 1.0 / (np.array(self.g) * np.array(self.tau) * self.young)
        for begin, end in pairwise(self.driven.breaks(self.now)):
            narrow = math.log(max(1.0, (end - begin) / (SOON * min(self.tau)))) / -math.log(NARROWS)
            panels = max(PANELS, 1 + math.ceil(narrow))
            cuts = begin + (end - begin) * np.concatenate([[0.0], NARROWS ** np.arange(panels - 1, -1, -1.0)])
            for a, b in pairwise(cuts.tolist()):
                at = 0.5 * (a + b) + 0.5 * (b - a) * xi
                rates = np.array([weights @ self.branches_at(t) ** 2 for t in at.tolist()])
                total += 0.5 * (b - a) * float(w @ rates)
        return self.area * self.length * total

    @property
    def estimated_error(self) -> float:
        """Rounding error of a displacement, m."""
        return ROUNDING * abs(self.strain_at(self.now)) * self.length

    def displacement(self, X: Array) -> Array:
        """Return displacements (n, 3), m, of points X (n, 3) of the undeformed body. Raises NotApplicable."""
        points = as_points(X)
        n, strain = np.asarray(self.axis), self.strain_at(self.now)
        along = (points - np.asarray(self.root)) @ n
        off = points - np.asarray(self.still)
        across = off - (off @ n)[:, None] * n
        found: Array = strain * (along[:, None] * n - self.poisson * across)
        return found


@dataclass(frozen=True)
class Prony(Reference):
    """A viscoelastic bar with a Prony series, in small strain: relaxation, creep, ramps and cycles.

    E(t) = E (1 - sum g (1 - exp(-t / tau))) along the bar, Poisson's ratio constant. Its end is moved, and the force
    follows from the hereditary integral; or it is pulled, and the strain follows from the creep function, whose poles
    are the roots of the Laplace transform of E(t). Ramps, smooth ramps, sines, pulses and steps are integrated in
    closed form. It can be compared with the metrics `force`, `displacement`, `strain_energy` and `dissipation`. It
    applies to a box, a cylinder or a tube of one `viscoelastic(...)` material that relaxes as a whole, or whose law has
    `poisson = 0.5`; one end face held along the axis only, the other displaced along it or under a `traction`, and a
    `quasistatic` analysis.
    Source: Christensen (1982), "Theory of Viscoelasticity", chapter 1; Tschoegl (1989), "The Phenomenological Theory of
    Linear Viscoelastic Behavior", chapter 3.
    """

    body: Annotated[Any, "body", "the bar"]

    problem_kind: ClassVar[str] = "viscoelastic_bar"
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Christensen 1982, Theory of Viscoelasticity, chapter 1"
    error_meaning: ClassVar[str] = "rounding of the displacement, m: the formula solves its equation exactly"

    def solve(self, bar: RelaxingBar) -> RelaxingBar:
        """Return the bar itself, whose class contains the closed forms."""
        return bar
