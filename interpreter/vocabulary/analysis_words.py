"""Analyses: static equilibrium, quasistatic history, or motion in time."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal, Self

from softmark.interpreter.language.expression_evaluation import VectorValue
from softmark.interpreter.results.state_results import TimeState
from softmark.records import dataclass

Vector3 = tuple[float, float, float]

Integrator = Literal[
    "implicit_euler", "newmark", "trapezoidal", "generalized_alpha", "bdf2", "midpoint", "central_differences"
]
EXPLICIT = ("central_differences",)
SAME = 1e-9  # relative difference of equal times
USUAL = 20  # default number of times at which results are recorded


@dataclass(frozen=True)
class Static:
    """Static equilibrium under the loads, by Newton's method.

    A solution has converged when the out-of-balance force is below `tolerance` times the larger of load and reactions.
    Anything else is reported as not converged, with its iteration history.

    `path = load` raises the load, in a single step if possible. It cannot pass a maximum of the load, such as the
    snap-through of a shallow arch or the limit point of a balloon; the report then gives the fraction of the load that
    was reached and the likely cause. `path = arc_length` follows the equilibrium path from rest by arc length, in load
    factor and displacements together (Keller 1977; Riks 1979; Crisfield 1981). The result is the first state on the
    path under full load. The report lists the path, its limit points and its bifurcations in `solve.path` and
    `solve.limits`. This takes many more steps, and needs direct linear solvers in double precision.

    If an equilibrium turns out to be unstable, the report has `solve.critical_load`: the fraction of the load at which
    the path from rest first becomes unstable. `solve.condition` is a lower estimate of the condition number of the
    scaled stiffness matrix, and `solve.rounding` estimates the relative error from rounding; above 1e-3 no result is
    given.

    `disturbed` starts Newton's method from a state far from rest (Irving, Teran and Fedkiw 2004; Smith, de Goes and Kim
    2018). The result should be the same equilibrium as without it. A model that does not recover, or reaches only a
    state that is folded or has another energy, is reported as not converged. `scrambled`: every node at a random place
    in the bounding box, scaled by `amount`. `flattened`: projected onto a plane of random direction. `collapsed`: all
    nodes at one point or, for half of the seeds, on a line. `inverted`: reflected, so that all cells are inside out.
    `spun`: every cell rotated at random and the whole body twisted by 3 turns times `amount`; sections of a beam
    likewise. `amount` also scales the flattened, collapsed and inverted states. The same `seed` gives the same
    disturbance. See `solve.recovery` in the report.

    `states` are several load levels, solved one after another: loads and supports with `amplitude = per_state` act with
    the fraction of their size that is the state's value. Measurements with as many `states` are compared one by one,
    and every metric is available in each state. `fem` and springs start each state from the previous one, unless they
    are `disturbed` or follow a path; other models start from rest. A state without a solution ends the sequence. A
    report shows every metric from state to state. `MODEL.METRIC.at(12.5 %)` is the value in one state, and `expect
    MODEL.METRIC < 1 mm` must hold in every state. Where a single number is needed, as in comparisons and studies, it is
    that of the last state.
    """

    tolerance: Annotated[float, "1 in [1e-12, 1e-2]", "largest relative out-of-balance force"] = 1e-8
    max_iterations: Annotated[int, "1 in [1, 1000]", "largest number of Newton iterations in a load step"] = 50
    path: Annotated[Literal["load", "arc_length"], "raise the load, or follow the equilibrium path by arc length"] = (
        "load"
    )
    disturbed: Annotated[
        Literal["none", "scrambled", "flattened", "collapsed", "inverted", "spun"],
        "initial state of Newton's method: at rest, or far from it",
    ] = "none"
    amount: Annotated[float, "1 in (0, 1000]", "size of the disturbance"] = 1.0
    seed: Annotated[int, "1 in [0, 1000000000]", "seed of the random disturbance"] = 1
    states: Annotated[
        VectorValue | None,
        "values of 1",
        "load levels, solved in this order, for everything with `amplitude = per_state`",
    ] = None

    @property
    def situations(self) -> tuple[float, ...] | None:
        """Values of the states; None for an analysis without states."""
        return None if self.states is None else self.states.values

    def in_state(self, number: int, value: float) -> Self:
        """Return the analysis of a single state, with this number and value."""
        return InState(**{**vars(self), "states": None}, at=float(value))  # type: ignore[return-value]


@dataclass(frozen=True)
class InState(Static):
    """Static analysis of a single state, whose value is `at`. Not a word of the language."""

    at: float = 1.0


@dataclass(frozen=True)
class Quasistatic:
    """Equilibrium at every time, without inertia, while loads and supports follow their amplitudes.

    Time goes from 0 to `duration` in steps of `step`. Results are recorded at `times`; by default at 20 equally spaced
    times. Each of these times is a state, like those of `static(states = ...)`, and `MODEL.METRIC.at(5 s)` is the value
    at one of them. Loads and supports without `amplitude` act in full from the very start, as for a body
    that is stretched at once and then held. Steps end at each of `times`, at the start and end of ramps, at the jumps
    of pulses and at the rows of tables, so steps are never longer than `step` and some are shorter.

    Only viscoelastic materials (`viscoelastic`) depend on time. For elastic bodies the steps between `times` are
    skipped, because the result does not depend on the rate.

    History variables are integrated with second-order accuracy in the step, and exactly where stress grows in
    proportion to time. The remaining error is part of the stated error (`time`), and is estimated from a solution with
    half the step. Where `times` are closer than `step`, half of their distance is used.
    """

    path: ClassVar[Literal["load"]] = "load"  # only a static analysis has the field
    disturbed: ClassVar[Literal["none"]] = "none"

    duration: Annotated[float, "s in (0, inf)", "duration of the analysis"]
    step: Annotated[float, "s in (0, inf)", "longest time step"]
    times: Annotated[
        VectorValue | None, "values of s in [0, inf)", "times at which results are recorded; default: 20 equally spaced"
    ] = None
    tolerance: Annotated[float, "1 in [1e-12, 1e-2]", "largest relative out-of-balance force"] = 1e-8
    max_iterations: Annotated[int, "1 in [1, 1000]", "largest number of Newton iterations in a load step"] = 50

    @property
    def now(self) -> float:
        """Time of the result, s: the end of the analysis, or the selected time of an analysis at one time."""
        return self.duration

    @property
    def moments(self) -> tuple[float, ...]:
        """Times at which results are recorded, s."""
        if self.times is not None:
            return tuple(map(TimeState, self.times.values))
        return tuple(TimeState(self.duration * (i + 1) / USUAL) for i in range(USUAL))

    @property
    def since_output(self) -> float:
        """Time between the result and the output before it, s, or the start; infinite for a result at the start."""
        before = [t for t in (0.0, *map(float, self.moments)) if t < self.now * (1.0 - SAME)]
        return self.now - max(before) if before else math.inf

    @property
    def situations(self) -> tuple[float, ...] | None:
        """Times at which results are recorded, each of them a state; None for an analysis at one time."""
        return self.moments

    def in_state(self, number: int, value: float) -> Quasistatic:
        """Return the analysis at one of its times, with this number and value, s."""
        return AtTime(**vars(self), at=float(value))


@dataclass(frozen=True)
class AtTime(Quasistatic):
    """Quasistatic analysis at one of its output times, `at`, s. Not a word of the language."""

    at: float = 0.0

    @property
    def now(self) -> float:
        """Time for which a result is computed, s."""
        return self.at

    @property
    def situations(self) -> None:
        """None, because an analysis at a single time has no states."""
        return


@dataclass(frozen=True)
class Dynamic:
    """Motion under the loads from the undeformed state, integrated step by step in time.

    Every implicit step is solved to `tolerance`; a step that does not converge is halved, and the report states this.
    Damping is Rayleigh damping, C = a M + b K. K is the tangent stiffness of the state to which the velocity belongs,
    made positive definite and without the stress that keeps the volume. A mode of circular frequency w has the damping
    ratio a / 2w + b w / 2. Loads enter with the exact mean of their amplitude over each step. Central differences are
    explicit: their step must stay below the critical step, which is computed at rest and updated during the motion. A
    longer step is refused or halved.

    The energy balance is checked. Numerical damping is a loss of energy, and a warning is given if it is large. A gain
    of energy is unphysical and ends the motion as `diverged`. The report gives the number of steps per period of the
    slowest vibration that the loads excite, and warns if it is not resolved.
    """

    path: ClassVar[Literal["load"]] = "load"  # only a static analysis has the field
    disturbed: ClassVar[Literal["none"]] = "none"

    situations: ClassVar[None] = None  # no states
    moving: ClassVar[bool] = True

    duration: Annotated[float, "s in (0, inf)", "duration of the analysis"]
    step: Annotated[float, "s in (0, inf)", "time step"]
    integrator: Annotated[Integrator, "time integration method"] = "implicit_euler"
    damping_mass: Annotated[float, "1/s in [0, inf)", "coefficient a of Rayleigh damping"] = 0.0
    damping_stiffness: Annotated[float, "s in [0, inf)", "coefficient b of Rayleigh damping"] = 0.0
    spectral_radius: Annotated[
        float, "1 in [0, 1]", "for generalized_alpha: amplitude of the fastest modes after a step"
    ] = 0.8
    tolerance: Annotated[float, "1 in [1e-12, 1e-2]", "largest relative out-of-balance force of a step"] = 1e-6
    max_iterations: Annotated[int, "1 in [1, 1000]", "Newton iterations of a step before it is halved"] = 25
    velocity: Annotated[Vector3, "m/s", "initial velocity of the whole body"] = (0.0, 0.0, 0.0)
    spin: Annotated[Vector3, "rad/s", "initial angular velocity about the centre of mass"] = (
        0.0,
        0.0,
        0.0,
    )

    @property
    def explicit(self) -> bool:
        """True for explicit time integration, which divides by the lumped mass and solves no system of equations."""
        return self.integrator in EXPLICIT
