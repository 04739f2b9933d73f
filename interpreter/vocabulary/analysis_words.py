"""Analyses: what is to be found."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from softmark.interpreter.language.expression_evaluation import VectorValue
from softmark.interpreter.results.state_results import Moment
from softmark.records import dataclass

Vector3 = tuple[float, float, float]

Integrator = Literal[
    "implicit_euler", "newmark", "trapezoidal", "generalized_alpha", "bdf2", "midpoint", "central_differences"
]
EXPLICIT = ("central_differences",)
USUAL = 20  # times at which a course is measured where the scene gives none


@dataclass(frozen=True)
class Static:
    """The state of rest under the loads: static equilibrium, by Newton's method.

    Converged means that the out-of-balance force is below `tolerance` times the larger of load and reactions.
    Anything else is reported as not converged, with its history.

    `path = load` raises the load, in one step where that will do. It cannot follow a load that has a maximum, as that
    of a shallow arch before it snaps or of a balloon; the report then says which part of the load was reached and what
    it looks like. `path = arc_length` follows the path of equilibria from rest by its length, load factor and
    displacements together (Keller 1977; Riks 1979; Crisfield 1981), and the result is the first state on it under full
    load. The path and its limit points and bifurcations are in the report, `solve.path` and `solve.limits`. It takes
    many more steps, and direct linear solvers in double precision.

    Where a state without buckling turns out unstable, the report has `solve.critical_load`, the part of the load at
    which the path from rest is unstable first. `solve.condition` estimates, from below, the condition number of the
    scaled stiffness matrix, and `solve.rounding` what rounding may take of the answer: above 1e-3 there is none.

    `disturbed` puts the body far from rest first, and Newton's method goes on from there (Irving, Teran and Fedkiw
    2004; Smith, de Goes and Kim 2018). The result is the equilibrium under the loads, as without it; a model that does
    not find back, or to a state only that is folded or has another energy, is not converged and says so. `scrambled`:
    every node anywhere in the bounding box, times `amount`. `flattened`: onto a plane of random direction. `collapsed`:
    into a point, or for as many seeds onto a line. `inverted`: reflected, all cells inside out. `spun`: every cell
    turned at random and the whole twisted by 3 turns, times `amount`; sections of a beam likewise. `amount` also
    stretches what is flat, collapsed or inverted. The same `seed` disturbs in the same way. See `solve.recovery` of
    the report.

    `states` are several situations of the body, one after another: loads and supports whose `course` is `state` act
    with the part of their size that is the state's value, measurements with as many `states` are compared one by one,
    and whatever is measured is known in each. `fem` and springs start each state from the one before, unless they are
    `disturbed` or follow a path; other models start from rest. A state without an answer ends the sequence. A report
    has every metric from state to state; `MODEL.METRIC.at(12.5 %)` is that in one, and `expect MODEL.METRIC < 1 mm`
    asks it of each. Where one number is wanted, as by comparisons and studies, it is that of the last state.
    """

    tolerance: Annotated[float, "1 in [1e-12, 1e-2]", "largest relative out-of-balance force"] = 1e-8
    max_iterations: Annotated[int, "1 in [1, 1000]", "Newton iterations for each load step"] = 50
    path: Annotated[Literal["load", "arc_length"], "raise the load, or follow the path of equilibria by its length"] = (
        "load"
    )
    disturbed: Annotated[
        Literal["none", "scrambled", "flattened", "collapsed", "inverted", "spun"],
        "the state that Newton's method starts from: rest, or far from it",
    ] = "none"
    amount: Annotated[float, "1 in (0, 1000]", "how far it is disturbed"] = 1.0
    seed: Annotated[int, "1 in [0, 1000000000]", "of the random disturbance"] = 1
    states: Annotated[VectorValue | None, "values of 1", "parts of what has `course = state`, one after another"] = None

    @property
    def situations(self) -> tuple[float, ...] | None:
        """The values of its states, None of the one situation without any."""
        return None if self.states is None else self.states.values

    def in_state(self, number: int, value: float) -> Self:
        """The analysis of one of its states."""
        return InState(**{**vars(self), "states": None}, at=float(value))  # type: ignore[return-value]


@dataclass(frozen=True)
class InState(Static):
    """A static analysis in one of its states, of value `at`: no word of the language."""

    at: float = 1.0


@dataclass(frozen=True)
class Quasistatic:
    """Equilibrium at every time of a course: loads and supports follow theirs, and nothing has inertia.

    Time goes from 0 to `duration` in steps of `step`, and everything is measured at `times`, of which there are 20 at
    equal distances where none are given: each is a state, as those of `static(states = ...)` are, and
    `MODEL.METRIC.at(5 s)` is a number at one. What has no course acts in full from the start, and at the start itself:
    a body that is stretched at once, and held. Steps end at every one of `times`, where a ramp begins or ends or a
    pulse jumps, and at the kinks of a table, so that none is longer than `step` and some are shorter.

    Only what remembers (`viscous`) knows of time; of elastic bodies steps between `times` are left out, for what they
    do then is the same, whatever the rate.

    Histories are integrated to second order in the step, exactly where stress grows in proportion to time. What is left
    is stated (`time` of a stated error): a third of what a step twice as long changes.
    """

    path: ClassVar[Literal["load"]] = "load"  # what a static analysis may say otherwise
    disturbed: ClassVar[Literal["none"]] = "none"

    duration: Annotated[float, "s in (0, inf)", "how long the course is followed"]
    step: Annotated[float, "s in (0, inf)", "the longest step in time"]
    times: Annotated[VectorValue | None, "values of s in [0, inf)", "when everything is measured; 20 times if none"] = (
        None
    )
    tolerance: Annotated[float, "1 in [1e-12, 1e-2]", "largest relative out-of-balance force"] = 1e-8
    max_iterations: Annotated[int, "1 in [1, 1000]", "Newton iterations for each load step"] = 50

    @property
    def now(self) -> float:
        """The time at which it is looked at, s: its end, but for the analysis at one of its times."""
        return self.duration

    @property
    def moments(self) -> tuple[float, ...]:
        """The times at which everything is measured, s."""
        if self.times is not None:
            return tuple(map(Moment, self.times.values))
        return tuple(Moment(self.duration * (i + 1) / USUAL) for i in range(USUAL))

    @property
    def situations(self) -> tuple[float, ...] | None:
        """The same, each a state; None at one of them."""
        return self.moments

    def in_state(self, number: int, value: float) -> Quasistatic:
        """The analysis at one of its times."""
        return AtTime(**vars(self), at=float(value))


@dataclass(frozen=True)
class AtTime(Quasistatic):
    """A quasistatic analysis at one of its times, `at`, s: no word of the language."""

    at: float = 0.0

    @property
    def now(self) -> float:
        """That time, s."""
        return self.at

    @property
    def situations(self) -> None:
        """It has no states any more."""
        return


@dataclass(frozen=True)
class Dynamic:
    """The motion from the undeformed state under the loads, step by step in time.

    Every implicit step is solved to `tolerance`; one that is not is halved, and the report says so. Damping is
    Rayleigh's, C = a M + b K with the tangent K, made definite and without the stress that holds the volume, of the
    state to which the velocity belongs: a mode of circular frequency w has the damping ratio a / 2w + b w / 2. Loads
    enter by the exact means of their courses over each step. Central differences are explicit: their step must stay
    below the critical one, which is computed at rest and followed on the way; a longer one is refused, or halved.

    Energy is accounted for: numerical damping is a loss, said where it is large, and a gain, which no body has, ends
    the motion as `diverged`. The report says how many steps there are to a period of the slowest vibration that
    loads excite, and warns where it is not resolved.
    """

    path: ClassVar[Literal["load"]] = "load"  # what a static analysis may say otherwise
    disturbed: ClassVar[Literal["none"]] = "none"

    situations: ClassVar[None] = None  # it has no states
    moving: ClassVar[bool] = True

    duration: Annotated[float, "s in (0, inf)", "how long the motion is followed"]
    step: Annotated[float, "s in (0, inf)", "the time step"]
    integrator: Annotated[Integrator, "how time is stepped"] = "implicit_euler"
    damping_mass: Annotated[float, "1/s in [0, inf)", "a of Rayleigh's damping"] = 0.0
    damping_stiffness: Annotated[float, "s in [0, inf)", "b of Rayleigh's damping"] = 0.0
    spectral_radius: Annotated[float, "1 in [0, 1]", "of generalized_alpha: what is left of the fastest modes"] = 0.8
    tolerance: Annotated[float, "1 in [1e-12, 1e-2]", "largest relative out-of-balance force of a step"] = 1e-6
    max_iterations: Annotated[int, "1 in [1, 1000]", "Newton iterations of a step before it is halved"] = 25
    velocity: Annotated[Vector3, "m/s", "velocity of the whole body at the start"] = (0.0, 0.0, 0.0)
    spin: Annotated[Vector3, "rad/s", "angular velocity at the start, about the centre of mass"] = (
        0.0,
        0.0,
        0.0,
    )

    @property
    def explicit(self) -> bool:
        """Whether steps divide by the mass and solve nothing."""
        return self.integrator in EXPLICIT
