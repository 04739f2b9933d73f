"""What a march leaves: times, what was observed, energies, events and the cost of every step."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass
from softmark.solvers.dynamics.energy_balance import Account, EnergyBalance
from softmark.solvers.dynamics.implicit_newton import StepIteration
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.statics import static_problem

if TYPE_CHECKING:
    from softmark.solvers.dynamics.contact_output import Acting, Surface
    from softmark.solvers.dynamics.dynamic_contact import Bounce, Rubbed

NOTHING = Account().balance  # of no motion


@dataclass(frozen=True)
class Event:
    """Something that happened on the way, at a `time` in s."""

    time: float
    text: str


@dataclass(frozen=True)
class StepTiming:
    """Seconds of the steps: the median, the 95th and 99th percentiles (linear interpolation), and the worst."""

    median: float
    p95: float
    p99: float
    worst: float


def timing(seconds: Floats) -> StepTiming:
    """Statistics of the seconds (n,) of steps; not a number where there were none."""
    if not len(seconds):
        return StepTiming(np.nan, np.nan, np.nan, np.nan)
    return StepTiming(*(float(p) for p in np.percentile(seconds, [50.0, 95.0, 99.0, 100.0])))


@dataclass(frozen=True)
class Touched:
    """What contacts did: `acts` at each of n + 1 times over the step before it, and some `surfaces` over their `nodes`.

    `impulses` (4, 3), N s, are those of contacts, loads, supports and damping up to the end, and `change` (3,) that of
    the momentum of the body that deforms.
    """

    acts: tuple[tuple[Acting, ...], ...]
    surfaces: tuple[tuple[int, tuple[Surface, ...]], ...]
    nodes: tuple[Ints, ...]
    impulses: Floats
    change: Floats


@dataclass(frozen=True)
class Trajectory:
    """n accepted steps between n + 1 times. `complete` says whether they reach the end.

    `observed` holds what the observer gave back at each time. `energies`, each (n + 1,) in J: `kinetic`, `strain`
    (internal energies), `load_work` done on the body by loads and `support_work` by moving supports since the
    start, `damping` lost by it since then, and `drift` = what kinetic and strain energy have gained beyond
    load_work + support_work - damping: what the integrator adds (or, where negative, loses). Where something pulls
    within, `muscle_work` is the part of load_work that it has done. `wall` and `cpu`
    are the seconds that each step cost, failed attempts before it included, observation and energies not.
    `iterations` counts the linear systems of each accepted step, `residuals` are the relative out-of-balance forces
    (see Dynamics) that they left, `solved` says whether that meets the tolerance: without a cap, always. `lagged`
    says which steps one lagged tangent solved; `fallbacks` counts attempts at it that were left to Newton's method.
    `balance` says how much of the energy the integrator has added or lost. With contacts there are also `contact`, what
    barriers store, and `contact_work`, what rigid bodies that move have done; both count in `drift`. With friction
    there is also `friction`, what it has turned into heat, which never falls and counts as well, and `rubbed` says at
    each time what it made of every contact that has some.
    """

    times: Floats
    steps: Floats  # (n,) s
    observed: tuple[Any, ...]
    energies: dict[str, Floats]
    iterations: Ints  # (n,)
    wall: Floats  # (n,) s
    cpu: Floats  # (n,) s
    events: tuple[Event, ...] = ()
    complete: bool = True
    residuals: Floats = field(default_factory=lambda: np.zeros(0))  # (n,)
    solved: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))  # (n,)
    lagged: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))  # (n,)
    fallbacks: int = 0
    balance: EnergyBalance = NOTHING  # of the energies
    impacts: tuple[Bounce, ...] | None = None  # on rigid bodies, where there are contacts
    rubbed: tuple[tuple[Rubbed, ...], ...] = ()  # (n + 1,) where there is friction
    touched: Touched | None = None  # where there are contacts


class MotionNotConverged(static_problem.NotConverged):
    """A step failed at its shortest; `trajectory` holds what came before, `iterations` every Newton iteration."""

    def __init__(self, reason: str, trajectory: Trajectory, iterations: tuple[StepIteration, ...]) -> None:
        super().__init__(reason)
        self.trajectory = trajectory
        self.iterations = iterations


class Diverged(MotionNotConverged):
    """The motion has gained more energy than anything has brought; `trajectory` ends where that was found."""
