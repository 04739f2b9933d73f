"""A problem of static equilibrium, and what solving it comes to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import Any, Literal, Protocol

import numpy as np

from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import DynamicPatternEnergy, Floats, Ints, Space
from softmark.solvers.energies.stabilization_spring import StabilizationSpring
from softmark.solvers.linear import factorisations as linear
from softmark.solvers.linear.linear_solver import Linear

Criterion = Literal["residual", "energy", "rounding", "cap"]
Watch = Callable[["Iteration"], None]
SLIDES = "all that touches slides"  # how a reason begins if friction holds nothing
HELD = ", and no equilibrium was found with what supports and foundations hold"


@dataclass(frozen=True)
class Iteration:
    """One Newton iteration: the relative `residual` before it, and the part of the step that was taken."""

    phase: str  # "corotational start" | "free" | "soft barriers" | "careful" | "aside" (from an unstable equilibrium)
    load: float
    number: int
    residual: float
    length: float


class NotConverged(Exception):
    """No equilibrium was found; `history` says how far each attempt came, `facts` what the linear systems took.

    `unstable` is an unstable equilibrium of full load, where that is all that was found; `loose` (dofs,) a motion that
    nothing resists at rest, where there is one.
    """

    def __init__(
        self,
        reason: str,
        history: tuple[Iteration, ...] = (),
        facts: dict[str, Any] | None = None,
        unstable: Floats | None = None,
        loose: Floats | None = None,
    ) -> None:
        super().__init__(reason)
        self.reason = reason
        self.history = history
        self.facts = facts or {}
        self.unstable = unstable
        self.loose = loose


class CoarseTurn(NotConverged):
    """A turn that cells are too large to follow, on the path from rest: no other way follows it either."""


@dataclass(frozen=True)
class Equilibrium:
    """A converged state, its relative residual, and every iteration that led to it.

    `criterion` is which of those of `Statics` decided. `stable` is None where it could not be established: under
    follower loads, by an iterative linear solver, and where the cap decided, when the state is no equilibrium.
    """

    x: Floats
    residual: float
    history: tuple[Iteration, ...]
    load_steps: int
    criterion: Criterion = "residual"
    stable: bool | None = True
    linear_solver: str = linear.NAME  # the last factorisation
    facts: dict[str, Any] = field(default_factory=dict)  # of the linear systems
    sound: bool = True  # no cell is inside out: always so but where the cap decided
    started: bool = False  # from the state that was given, not from rest
    follower: bool = False  # some load follows the body and has no potential
    unstable: Floats | None = None  # an equilibrium of full load that was left for this one
    critical: float | None = None  # load factor from which the path that was left is unstable
    condition: float | None = None  # of the scaled tangent, estimated from below; None: no direct factor
    rounding: float | None = None  # relative error that rounding may leave in the state, as far as that is known
    left: Floats | None = None  # (dofs,) the step that would come next, by the last factor; None: no factor is at hand
    beside: tuple[Any, ...] = ()  # contacts with rigid bodies as they are in it

    @property
    def iterations(self) -> int:
        """Linear systems solved, all phases and failed attempts included."""
        return len(self.history)

    @property
    def solved(self) -> bool:
        """Whether it is an equilibrium to its tolerance, or to rounding."""
        return self.criterion != "cap"


class Way(Protocol):
    """How what is imposed comes to its full size, where that is not in proportion to the load: turns about an axis."""

    @property
    def longest(self) -> float:
        """The largest step of the load that does not lose the way: of a turn, from where it may go the other way."""

    def at(self, share: float) -> Floats:
        """What is imposed (c,), increments from rest, m or rad, at a share of the load."""

    def lost(self, x: Floats, share: float) -> str | None:
        """Return why a state does not show the whole turns that its supports have made, or None if it does."""


@dataclass(frozen=True)
class Statics:
    """A static problem: `rest` moves by `space` until `assembly` balances, with `target` imposed on `fixed`.

    `path` says how: by raising the load, or along the path of equilibria by its length (`arc_length`). Without a `way`
    the target is imposed in proportion to the load; with one, loads grow in steps from rest, no longer than it says.
    `twin` is the assembly of the corotational law with the same moduli, or None; `sound` says whether a state
    is admissible (no inverted cell), `near` whether an equilibrium of the twin is one to start from, and `jumped`
    whether no motion leads from one equilibrium to the next, as where parts have turned past each other. `bold` tries
    whole steps first; rods, whose space already follows their rotation, need no such start. `convex` says that the
    energy is a positive quadratic form, whose one equilibrium is stable. `extent` is the size of the body in m;
    `weights` make degrees of freedom that are rotations comparable with displacements: forces are multiplied and
    motions divided by them. `travelled` (m) is the length of the motion before `rest`, where that is a state in time.

    Converged means: the out-of-balance force is at most `tolerance` times the larger of load and reactions.
    In a stiff body or under a tiny load rounding alone can exceed that, since a strain of 1e-16 times a large
    stiffness is a force; when a Newton step no longer lowers it, one of two decides. Either the error in the
    energy norm, sqrt(r . K^-1 r / 2E), is at most `tolerance`, E the strain energy; or the force is within
    four times what rounding leaves in it, and the last Newton step, with a definite tangent, was below TINY
    times the motion so far: there is no better state in this arithmetic, and it is good to that part.

    The `resultant` (N) of forces (dofs,) is what they add up to; where it is given, that of what is left over meets
    the tolerance as well, as far as a step or two with the last factor take it.

    Levers. `linear` says how linear systems are solved. `start` is a state from which whole steps are tried before
    those from rest. With a `cap`, whole steps are stopped after so many linear systems, and the state is what it is,
    criterion "cap"; the same where the linear solver was stopped by a cap of its own. Where `assembly` computes in
    single precision, `exact` is the same in double: the residual that is reported is taken there, and a state is
    refused whose residual and whose error in the energy norm are both above `rounded`.
    """

    assembly: Assembly
    space: Space
    rest: Floats
    fixed: Ints  # (c,)
    target: Floats  # (c,) imposed increments from rest, m or rad
    tolerance: float = 1e-8
    max_iterations: int = 50
    twin: Assembly | None = None
    sound: Callable[[Floats], bool] = field(default=lambda x: True)
    near: Callable[[Floats], bool] = field(default=lambda x: True)
    jumped: Callable[[Floats, Floats], bool] = field(default=lambda before, after: False)
    bold: bool = True
    convex: bool = False
    extent: float = 1.0
    travelled: float = 0.0
    weights: Floats = field(default_factory=lambda: np.ones(1))  # (dofs,) or (1,)
    watch: Watch = field(default=lambda iteration: None)
    linear: Linear = field(default_factory=Linear)
    path: Literal["load", "arc_length"] = "load"
    start: Floats | None = None
    cap: int | None = None
    exact: Assembly | None = None
    rounded: float = 1e-3
    way: Way | None = None
    resultant: Callable[[Floats], float] | None = None

    @property
    def moves(self) -> bool:
        """Whether anything is imposed that is not zero, at full load or before."""
        return self.way is not None or bool(np.any(self.target))

    @property
    def touches(self) -> bool:
        """Whether something may come into contact: whole steps go in and out of it by turns, without an end."""
        return any(
            e.driven or isinstance(e, DynamicPatternEnergy) for e in (*self.assembly.internal, *self.assembly.loads)
        )

    @property
    def beside(self) -> bool:
        """Whether there are rigid bodies."""
        return any(energy.driven for energy in self.assembly.loads)

    @property
    def grounded(self) -> bool:
        """Whether a spring keeps a body that only touch is to hold."""
        return bool(self.assembly.internal) and isinstance(self.assembly.internal[-1], StabilizationSpring)

    @property
    def rubs(self) -> bool:
        """Whether there is friction that counts with the pressures of the state itself."""
        return any(energy.rubs for energy in (*self.assembly.internal, *self.assembly.loads))

    @property
    def longest(self) -> float:
        """The largest step of the load."""
        return 1.0 if self.way is None else min(1.0, self.way.longest)

    def lost(self, x: Floats, load: float) -> str | None:
        """Return why a state at a load has lost the turns of its supports, or None; small strain knows no turns."""
        return None if self.way is None or self.convex else self.way.lost(x, load)

    def imposed(self, begin: float, end: float) -> Floats:
        """What supports move on (c,) from one share of the load to another."""
        if self.way is None:
            found: Floats = (end - begin) * self.target
            return found
        return self.way.at(end) - self.way.at(begin)
