"""Modal solution of diffusion problems: a steady part that follows the amplitude, and decaying modes."""

from __future__ import annotations

import cmath
import math
from typing import TYPE_CHECKING

from softmark.records import dataclass
from softmark.references.elastica_collocation import NotSolved
from softmark.references.prony import Amplitude

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np

GONE = 45.0  # exp(-45) is 3e-20: smaller terms are dropped
LEAST, MOST = 1_000, 20_000  # modes: a ramp takes the first, 2e-8 of the time of diffusion after a jump the second
AT_ONCE = 1e-12  # relative to the time: closer jumps count as now


def decayed_amplitude(driven: Amplitude, rates: Array, t: float) -> Array:
    """Return int exp(-rate (t - s)) dc(s) up to time t, s, for decay rates (n,), 1/s, shape (n,).

    c is the amplitude `driven`; jumps at t are included.
    """
    found = np.zeros(len(rates))
    for at, size in driven.jumps:
        if at <= t:
            found += size * np.exp(-rates * (t - at))
    for swing in driven.swings:
        passed = min(swing.end, t) - swing.begin
        if passed > 0.0:
            p = rates + 1j * swing.w
            late = np.exp(-rates * (t - swing.begin - passed) + 1j * swing.w * passed)
            found += (swing.a * late * -np.expm1(-p * passed) / p).real
    return found


def time_since_jump(driven: Amplitude, t: float) -> float:
    """Return the time between t and the last jump of the amplitude before it, s.

    It is 0 for a jump at t, and infinite without jumps.
    """
    ages = [t - at for at, size in driven.jumps if size and at <= t]
    return min((0.0 if age <= AT_ONCE * t else age for age in ages), default=math.inf)


def slope(driven: Amplitude, t: float) -> float:
    """Return the slope of the amplitude just before time t, 1/s, without jumps."""
    return sum((s.a * cmath.exp(1j * s.w * (t - s.begin))).real for s in driven.swings if s.begin < t <= s.end)


def time_since_event(driven: Amplitude, t: float, kinks: bool) -> float:
    """Return the time between t and the last jump of the amplitude before it, s; 0 for a jump at t.

    With `kinks`, changes of its slope count as well.
    """
    age = time_since_jump(driven, t)
    breaks = [at for swing in driven.swings for at in (swing.begin, swing.end)] if kinks else []
    return min([age, *(t - at for at in breaks if t - at > AT_ONCE * t)])


def count_needed_modes(driven: Amplitude, t: float, scale: float, kinks: bool = False) -> int:
    """Return the number of modes that suffices at time t, s, after the last jump of the amplitude.

    With `kinks`, changes of slope count like jumps. Mode n decays at a rate of about (pi n)^2 / scale; `scale` is in s.
    """
    age = time_since_event(driven, t, kinks)
    if age == 0.0:
        return MOST
    return int(min(MOST, max(LEAST, math.sqrt(GONE * scale / age) / math.pi + 2.0)))


def require_convergence(driven: Amplitude, t: float, scale: float, moved: bool = False) -> None:
    """Raise NotSolved if the sum over modes does not converge: too soon after a jump, or for the force at a jump."""
    age = time_since_event(driven, t, moved)
    if age == 0.0 and moved:
        raise NotSolved(
            "the plate is displaced instantaneously, so the force is infinite at that time: evaluate it later", (t,)
        )
    soonest = GONE * scale / (math.pi * (MOST - 2)) ** 2
    if 0.0 < age < soonest:
        why = f"{age:.3g} s after a jump of its amplitude, fluid has left at most a ten-thousandth of the layer"
        raise NotSolved(f"{why}: the sum over modes is accurate from {soonest:.3g} s on", (t,))


@dataclass(frozen=True)
class ModalResponse:
    """Response of k quantities to an amplitude c(t), as a sum over modes.

    The response is lasting (k,) times c(t), plus the sum over modes n of shares (k, n) times the decayed amplitude.
    Modes beyond the last are zero except at a jump at time t: the instantaneous response of all modes to a unit jump is
    `at_once` (k,). If the shares do not decrease with n, these modes follow a slope of c without delay: `moments` (k,)
    are the sums of all shares over their rates, s.
    """

    lasting: Array  # (k,)
    shares: Array  # (k, n)
    at_once: Array  # (k,)
    moments: Array | None = None  # (k,)

    def at(self, driven: Amplitude, rates: Array, t: float) -> Array:
        """Return the quantities (k,) at time t, s."""
        now = sum(size for at, size in driven.jumps if abs(t - at) <= AT_ONCE * t)
        rest = self.at_once - self.lasting - self.shares.sum(axis=1)
        found: Array = self.lasting * driven.hereditary_integral(0.0, t) + self.shares @ decayed_amplitude(
            driven, rates, t
        )
        if self.moments is not None:
            found += slope(driven, t) * (self.moments - (self.shares / rates).sum(axis=1))
        return found + now * rest if now else found

    def missed(self, driven: Amplitude, rates: Array, t: float) -> float:
        """Return a bound of the contribution of modes beyond the last, whose shares fall at least as fast as 1/n."""
        before = Amplitude([(at, size) for at, size in driven.jumps if abs(t - at) > AT_ONCE * t], driven.swings)
        last = np.abs(self.shares[:, -20:]).max(initial=0.0)
        own = decayed_amplitude(before, rates[-1:], t)[0] - (
            slope(driven, t) / rates[-1] if self.moments is not None else 0.0
        )
        return float(last * len(rates) * abs(own))
