"""Interface of time integrators, and the data of a time step: motion, equations, failures."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Protocol

from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.solvers.dynamics.dynamic_system import DynamicSystem
    from softmark.solvers.dynamics.load_amplitudes import StepLoad

    Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """State x with its velocity and acceleration (dofs,) at a `time`, s.

    `factors` (l,) are the load factors that the acceleration balances. `given` = (a, b) are the weights of the contact
    impulse of the step that ends here: a times the impulse of the step before, plus b h times the contact force at the
    end.
    """

    time: float
    x: Floats
    v: Floats
    a: Floats
    factors: Floats
    given: tuple[float, float] = (0.0, 1.0)


@dataclass(frozen=True)
class StepStart:
    """Start of a step: the last accepted motion, and the motion `before` it (None at time 0)."""

    now: Motion
    before: Motion | None = None


@dataclass(frozen=True)
class ImplicitStepFormula:
    """Equations of an implicit step of `step` seconds under `load` from `start`, for its unknown end x.

    At the end of the step a = A (x - coast) and v = speed + B (x - coast), with `coast` the state that the body would
    reach without forces. The balance holds at a weighted time within the step:

        (1 - alpha_m) M a + alpha_m M a0 + C ((1 - alpha_f) v + alpha_f v0) + f = 0,

    with forces f of the weighted state, f((1 - alpha_f) x + alpha_f x0), if `between`, and otherwise the
    weighted forces (1 - alpha_f) f(x) + alpha_f f(x0), each under the load of its end of the step.
    """

    start: Motion
    step: float
    load: StepLoad
    A: float  # 1/s^2
    B: float  # 1/s
    coast: Floats
    speed: Floats
    alpha_m: float = 0.0
    alpha_f: float = 0.0
    between: bool = False
    secant: bool = False  # v is the mean velocity of the step, and damping that of its middle
    touch: float = 1.0  # weight of the forces of contact at the end of the step (dynamic_contact.py)
    mean: bool = False  # damping acts on the mean velocity of the step, which includes the effect of contact forces
    beyond: tuple[float, float] = (0.0, 0.0)  # factors of the contact acceleration to add to a (no unit) and to v (s)

    def acting(self, x: Floats) -> Floats:
        """Return the state to which the damping velocity belongs, if the step ends in the state x."""
        share = 0.5 if self.secant or self.mean else 1.0 - self.alpha_f
        return self.start.x + share * (x - self.start.x)

    def damping_velocity(self, x: Floats, v: Floats) -> Floats:
        """Return the velocity on which damping acts if the step ends in x with velocity v."""
        if self.mean:
            return (x - self.start.x) / self.step
        return (1.0 - self.alpha_f) * v + self.alpha_f * self.start.v

    @property
    def damping_velocity_derivative(self) -> float:
        """Derivative of `damping_velocity` by x, 1/s."""
        return 1.0 / self.step if self.mean else (1.0 - self.alpha_f) * self.B


class Integrator(Protocol):
    """Interface of a time integrator.

    `explicit` integrators solve no equations, need a lumped mass and have a critical step.
    """

    explicit: ClassVar[bool]

    def begin(self, system: DynamicSystem, start: Motion, step: float) -> None:
        """Refuse unsupported problems before the first step."""

    def advance(self, system: DynamicSystem, past: StepStart, step: float) -> Motion:
        """Return the motion `step` seconds later. Raises StepFailed."""


class StepFailed(Exception):
    """Error raised if a time step fails; a shorter step may succeed."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


class BarrierTooSoft(StepFailed):
    """Raised if a step ends with a point inside a rigid body; a stiffer barrier may prevent this."""


class FacetPenetration(BarrierTooSoft):
    """Raised if a step ends with facets that penetrate a rigid body; more contact points may prevent this."""


class StepTooLong(Exception):
    """Raised if a step exceeds the `critical` one, s, of an explicit integrator, including its safety factor."""

    def __init__(self, step: float, critical: float) -> None:
        super().__init__(f"the step of {step:.4g} s exceeds the critical step, {critical:.4g} s")
        self.step = step
        self.critical = critical
