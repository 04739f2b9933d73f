"""Result of a time integration: times, observations, energies, events and the cost of every step."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass
from softmark.solvers.dynamics.energy_balance import EnergyAccount, EnergyBalance
from softmark.solvers.dynamics.implicit_newton import StepIteration
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.statics import static_problem

if TYPE_CHECKING:
    from softmark.solvers.dynamics.contact_output import ContactResultant, ContactSurfaceState
    from softmark.solvers.dynamics.dynamic_contact import FrictionResult, ImpactEvent

NOTHING = EnergyAccount().balance  # of no motion


@dataclass(frozen=True)
class Event:
    """Event during time integration, such as a halved step, at a `time`, s."""

    time: float
    text: str


@dataclass(frozen=True)
class StepTiming:
    """Time per step, s: the median, the 95th and 99th percentiles (linear interpolation), and the maximum."""

    median: float
    p95: float
    p99: float
    worst: float


def summarize_timing(seconds: Floats) -> StepTiming:
    """Return statistics of the seconds (n,) of steps; NaN without steps."""
    if not len(seconds):
        return StepTiming(np.nan, np.nan, np.nan, np.nan)
    return StepTiming(*(float(p) for p in np.percentile(seconds, [50.0, 95.0, 99.0, 100.0])))


@dataclass(frozen=True)
class ContactHistory:
    """Contact history: resultants `acts` at each of n + 1 times over the step before, and `surfaces` at some times.

    `impulses` (4, 3), N s, are those of contacts, loads, supports and damping up to the end, and `change` (3,), N s, is
    the change of momentum of the deformable body. `nodes` are the nodes of the surfaces.
    """

    acts: tuple[tuple[ContactResultant, ...], ...]
    surfaces: tuple[tuple[int, tuple[ContactSurfaceState, ...]], ...]
    nodes: tuple[Ints, ...]
    impulses: Floats
    change: Floats


@dataclass(frozen=True)
class Trajectory:
    """Motion over n accepted steps between n + 1 times; `complete` is whether they reach the end.

    `observed` holds the results of the observer at each time. `energies`, each (n + 1,), J, are: `kinetic`; `strain`,
    the internal energies; `load_work` of loads and `support_work` of moving supports on the body since the start;
    `damping`, the energy dissipated by damping since the start; and `drift`, the gain of kinetic and strain energy
    beyond load_work + support_work - damping, which the integrator adds (or removes, if negative). With active muscle,
    `muscle_work` is its part of load_work. With contacts there are also `contact`, the energy of barriers, and
    `contact_work`, the work of moving rigid bodies, and with friction `friction`, the energy dissipated by it, which
    never decreases; all three count in `drift`.

    `wall` and `cpu`, s, are the times that each step took, including failed attempts before it, but not observation and
    energies. `iterations` counts the linear systems of each accepted step. `residuals` are the remaining relative
    residual forces (see Dynamics), and `solved` is whether they meet the tolerance, which is always so without a cap.
    `lagged` marks steps solved by one lagged tangent, and `fallbacks` counts failed attempts at this, which Newton's
    method solved. `balance` is the energy balance of the integrator. `rubbed` is the friction result of every contact
    at each time.
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
    impacts: tuple[ImpactEvent, ...] | None = None  # on rigid bodies, where there are contacts
    rubbed: tuple[tuple[FrictionResult, ...], ...] = ()  # (n + 1,) where there is friction
    touched: ContactHistory | None = None  # where there are contacts


class MotionNotConverged(static_problem.NotConverged):
    """Raised if a step fails at its shortest length.

    `trajectory` holds the motion before it, `iterations` every Newton iteration.
    """

    def __init__(self, reason: str, trajectory: Trajectory, iterations: tuple[StepIteration, ...]) -> None:
        super().__init__(reason)
        self.trajectory = trajectory
        self.iterations = iterations


class Diverged(MotionNotConverged):
    """Error raised if the motion has gained more energy than was supplied; its `trajectory` ends there."""
