"""Solids that remember, in the time of a quasistatic analysis: from what a scene says to a march of equilibria."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.scene import Declared
from softmark.interpreter.models.answers import carried, vibrations
from softmark.interpreter.models.fem.build import PreparedSolid, at_rest, elastic_of, mass_of
from softmark.interpreter.models.shared import motion, outcome
from softmark.interpreter.models.shared.deformed import Deformed, displacement_of
from softmark.interpreter.models.shared.holding import held_values
from softmark.interpreter.models.shared.meshing import mesh_facts
from softmark.interpreter.models.shared.on_mesh import OnMesh
from softmark.interpreter.models.shared.prepared import Moved, Prepared, Solution, Workshop
from softmark.interpreter.models.shared.viscous import came_back
from softmark.interpreter.problem.case import Case
from softmark.interpreter.vocabulary.analyses import Dynamic, Quasistatic
from softmark.interpreter.vocabulary.courses import Pulse, Ramp, Smooth, Table, in_full, off_the_steps
from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.remembering import Memories, Memory
from softmark.solvers.materials.relaxing import series_of
from softmark.solvers.statics.ageing import Aged, Instant, aged, begun, followed

if TYPE_CHECKING:
    from softmark.interpreter.models.fem.words import Fem
    from softmark.solvers.mesh.mesh import Mesh
    from softmark.solvers.mesh.shape import Shape
    from softmark.solvers.statics.equilibrium import Watch

SAME = 1e-9  # of a step: times that are nearer are one
KINKED = 1e-3  # of a table's largest value: steps end at its rows that are farther from what steps make of it
BEFORE = 1e-9  # of a step: where a course is looked at before it jumps


@dataclass(frozen=True)
class Past:
    """How the nodes have moved so far: times (t,), s, and displacements at each (t, n, 3), m."""

    times: tuple[float, ...]
    states: tuple[Floats, ...]


@dataclass(frozen=True)
class Remembered(Deformed):
    """A deformed mesh that knows how it came there: `aged` is what a later time goes on from."""

    past: Past | None = None
    aged: Aged | None = None


@dataclass(frozen=True)
class PreparedAged(OnMesh):
    """A body that remembers: `static` is the same at full size of all that acts, with the law that it has at once."""

    static: PreparedSolid
    case: Case
    memories: Memories
    courses: tuple[Any, ...]  # of every load
    movers: tuple[tuple[Any, Floats], ...]  # a course, and which of what supports impose (c,) follows it
    before: Aged | None = None

    @property
    def shape(self) -> Shape:  # type: ignore[override]
        """Of the body."""
        return self.static.shape

    @property
    def mesh(self) -> Mesh:  # type: ignore[override]
        """Of the body."""
        return self.static.mesh

    @property
    def applied(self) -> tuple[tuple[Declared, Energy], ...]:  # type: ignore[override]
        """Every load by itself, as it acts now."""
        from softmark.solvers.energies.loads import Share

        each = zip(self.case.loads, self.static.applied, self.courses, strict=True)
        return tuple((load, Share(energy, course.at(self._now))) for load, (_, energy), course in each)

    @property
    def size(self) -> dict[str, int]:
        """nodes, elements, dofs."""
        return self.static.size

    @property
    def notes(self) -> tuple[Diagnostic, ...]:
        """Warnings about what was built."""
        return self.static.notes

    @property
    def assembly(self) -> None:
        """It is another at every time."""
        return

    @property
    def analysis(self) -> Quasistatic:
        """At one of its times."""
        found: Any = self.case.analysis
        return found  # type: ignore[no-any-return]

    @property
    def _now(self) -> float:
        return self.analysis.now

    def after(self, before: Moved) -> PreparedAged:
        """The same, to go on from the time before."""
        return replace(self, before=before.aged) if isinstance(before, Remembered) else self

    def warm(self) -> None:
        """Compile what the solution needs."""
        self.static.warm()
        for own in self.memories.each:
            if isinstance(own, Memory):
                own.over(0.0).add_gradient(self.static.problem.rest, np.zeros_like(self.static.problem.rest))

    # ------------------------------------------------------------------ time

    def instants(self) -> list[Instant]:
        """What acts at the end of every step up to now, after that of the state before."""
        begin = -1.0 if self.before is None else self.before.time
        near = SAME * self.analysis.step
        return [self._instant(t, jumps) for t, jumps in self._grid() if begin + near < t <= self._now + near]

    def _grid(self) -> Iterator[tuple[float, bool]]:
        """The ends of steps, and whether it is just before a jump: the start, every step, every time, every break."""
        analysis, near = self.analysis, SAME * self.analysis.step
        times = {analysis.step * i for i in range(int(np.ceil(analysis.duration / analysis.step * (1.0 - SAME))))}
        times |= {analysis.duration, *map(float, analysis.moments)}
        courses = {*self.courses, *(course for course, _ in self.movers)}
        jumps = {t for c in courses if isinstance(c, Pulse) for t in (c.start, c.until)}
        times |= jumps | {t for c in courses if isinstance(c, Ramp | Smooth) for t in (c.start, c.start + c.over)}
        tables = (off_the_steps(c.rows, analysis.step, analysis.duration) for c in courses if isinstance(c, Table))
        times |= {t for rows in tables for t, off in rows if off > KINKED}
        last = -1.0
        for t in sorted(times):
            if t - last <= near or t > analysis.duration + near:
                continue
            if t > 0.0 and any(abs(t - jump) <= near for jump in jumps):
                yield t, True
            yield t, False
            last = t

    def _instant(self, t: float, before: bool) -> Instant:
        at = t - BEFORE * self.analysis.step if before else t
        target = self.static.problem.target.copy()
        for course, which in self.movers:
            target[which] *= course.at(at)
        return Instant(t, tuple(course.at(at) for course in self.courses), target)

    # ------------------------------------------------------------------ solving

    def solve(self, watch: Watch) -> Solution:
        """March from the start, or from the state before, to now."""
        remedy = "try a shorter step, a smaller load, a finer mesh or another strain measure"
        problem = replace(self.static.problem, watch=watch)
        first = self.before if self.before is not None else begun(problem, self.memories)
        came: list[Aged] = [first]

        def find() -> Any:
            came[0] = followed(problem, first, self.instants())
            if came[0].found is None:
                came[0] = aged(problem, came[0], self._instant(self._now, False))
            found: Any = came[0].found
            return replace(found, history=came[0].history[len(first.history) :])

        return outcome.solution(find, remedy, lambda found: self._finish(found, came[0]), self.static._loose)

    def _finish(self, found: Any, state: Aged) -> Solution:
        static = self.static
        x = static.unknowns.moved(state.x)
        u = x.reshape(-1, 3)
        solution = outcome.found(found, displacement_of(static.mesh, u))
        notes = (*static._misread_rotation(x), *static._beyond_its_law(x), *outcome.doubts(static.declared, found),
                 *self._doubts(state))  # fmt: skip
        stored = state.stored
        energies = {"work_J": state.work, "stored_J": stored, "dissipated_J": state.dissipated,
                    "time_s": state.time, "steps_in_time": len(state.times)}  # fmt: skip
        facts = solution.facts | mesh_facts(static.mesh) | {"energies_in_time": energies}
        left = None if found.left is None else static.unknowns.moved(found.left).reshape(-1, 3)
        pressures = static.unknowns.pressed(static.solid, static.pieces, state.x)
        moved = Remembered(static.mesh, u, pressures=pressures, left=left, past=self._past(state), aged=state)
        ring = vibrations.none("what remembers has no stiffness that frequencies follow from")
        seen = replace(solution, facts=facts, notes=notes, mesh=moved, vibrations=ring)
        return replace(seen, carried=cache(lambda: self._carried(state, x, stored)))

    def _past(self, state: Aged) -> Past:
        each = tuple(self.static.unknowns.moved(x).reshape(-1, 3) for x in state.states)
        return Past(state.times, each)

    def _carried(self, state: Aged, u: Floats, stored: float) -> carried.Carried:
        small = self.static.model.strain == "small"
        if state.problem is None:
            raise ValueError("nothing was solved")
        found = carried.on_mesh(self.mesh, state.x, u, state.problem.assembly, self.applied, small, True,
                                self.static.axial)  # fmt: skip
        found = replace(found, energy=stored, dissipated=state.dissipated)
        return carried.bedded(found, self.static.beds) if self.static.beds else found

    def _doubts(self, state: Aged) -> Iterator[Diagnostic]:
        """A warning where dissipated energy has come back."""
        yield from came_back(self.static.declared, np.array((0.0, *state.losses)), abs(state.work))


# ------------------------------------------------------------------ building


def in_motion(model: Fem, declared: Declared, case: Case, workshop: Workshop) -> Prepared:
    """The body in motion, with what its points remember. Raises Fault."""
    from softmark.solvers.dynamics.midpoint import Midpoint
    from softmark.solvers.dynamics.remembering import Remembering

    static, parts = at_rest(model, declared, case, workshop)
    known = _remembered(model, static)
    mass, loads = mass_of(model, case, static.mesh, parts), [*static.applied]
    made = motion.in_motion(static, declared, case, static.mesh, mass, known.energies, loads, static.problem)
    remembering = Remembering(known, isinstance(made.problem.integrator, Midpoint))
    return replace(made, problem=replace(made.problem, remembering=remembering, lagged=False))


def prepare(model: Fem, declared: Declared, case: Case, workshop: Workshop) -> Prepared:
    """The body at full size of all that acts, and what its points remember. Raises Fault."""
    if isinstance(case.analysis, Dynamic):
        return in_motion(model, declared, case, workshop)
    whole = _whole(case)
    static, _ = at_rest(model, declared, whole, workshop)
    loads = tuple(energy for _, energy in static.applied)
    problem = static.problem
    memories, old = _remembered(model, static), problem.assembly
    assembly = Assembly(old.dofs, problem.fixed, memories.energies, static.unknowns.loads(list(loads)), old.points)
    static = replace(static, problem=replace(problem, assembly=assembly, twin=None))
    courses = tuple(motion.course_of(load) for load in whole.loads)
    movers = _movers(whole, static.mesh, workshop, problem.fixed)
    return PreparedAged(static, case, memories, courses, movers)


def _whole(case: Case) -> Case:
    """The case with all that acts at its full size."""

    def full(declared: Declared) -> Declared:
        return replace(declared, thing=in_full(declared.thing))

    return replace(case, loads=tuple(map(full, case.loads)), supports=tuple(map(full, case.supports)))


def _movers(case: Case, mesh: Mesh, workshop: Workshop, fixed: Any) -> tuple[tuple[Any, Floats], ...]:
    """Which of the held degrees of freedom (c,) follow which course."""
    owners = held_values(case, mesh, workshop.measured)
    found: dict[Any, Any] = {}
    for place, dof in enumerate(fixed.tolist()):
        found.setdefault(motion.course_of(owners[dof][1]), []).append(place)
    return tuple((course, np.array(places)) for course, places in found.items())


def _remembered(model: Fem, static: PreparedSolid) -> Memories:
    """The energy of each piece, with a memory where its material relaxes, and those of beds."""
    found: list[Memory | Energy] = []
    for own, energy in zip(static.pieces, static.solid, strict=True):
        material = own.case.material
        if not material.branches:
            found.append(energy)
            continue
        plain: Any = energy
        if model.formulation == "displacement":
            plain = elastic_of(own.case, own.mesh, own.parts, model.strain)
        found.append(Memory.at_rest(plain, series_of(material, model.strain)))
    return Memories((*found, *static.beds.values()))
