"""Static equilibrium: the state in which the energies' gradient vanishes on every free degree of freedom.

Two ways, in this order. The free one takes whole Newton steps: with the exact tangent of a corotational
energy they reach a 60-degree bend at full load in about six steps, because that energy grows with stretch
alone and not with its square; a stiffer law starts from the equilibrium of its corotational twin. What it
finds is kept only if it is a stable equilibrium without inverted cells. The careful one then starts again:
every step leads to less energy than one of the MEMORY states before it had (Armijo 1966; Grippo, Lampariello
and Lucidi 1986), the tangent is made definite where it is not, and the load comes in steps that shrink and
grow. Where it ends on an unstable equilibrium, as a straight column above its buckling load does, it steps
aside and goes on to a stable one.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from softmark.solvers import linear
from softmark.solvers.assembly import Assembly
from softmark.solvers.energies.energy import Floats, Ints, Space
from softmark.solvers.linear import Factor, Singular, factor

MEMORY = 10  # energies back that a step must stay below: bends are long curved valleys
RIGID = 1e-6  # least scale of a residual, of the force if the body stayed behind while its supports move
TINY = 1e-4  # of the motion so far: what a Newton step must stay below where rounding limits the residual

Criterion = Literal["residual", "energy", "rounding"]
Watch = Callable[["Iteration"], None]
Merit = Callable[[Floats, float], float]


@dataclass(frozen=True)
class Iteration:
    """One Newton iteration: the relative `residual` before it, and the part of the step that was taken."""

    phase: str  # "corotational start" | "free" | "careful" | "aside" (away from an unstable equilibrium)
    load: float
    number: int
    residual: float
    length: float


class NotConverged(Exception):
    """No equilibrium was found; `history` says how far each attempt came."""

    def __init__(self, reason: str, history: tuple[Iteration, ...] = ()) -> None:
        super().__init__(reason)
        self.reason = reason
        self.history = history


@dataclass(frozen=True)
class Equilibrium:
    """A converged state, its relative residual, and every iteration that led to it.

    `criterion` is which of those of `Statics` decided. `stable` is None where it could not be established, which
    happens under follower loads only.
    """

    x: Floats
    residual: float
    history: tuple[Iteration, ...]
    load_steps: int
    criterion: Criterion = "residual"
    stable: bool | None = True
    linear_solver: str = linear.NAME  # the last factorisation

    @property
    def iterations(self) -> int:
        """Linear systems solved, all phases and failed attempts included."""
        return len(self.history)


@dataclass(frozen=True)
class Statics:
    """A static problem: `rest` moves by `space` until `assembly` balances, with `target` imposed on `fixed`.

    `twin` is the assembly of the corotational law with the same moduli, or None; `sound` says whether a state
    is admissible (no inverted cell). `bold` tries whole steps first; rods, whose space already follows their
    rotation, need no such start. `convex` says that the energy is a positive quadratic form, whose one
    equilibrium is stable. `extent` is the size of the body in m; `weights` make degrees of freedom that are
    rotations comparable with displacements: forces are multiplied and motions divided by them.

    Converged means: the out-of-balance force is at most `tolerance` times the larger of load and reactions.
    In a stiff body or under a tiny load rounding alone can exceed that, since a strain of 1e-16 times a large
    stiffness is a force; when a Newton step no longer lowers it, one of two decides. Either the error in the
    energy norm, sqrt(r . K^-1 r / 2E), is at most `tolerance`, E the strain energy; or the force is within
    four times what rounding leaves in it, and the last Newton step, with a definite tangent, was below TINY
    times the motion so far: there is no better state in this arithmetic, and it is good to that part.
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
    bold: bool = True
    convex: bool = False
    extent: float = 1.0
    weights: Floats = field(default_factory=lambda: np.ones(1))  # (dofs,) or (1,)
    watch: Watch = field(default=lambda iteration: None)


def equilibrium(problem: Statics) -> Equilibrium:
    """The equilibrium under full load. Raises NotConverged with the history of all attempts."""
    history: list[Iteration] = []
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        if problem.bold:
            try:
                return _free(problem, history)
            except NotConverged:
                pass  # what it tried is in the history; the careful way starts again from rest
        return _careful(problem, history)


# ------------------------------------------------------------------ whole steps at full load


