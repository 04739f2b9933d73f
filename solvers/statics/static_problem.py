"""Static equilibrium problem, its solution, and the errors raised if it has none."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import Any, Literal, Protocol, Self

import numpy as np

from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Energy, Floats, Ints, Space
from softmark.solvers.energies.stabilization_spring import STABILIZATION
from softmark.solvers.linear import factorisations as linear
from softmark.solvers.linear.linear_solver import LinearSolverOptions

Criterion = Literal["residual", "energy", "rounding", "cap"]
Watch = Callable[["Iteration"], None]
SLIDES = "all contact points slide"  # first words of the reason if nothing sticks
HELD = ", and the supports and foundations alone reach no equilibrium"


@dataclass(frozen=True)
class Iteration:
    """One Newton iteration: the relative `residual` before it, and the fraction of the step that was taken."""

    phase: str  # "corotational start" | "free" | "soft barriers" | "careful" | "aside" (from an unstable equilibrium)
    load: float
    number: int
    residual: float
    length: float


class NotConverged(Exception):
    """Raised if no equilibrium is found; `history` has all iterations, `facts` the data of linear systems.

    `unstable` (dofs,) is an unstable equilibrium at full load if no other was found. `loose` (dofs,) is a motion
    without any stiffness at rest, if there is one.
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


class CellsTooCoarseForRotation(NotConverged):
    """Raised if cells are too large to follow a rotation from rest; no other strategy can follow it either."""


@dataclass(frozen=True)
class Equilibrium:
    """Converged state x, its relative residual, and all iterations that led to it.

    `criterion` is the convergence criterion of `Statics` that was met. `stable` is None if unknown: under follower
    loads, with an iterative linear solver, and if a cap ended the solution; then the state is no equilibrium.
    """

    x: Floats
    residual: float
    history: tuple[Iteration, ...]
    load_steps: int
    criterion: Criterion = "residual"
    stable: bool | None = True
    linear_solver: str = linear.NAME  # the last factorisation
    facts: dict[str, Any] = field(default_factory=dict)  # data of the linear systems for the report
    sound: bool = True  # no cell is inverted; may be False only if a cap ended the solution
    started: bool = False  # solved from a given start state, not from rest
    follower: bool = False  # some load is a follower load without potential
    unstable: Floats | None = None  # an unstable equilibrium at full load that was found before this one
    critical: float | None = None  # load factor from which the path from rest is unstable
    condition: float | None = None  # condition number of the scaled tangent, a lower estimate; None: no direct factor
    rounding: float | None = None  # relative rounding error of the state; None: not measured
    left: Floats | None = None  # (dofs,) next Newton step by the last factor; None: no factor
    contacts: dict[str, Any] = field(default_factory=dict)  # contacts with rigid bodies in this state, by name

    @property
    def iterations(self) -> int:
        """Number of linear systems solved, including all phases and failed attempts."""
        return len(self.history)

    @property
    def solved(self) -> bool:
        """True if the state is an equilibrium to its tolerance or to rounding; False if the solution ended at a cap."""
        return self.criterion != "cap"


class SupportPath(Protocol):
    """Path of imposed values that are not proportional to the load: rotations about an axis."""

    @property
    def largest_load_step(self) -> float:
        """Largest load step, as a fraction of full load, that keeps the sense of rotation.

        A larger step might rotate a support the other way round.
        """

    def at(self, share: float) -> Floats:
        """Return the imposed increments from rest (c,), m or rad, at a load fraction `share`."""

    def lost_turn_message(self, x: Floats, share: float) -> str | None:
        """Return a message if whole rotations of the supports are missing in a state x; else None.

        `share` is the load fraction of the state.
        """


