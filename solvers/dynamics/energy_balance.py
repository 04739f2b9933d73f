"""Energy balance of a motion: the energy that an integrator has added or removed.

Let E be kinetic plus strain energy, W the work of loads and of moving supports, and D the energy dissipated by damping,
all since the start. The balance is B(t) = E(t) - E(0) - W(t) + D(t) (Belytschko, Liu, Moran and Elkhodary 2014, section
6.2). Numerical damping makes B negative by design; this counts as a loss. Nothing physical makes B grow, so a gain is
an error of the integrator: its step is too long.
"""

from __future__ import annotations

from collections import deque

from softmark.records import dataclass

GAIN = 0.5  # fraction of the supplied energy (start, loads, supports): a larger gain is divergence
PATIENCE = 16  # steps: generalized_alpha overshoots in the first ones where they are long, and comes back
SAID = 0.1  # fraction of the supplied energy: larger gains are reported
LOSS = 0.25  # same fraction: larger losses are reported; a suddenly applied load can lose at most half


@dataclass(frozen=True)
class EnergyBalance:
    """Energy balance B of a motion relative to an energy `scale`, J."""

    drift: float  # max |B| / scale
    gain: float  # the largest rise of B above its lowest value before / scale
    loss: float  # max(-B) / scale
    scale: float  # J, largest energy supplied by start, loads and supports
    time: float  # s, when the gain was largest

    @property
    def has_excessive_gain(self) -> bool:
        """True if the spurious energy gain exceeds the bound SAID and must be reported."""
        return self.gain > SAID

    @property
    def facts(self) -> dict[str, float | bool]:
        """Return the `energy` part of the reported facts of a solution."""
        return {
            "drift": self.drift,
            "gained": self.has_excessive_gain,
            "gain": self.gain,
            "loss": self.loss,
            "scale_J": self.scale,
        }


class EnergyAccount:
    """Accumulates the energy balance of a motion step by step."""

    def __init__(self) -> None:
        self.first = self.scale = 0.0
        self.lowest = self.gain = self.loss = self.drift = 0.0
        self.excess = 0.0  # largest excess of the energy over all that was supplied, J
        self.time, self.over = 0.0, 0  # over: number of steps for which the gain has exceeded GAIN
        self.recent: deque[float] = deque([0.0], maxlen=PATIENCE + 1)  # the largest gain after each of the last steps
        self.started = self.record = False

    def add(self, time: float, energies: dict[str, float], noise: float = 0.0, swing: float = 0.0) -> None:
        """Add the energies, J, at a time, s.

        `noise` is their rounding error, J. `swing` is the relative amplitude by which energy oscillates in stable
        steps.
        """
        if not self.started:
            self.first, self.started = abs(energies["kinetic"]) + abs(energies["strain"]), True
            self.first += energies.get("contact", 0.0)
        brought = self.first + abs(energies["load_work"]) + abs(energies["support_work"])
        brought += abs(energies.get("contact_work", 0.0))
        self.scale = max(self.scale, brought, noise)
        B = energies["drift"]
        self.lowest = min(self.lowest, B)
        self.loss, self.drift = max(self.loss, -B), max(self.drift, abs(B))
        self.record = B - self.lowest > self.gain
        if self.record:
            self.gain, self.time = B - self.lowest, time
        self.recent.append(self.gain)
        self.excess = energies["kinetic"] + energies["strain"] - brought
        self.over = self.over + 1 if B - self.lowest > (GAIN + swing) * self.scale else 0

    @property
    def diverged(self) -> bool:
        """True if the gain has exceeded GAIN for PATIENCE steps, is at its maximum, and does not level off."""
        return self.over >= PATIENCE and self.record and not self.settles

    @property
    def settles(self) -> bool:
        """True if the energy gain levels off: each half of the last PATIENCE steps adds less than the half before.

        With strong damping and a load jump, generalized_alpha oscillates about the solution for some steps. The work of
        damping in these oscillations counts as spurious energy, although the body never had it. The oscillations decay,
        and the present energy is below the energy supplied. So this is a case for a warning (`gained`), not divergence.
        """
        if self.excess > GAIN * self.scale or len(self.recent) <= PATIENCE:
            return False
        first, middle, last = self.recent[0], self.recent[PATIENCE // 2], self.recent[-1]
        return last - middle < max(0.5 * (middle - first), SAID * self.scale)

    @property
    def balance(self) -> EnergyBalance:
        """Energy balance up to the last added time."""
        share = 1.0 / self.scale if self.scale > 0.0 else 0.0
        return EnergyBalance(share * self.drift, share * self.gain, share * self.loss, self.scale, self.time)