def _free(problem: Statics, history: list[Iteration]) -> Equilibrium:
    newton = _Newton(problem, history)
    x = problem.rest
    if problem.twin is not None:
        rough = replace(problem, assembly=problem.twin, tolerance=1e-2)
        start = _Newton(rough, history, "corotational start")
        x = start.whole_steps(start.impose(x, 1.0), cap=12)
        newton.moved, newton.towed = start.moved, start.towed
        x = newton.whole_steps(x, cap=20)
    else:
        x = newton.whole_steps(newton.impose(x, 1.0), cap=20)
    stable = problem.convex or newton.definite(x)
    if not stable and problem.assembly.conservative:
        raise NotConverged("the equilibrium is unstable", tuple(history))
    return _kept(newton, x, 1, stable or None)


# --------------------------------------------------------- decreasing energy, loads in steps


def _careful(problem: Statics, history: list[Iteration]) -> Equilibrium:
    newton = _Newton(problem, history, "careful")
    x, load, step, steps = problem.rest, 0.0, 1.0, 0
    while load < 1.0:
        target = min(1.0, load + step)
        try:
            x = newton.descend(newton.impose(x, target - load, target), target)
            load, steps = target, steps + 1
            step *= 2.0
        except NotConverged as failure:
            step = 0.5 * (target - load)
            if step < 1e-3:
                reached = f"the load could be raised to {100 * load:.4g} % only: {failure.reason}"
                raise NotConverged(reached, tuple(history)) from failure
    if problem.assembly.conservative:
        return _kept(newton, newton.stable(x), steps, True)
    return _kept(newton, x, steps, newton.definite(x) or None)


def _kept(newton: _Newton, x: Floats, steps: int, stable: bool | None) -> Equilibrium:
    """The equilibrium, unless cells are inside out. Raises NotConverged."""
    history = tuple(newton.history)
    if not newton.problem.sound(x):
        raise NotConverged("the equilibrium has inverted cells", history)
    solver = newton.last.name if newton.last else linear.NAME
    return Equilibrium(x, newton.residual(x, 1.0)[1], history, steps, newton.criterion, stable, solver)