@dataclass(frozen=True)
class Statics:
    """Static problem: find the state of `space` near `rest` in which `assembly` is balanced.

    The degrees of freedom `fixed` (c,) move by the increments `target` (c,). `path` is the method: load stepping, or
    arc length along the path of equilibria. By default `target` is imposed in proportion to the load; a `way` gives
    another path of the supports and limits load steps from rest. `twin` is the assembly of the corotational law with
    the same moduli, or None. `sound` returns whether a state is admissible (no inverted cell), `near` whether an
    equilibrium of the twin is a suitable start. `jumped` returns whether no motion leads from one equilibrium to the
    next, such as where parts have rotated past each other. `bold` tries full steps first without a twin, for rods,
    whose space already follows their rotation. `convex` marks a positive quadratic energy, whose only equilibrium is
    stable. `extent` is the size of the body, m. `weights` make rotations comparable with displacements: forces are
    multiplied and motions divided by them. `travelled` (m) is the length of the motion before `rest`, if `rest` is a
    state in time.

    Convergence: the residual force is at most `tolerance` times the larger of load and reactions. In a stiff body or
    under a tiny load rounding alone can exceed this, since a strain of 1e-16 times a large stiffness is a force. If a
    Newton step no longer lowers the residual, one of two criteria decides. Either the error in the energy norm, sqrt(r
    . K^-1 r / 2E), is at most `tolerance`, with residual r, tangent K and strain energy E. Or the residual is within
    four times its rounding error, and the last Newton step, with a definite tangent, was below TINY times the motion so
    far: then no better state exists in this arithmetic.

    `resultant` (N) returns the resultant of forces (dofs,). If it is given, the resultant of the residual meets the
    tolerance as well, as far as one or two steps with the last factorisation achieve this.

    Options: `linear` selects the linear solver. `start` is a state from which full steps are tried before those from
    rest. With a `cap`, full steps stop after that many linear systems, with criterion "cap"; they also stop if the
    linear solver reaches a cap of its own. If `assembly` computes in single precision, `exact` is the same assembly in
    double precision, and gives the reported residual. A state is then refused if its residual and its error in the
    energy norm both exceed `rounded`.
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
    linear: LinearSolverOptions = field(default_factory=LinearSolverOptions)
    path: Literal["load", "arc_length"] = "load"
    start: Floats | None = None
    cap: int | None = None
    exact: Assembly | None = None
    rounded: float = 1e-3
    way: SupportPath | None = None
    resultant: Callable[[Floats], float] | None = None

    def with_energies(self, others: Mapping[str, Energy]) -> Self:
        """Return the problem with other energies of the same names, also in its corotational twin."""
        twin = None if self.twin is None else self.twin.with_energies(others)
        return replace(self, assembly=self.assembly.with_energies(others), twin=twin)

    @property
    def has_imposed_motion(self) -> bool:
        """True if a nonzero value is imposed, at full load or before."""
        return self.way is not None or bool(np.any(self.target))

    @property
    def may_contact(self) -> bool:
        """True if contact is possible, so that full steps may oscillate in and out of it."""
        return bool(self.assembly.rigid_contacts or self.assembly.pair_contacts)

    @property
    def has_rigid_bodies(self) -> bool:
        """True if there are rigid bodies."""
        return bool(self.assembly.rigid_contacts)

    @property
    def has_stabilizing_spring(self) -> bool:
        """True if a stabilising spring supports a body that only contact can hold."""
        return bool(self.assembly.internal_energies(STABILIZATION))

    @property
    def has_friction(self) -> bool:
        """True if there is friction that depends on the pressures of the present state."""
        return any(energy.has_friction for energy in (*self.assembly.internal, *self.assembly.loads))

    @property
    def largest_load_step(self) -> float:
        """Largest load step, as a fraction of the full load."""
        return 1.0 if self.way is None else min(1.0, self.way.largest_load_step)

    def lost_turn_message(self, x: Floats, load: float) -> str | None:
        """Return a message if a state at a load factor has lost rotations of its supports; else None.

        It is always None for small strain.
        """
        return None if self.way is None or self.convex else self.way.lost_turn_message(x, load)

    def imposed(self, begin: float, end: float) -> Floats:
        """Return the support increments (c,), m or rad, between two load fractions."""
        if self.way is None:
            found: Floats = (end - begin) * self.target
            return found
        return self.way.at(end) - self.way.at(begin)
