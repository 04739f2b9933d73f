"""Quasistatic history of materials with memory: a sequence of equilibria with history variables.

Each equilibrium is a static problem for the energies of one time step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.external_loads import ScaledLoad
from softmark.solvers.energies.viscoelastic_memory import BodyHistory
from softmark.solvers.runtime.work_count import count_time_step
from softmark.solvers.statics.static_equilibrium import Equilibrium, Iteration, NotConverged, Statics, equilibrium


@dataclass(frozen=True)
class InstantLoading:
    """Loading at one time, s: factors (l,) of the loads, and imposed displacements (c,), m."""

    time: float
    shares: tuple[float, ...]
    target: Floats


@dataclass(frozen=True, eq=False)
class StateInTime:
    """State `x` (dofs,) at `time`, s, with the history variables of its energies, and works since the start, J.

    `work` is that of internal forces and of prescribed pore pressures. `times` and `states` are those of all steps so
    far; a jump of the loading has two entries.
    """

    x: Floats
    time: float
    memories: BodyHistory
    forces: Floats
    work: float = 0.0
    times: tuple[float, ...] = ()
    states: tuple[Floats, ...] = ()
    losses: tuple[float, ...] = ()  # energy dissipated up to each of the times, J
    history: tuple[Iteration, ...] = field(default=(), repr=False)
    imposed: Floats | None = None  # displacements imposed by supports, from rest (c,), m or rad
    found: Equilibrium | None = None  # last equilibrium
    problem: Statics | None = None

    @property
    def stored(self) -> float:
        """Energy stored in the springs of all viscoelastic models, J."""
        return self.memories.stored(self.x)

    @property
    def dissipated(self) -> float:
        """Energy dissipated since the start, J."""
        return self.memories.dissipated


def state_at_rest(problem: Statics, memories: BodyHistory) -> StateInTime:
    """Return the rest state before any loading."""
    return StateInTime(problem.rest, 0.0, memories, np.zeros(problem.assembly.dofs))


def advance_in_time(problem: Statics, before: StateInTime, to: InstantLoading) -> StateInTime:
    """Return the equilibrium at a later time, or at the same time after a jump of the loading. Raises NotConverged."""
    count_time_step()
    h = max(0.0, to.time - before.time)
    internal = before.memories.over(h)
    loads = [ScaledLoad(load, share) for load, share in zip(problem.assembly.loads, to.shares, strict=True)]
    now = replace(problem, assembly=problem.assembly.with_internal_and_loads(internal, loads), twin=None)
    if problem.rest.size == problem.assembly.dofs:
        step = replace(now, target=to.target, start=before.x if before.times else None)
    else:  # with rotations the distance between states is no difference of numbers
        imposed = to.target if before.imposed is None else to.target - before.imposed
        travelled = float(np.linalg.norm((before.x - problem.rest).reshape(-1, 7)[:, :3]))
        step = replace(now, rest=before.x, target=imposed, travelled=travelled)
    found = equilibrium(step)
    x = found.x
    memories = before.memories.history_after_step(x, h)
    forces = np.zeros(problem.assembly.dofs)
    for energy in internal:
        energy.add_gradient(x, forces)
    if (worked := memories.internal_work) is not None:
        work = worked - before.work
    elif h > 0.0:
        work = 0.5 * float((before.forces + forces) @ _without_pressures(internal, x - before.x))
        work += memories.pore_pressure_work - before.memories.pore_pressure_work
    else:  # a jump is elastic, and has an energy
        work = sum(e.value(x) - e.value(before.x) for e in internal)
    after = replace(before, x=x, time=to.time, memories=memories, forces=forces, work=before.work + work, found=found,
                    problem=step, history=before.history + found.history, imposed=to.target)  # fmt: skip
    lost = after.dissipated
    return replace(after, times=(*before.times, to.time), states=(*before.states, x), losses=(*before.losses, lost))


def _without_pressures(internal: Sequence[Energy], d: Floats) -> Floats:
    """Return a motion d (dofs,) with zeros for pressure unknowns, whose entries of the gradient are volumes."""
    for energy in [e for e in list[Any](internal) if e.saddle]:
        d[energy.pressures] = 0.0
    return d


def advance_through(problem: Statics, before: StateInTime, instants: Sequence[InstantLoading]) -> StateInTime:
    """Return the state after all instants in turn.

    Raises NotConverged, whose reason contains the time.
    """
    for to in instants:
        try:
            before = advance_in_time(problem, before, to)
        except NotConverged as failure:
            reason = f"at {to.time:.6g} s: {failure.reason}"
            raise NotConverged(reason, before.history + failure.history, failure.facts, failure.unstable,
                               failure.loose) from failure  # fmt: skip
    return before
