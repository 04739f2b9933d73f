"""Quasistatic analysis of a body whose material has a history, by a sequence of equilibria in time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.procedures.derived_model import DerivedModel
from softmark.interpreter.models.procedures.quasistatic_times import SAME, LoadAndSupportAmplitudes
from softmark.interpreter.models.shared import static_result
from softmark.interpreter.models.shared.prepared_model import BuiltModel, DeformedMesh, Solution
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.vocabulary.analysis_words import Quasistatic
from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.viscoelastic_memory import BodyHistory
from softmark.solvers.statics.quasistatic_history import InstantLoading, StateInTime, advance_through, state_at_rest

if TYPE_CHECKING:
    from softmark.solvers.statics.static_equilibrium import Equilibrium, Statics, Watch

Loads = Sequence[tuple[Declared, Energy]]  # each load separately


class QuasistaticDiscretization(BuiltModel, Protocol):
    """Static model that a quasistatic analysis can advance in time."""

    @property
    def problem(self) -> Statics:
        """Static problem with all loads at full size and with the instantaneous law."""

    @property
    def amplitude_scaled_energies(self) -> Loads:
        """Energies of loads and then of muscles, one of each."""

    @property
    def inner_stages(self) -> tuple[float, ...]:
        """Parts of a time step after which there is also an equilibrium."""

    @property
    def remedy(self) -> str:
        """Advice if there is no equilibrium."""

    @property
    def describe_free_motion(self) -> Callable[[Floats], str] | None:
        """Function that describes a motion (dofs,) that no stiffness resists."""

    def scaled_forces(self, shares: Sequence[float]) -> list[Floats]:
        """Return the forces (n, 3), N, of each load at a share of its full size, on the undeformed body."""

    def solution_in_time(self, found: Equilibrium, state: StateInTime, acting: Loads) -> Solution:
        """Return the solution of a state with its history; `acting` are loads and muscles at its time."""


@dataclass(frozen=True)
class QuasistaticAnalysis(DerivedModel):
    """Quasistatic analysis, ready to solve. `static` is the same body with all loads at full size.

    `timed` are the amplitudes of loads and muscles. The analysis continues from the state `before`.
    """

    static: QuasistaticDiscretization
    case: Case
    memories: BodyHistory
    timed: LoadAndSupportAmplitudes
    before: StateInTime | None = None

    @property
    def analysis(self) -> Quasistatic:
        """Quasistatic analysis at one of its output times."""
        return self.timed.analysis

    def forces(self) -> list[tuple[Declared, Floats]]:
        """Return each load at the present time with its forces (n, 3), N, on the undeformed body."""
        shares = self.timed.at(self.analysis.now, False).shares
        return list(zip(self.case.loads, self.static.scaled_forces(shares[: len(self.case.loads)]), strict=True))

    def after(self, before: DeformedMesh) -> QuasistaticAnalysis:
        """Return the analysis that continues from the state at the previous output time, if it is known."""
        return replace(self, before=getattr(before, "aged", None))

    def warm(self) -> None:
        """Compile the code that the solution needs, before timing starts."""
        super().warm()
        problem = self.static.problem
        for energy in self.memories.over(0.0):
            energy.add_gradient(problem.rest, np.zeros(problem.assembly.dofs))

    def solve(self, watch: Watch) -> Solution:
        """Return the solution at the present time, by time steps from the start or from the previous state."""
        problem, static = replace(self.static.problem, watch=watch), self.static
        first = self.before if self.before is not None else state_at_rest(problem, self.memories)
        came: list[StateInTime] = []

        def find() -> Equilibrium:
            """Return the equilibrium at the present time."""
            came.append(advance_through(problem, first, self._step_loadings()))
            found = came[0].found
            assert found is not None
            return replace(found, history=came[0].history[len(first.history) :])

        def finish(found: Equilibrium) -> Solution:
            """Return the solution of the equilibrium at the present time."""
            acting = self.timed.acting(static.amplitude_scaled_energies, came[0].time)
            return static.solution_in_time(found, came[0], acting)

        return static_result.solve_static(find, static.remedy, finish, static.describe_free_motion)

    def _step_loadings(self) -> list[InstantLoading]:
        """Return loads and supports at every stage of every time step since the previous output time."""
        begin, found = 0.0 if self.before is None else self.before.time, list[InstantLoading]()
        for end in self.timed.after(None if self.before is None else begin):
            step = end.time - begin
            stages = self.static.inner_stages if step > SAME * self.analysis.step else ()
            found += [*(self.timed.at(begin + part * step, False) for part in stages), end]
            begin = end.time
        return found


def energies_in_time(state: StateInTime) -> dict[str, Any]:
    """Return the part of a report on the energies of a state, J; None where they are unknown."""
    none = state.memories.has_unknown_energy
    return {
        "energies_in_time": {
            "work_J": state.work,
            "stored_J": None if none else state.stored,
            "dissipated_J": None if none else state.dissipated,
            "time_s": state.time,
            "steps_in_time": len(state.times),
        }
    }