class _Newton:
    """Newton iterations over one assembly; keeps the last factorisation and writes the history."""

    def __init__(self, problem: Statics, history: list[Iteration], phase: str = "free") -> None:
        self.problem = problem
        self.assembly = problem.assembly
        self.history = history
        self.phase = phase
        self.last: Factor | None = None
        self.criterion: Criterion = "residual"
        self.moved = 0.0  # length of all steps so far
        self.towed = 0.0  # force that the motion of the supports causes while the body stays behind
        self._close = self._tiny = False  # what the last step was
        self._before = np.inf

    def residual(self, x: Floats, load: float) -> tuple[Floats, float]:
        """Gradient (dofs,) and the norm of its free part, relative to the larger of load and reactions."""
        g = self.assembly.gradient(x, load)
        external = np.zeros_like(g)
        for energy in self.assembly.loads:
            energy.add_gradient(x, external, load)
        weighted = g * self.problem.weights
        forces = (external * self.problem.weights, weighted[self.problem.fixed], weighted[self.assembly.free])
        load_size, reactions, size = (float(np.linalg.norm(f)) for f in forces)
        scale = max(load_size, reactions, RIGID * self.towed)
        return g, size / scale if scale > 0 else size

    def impose(self, x: Floats, fraction: float, load: float = 1.0) -> Floats:
        """Move the supports by a fraction of their target, and the body with them as its tangent says."""
        problem = self.problem
        if not np.any(problem.target):
            return x
        d = np.zeros(self.space.dofs)
        d[problem.fixed] = fraction * problem.target
        eps = 1e-6 / max(1.0, float(np.abs(d).max()) * 1e3)
        g = self.assembly.gradient(x, load)
        coupling = (self.assembly.gradient(self.space.move(x, eps * d), load) - g) / eps
        self.towed = max(self.towed, float(np.linalg.norm(coupling)))
        d[self.assembly.free] = -self._solve(x, load, coupling[self.assembly.free], projected=True)
        return self._moved(x, d, 1.0)

    @property
    def space(self) -> Space:
        """Where the state lives."""
        return self.problem.space

    def whole_steps(self, x: Floats, cap: int) -> Floats:
        """Whole Newton steps at full load, shortened only to stay in the domain of the law."""
        self._close = self._tiny = False
        for number in range(cap + 1):
            g, residual = self.residual(x, 1.0)
            if self._done(x, g, residual):
                return x
            if number == cap or not np.isfinite(residual):
                break
            d = self._direction(g, x, 1.0, projected=False)
            self._judge(x, g, d)
            x, length = self._inside(x, d)
            self._record(1.0, number, residual, length)
        raise NotConverged(f"whole Newton steps stopped at a residual of {residual:.1e}", tuple(self.history))

    def _inside(self, x: Floats, d: Floats) -> tuple[Floats, float]:
        length = 1.0
        while length > 1e-3:
            y = self.space.move(x, length * d)
            if np.isfinite(sum(e.value(y) for e in self.assembly.internal)):
                return self._moved(x, d, length), length
            length *= 0.5
        raise NotConverged("no step stays in the domain of the law", tuple(self.history))

    def descend(self, x: Floats, load: float) -> Floats:
        """Newton steps that decrease the energy (or, for follower loads, the residual) within MEMORY."""
        merit = self._energy if self.assembly.conservative else self._imbalance
        value = merit(x, load)
        if not np.isfinite(value):
            raise NotConverged("the supports' motion turns cells inside out", tuple(self.history))
        self._close = self._tiny = False
        recent = deque([value], MEMORY)
        for number in range(self.problem.max_iterations + 1):
            g, residual = self.residual(x, load)
            if self._done(x, g, residual):
                return x
            if number == self.problem.max_iterations or not np.isfinite(residual):
                break
            x, value, length = self._decrease(x, load, g, max(recent), merit)
            recent.append(value)
            self._record(load, number, residual, length)
        reason = f"no equilibrium within {number} iterations at {100 * load:.4g} % of the load"
        raise NotConverged(f"{reason}, residual {residual:.1e}", tuple(self.history))

    def _done(self, x: Floats, g: Floats, residual: float) -> bool:
        """The tolerance is met, or rounding is all that is left (see Statics)."""
        self.criterion = "residual"
        if residual <= self.problem.tolerance:
            return True
        size = float(np.linalg.norm(g[self.assembly.free]))
        floor = 4.0 * self.assembly.rounding(x)
        stalled = 0.3 * self._before < size <= 4.0 * max(self._before, floor)
        self._before = size
        self.criterion = "energy" if self._close else "rounding"
        return stalled and (self._close or (self._tiny and size <= floor))

    def _judge(self, x: Floats, g: Floats, d: Floats, projected: bool = False) -> None:
        """Whether the error in the energy norm, sqrt(-g . d), is small, and whether the Newton step d is."""
        E = sum(e.value(x) for e in self.assembly.internal)
        close = bool(0.0 <= -(g @ d) <= 2.0 * E * self.problem.tolerance**2)
        tiny = bool(np.linalg.norm(d / self.problem.weights) <= TINY * self.moved)
        definite = (close or tiny) and not projected and not self._indefinite()
        self._close, self._tiny = close and definite, tiny and definite

    def _indefinite(self) -> bool:
        """Whether the last tangent has negative eigenvalues; that of follower loads is not asked."""
        return bool(self.assembly.conservative and self.last is not None and self.last.negative_pivots)

    def _moved(self, x: Floats, d: Floats, length: float) -> Floats:
        self.moved = float(np.hypot(self.moved, length * np.linalg.norm(d / self.problem.weights)))
        return self.space.move(x, length * d)

    def _energy(self, x: Floats, load: float) -> float:
        return self.assembly.value(x, load)

    def _imbalance(self, x: Floats, load: float) -> float:
        if not np.isfinite(sum(e.value(x) for e in self.assembly.internal)):
            return np.inf
        return 0.5 * float(np.linalg.norm(self.assembly.gradient(x, load)[self.assembly.free]) ** 2)

    def _decrease(
        self, x: Floats, load: float, g: Floats, value: float, merit: Merit
    ) -> tuple[Floats, float, float]:
        """Backtrack along the Newton direction, or that of the definite tangent where the first fails."""
        for projected in (False, True):
            d = self._direction(g, x, load, projected)
            self._judge(x, g, d, projected)
            if not projected and self._indefinite():  # it leads to a saddle
                continue
            if self._close or self._tiny:  # differences of energy are noise now
                y = self._moved(x, d, 1.0)
                return y, merit(y, load), 1.0
            slope = float(g @ d) if self.assembly.conservative else -2.0 * merit(x, load)
            length = self._armijo(x, load, d, value, slope, merit)
            if projected and length == 1.0:
                length = self._lengthen(x, load, d, merit)
            if length:
                y = self._moved(x, d, length)
                return y, merit(y, load), length
        raise NotConverged("no step decreases the energy", tuple(self.history))

    def _armijo(self, x: Floats, load: float, d: Floats, value: float, slope: float, merit: Merit) -> float:
        """The fraction of d that decreases the merit enough (Armijo 1966), 0 where none does."""
        length = 1.0 if np.isfinite(slope) and slope < 0 else 0.0
        while length > 1e-5:
            enough = value + 1e-4 * length * slope + 1e-14 * abs(value)
            if merit(self.space.move(x, length * d), load) <= enough:
                return length
            length *= 0.5
        return 0.0

    def _lengthen(self, x: Floats, load: float, d: Floats, merit: Merit) -> float:
        """How far along d the merit decreases, by doubling: a definite tangent leaves a saddle too slowly."""
        length, value = 1.0, merit(self.space.move(x, d), load)
        while length < 1e3 and (there := merit(self.space.move(x, 2.0 * length * d), load)) < value:
            length, value = 2.0 * length, there
        return length

    def definite(self, x: Floats) -> bool:
        """Whether the tangent in x, for follower loads its symmetric part, has no negative eigenvalue."""
        K = self.assembly.tangent(x, 1.0)
        try:
            self.last = factor(K if self.assembly.conservative else (0.5 * (K + K.T)).tocsr())
        except Singular:
            return False
        return self.last.negative_pivots == 0

    def stable(self, x: Floats) -> Floats:
        """x, or a stable equilibrium of less energy where x is unstable. Raises NotConverged."""
        for _ in range(5):
            if self.definite(x):
                return x
            self.phase = "aside"
            x = self.descend(self._aside(x), 1.0)
        raise NotConverged("every equilibrium found is unstable", tuple(self.history))

    def _aside(self, x: Floats) -> Floats:
        """A state of less energy along the most unstable direction. Raises NotConverged where there is none.

        Power iteration on I - K+^-1 K, K+ the definite tangent: only negative eigenvalues of K grow in it.
        """
        free = self.assembly.free
        K, definite = self.assembly.tangent(x, 1.0), self._factor(x, 1.0, projected=True)
        d = np.zeros(self.space.dofs)
        d[free] = np.random.default_rng(0).standard_normal(len(free))
        for _ in range(50):
            d[free] -= definite.solve(K @ d[free])
            d[free] /= np.linalg.norm(d[free])
        d *= 0.1 * self.problem.extent / np.abs(d / self.problem.weights).max()
        value = self._energy(x, 1.0)
        for length in 0.5 ** np.arange(20):
            y = self.space.move(x, length * d)
            if self._energy(y, 1.0) < value - 1e-10 * abs(value):
                return y
        raise NotConverged("it is unstable, and no state beside it has less energy", tuple(self.history))

    def _direction(self, g: Floats, x: Floats, load: float, projected: bool) -> Floats:
        d = np.zeros(self.space.dofs)
        d[self.assembly.free] = -self._solve(x, load, g[self.assembly.free], projected)
        return d

    def _solve(self, x: Floats, load: float, b: Floats, projected: bool) -> Floats:
        return self._factor(x, load, projected).solve(b)

    def _factor(self, x: Floats, load: float, projected: bool) -> Factor:
        K = self.assembly.tangent(x, load, projected)
        try:
            self.last = factor(K, symmetric=projected or self.assembly.conservative)
        except Singular as error:
            raise NotConverged(f"the tangent is singular ({error})", tuple(self.history)) from error
        return self.last

    def _record(self, load: float, number: int, residual: float, length: float) -> None:
        iteration = Iteration(self.phase, load, number, residual, length)
        self.history.append(iteration)
        self.problem.watch(iteration)
