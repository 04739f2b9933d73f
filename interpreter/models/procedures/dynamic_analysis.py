"""Dynamic analysis of a static model of any discretization, and conversion of its trajectory to a solution."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.procedures import dynamic_warnings
from softmark.interpreter.models.procedures.derived_model import DerivedModel
from softmark.interpreter.models.procedures.dynamic_discretization import DynamicDiscretization, MotionFields
from softmark.interpreter.models.procedures.trajectory_report import friction_report, solve_report
from softmark.interpreter.models.shared import self_intersections
from softmark.interpreter.models.shared.mesh_notes import mesh_facts
from softmark.interpreter.models.shared.prepared_model import DeformedMesh, ModalErrors, Solution, Status
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.results.even_thinning import pick_evenly
from softmark.interpreter.results.motion_history import KEPT, History
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.self_contact_words import SelfContact
from softmark.records import dataclass
from softmark.solvers.dynamics.dynamic_problem import Dynamics, Rayleigh
from softmark.solvers.dynamics.integrator import Motion, StepTooLong
from softmark.solvers.dynamics.time_integration import march
from softmark.solvers.dynamics.time_step_resolution import Resolution, find_resolution, resolve_vibration
from softmark.solvers.dynamics.trajectory import Diverged, MotionNotConverged, Trajectory
from softmark.solvers.energies.energy import DynamicPatternEnergy, Floats
from softmark.solvers.statics.static_problem import Iteration

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from softmark.interpreter.models.postprocessing.contact_history_results import ContactHistoryResults
    from softmark.solvers.statics.static_equilibrium import Watch

LOOKED = 10  # stored states in which intersecting faces are searched for, because the search is slow
REMEDY = "use a smaller step, another integrator or more damping"


@dataclass(frozen=True)
class DynamicAnalysis(DerivedModel):
    """Dynamic analysis of a body, ready to solve. `static` is the static model of the body."""

    static: DynamicDiscretization
    declared: Declared
    case: Case
    problem: Dynamics

    @property
    def analysis(self) -> Dynamic:
        """Duration, time step and integrator as the scene declares them."""
        if not isinstance(analysis := self.case.analysis, Dynamic):
            raise TypeError("the analysis is static")
        return analysis

    def warm(self) -> None:
        """Compile the code that the solution needs, by two time steps, before timing starts."""
        super().warm()
        with suppress(MotionNotConverged, StepTooLong):  # it is for the solution to say so
            march(self.problem, 2 * self.analysis.step, self.analysis.step, lambda motion: None)

    def solve(self, watch: Watch) -> Solution:
        """Return the solution by time integration from the start to the end of the analysis."""
        found = self._integrate(watch)
        return replace(found, facts={**found.facts, **self.static.model_facts})

    def _integrate(self, watch: Watch) -> Solution:
        """Return the solution, or the reason why time integration failed."""
        steps = int(np.ceil(self.analysis.duration / self.analysis.step - 1e-9))
        keep = _StateRecorder(-(-steps // KEPT), partial(self.static.stored_state, self.problem), watch)
        try:
            track = march(self.problem, self.analysis.duration, self.analysis.step, keep)
        except StepTooLong as refused:
            message = f"{refused}; use a smaller step or an implicit integrator"
            return Solution("failed", message, {"critical_step_s": refused.critical})
        except MotionNotConverged as failure:
            status: Status = "diverged" if isinstance(failure, Diverged) else "not_converged"
            facts = solve_report(failure.trajectory, self.problem.tolerance)
            return Solution(status, f"{failure.reason}; {REMEDY}", facts)
        return self._make_solution(track, keep.indices, np.array(keep.states))

    def _make_solution(self, track: Trajectory, kept: list[int], states: Floats) -> Solution:
        """Return the solution of a trajectory, with its report and warnings; `states` (t, ...) have indices `kept`."""
        fields = self.static.motion_fields(track.times[kept], states)
        missed = int((~track.solved).sum())
        resolution = self._resolution()
        facts = solve_report(track, self.problem.tolerance) | friction_report(track, self.case)
        facts |= {} if self.mesh is None else mesh_facts(self.mesh)
        facts |= self._intersection_counts(fields.mesh)
        notes = (
            *dynamic_warnings.halved_step_warning(self.declared, track),
            *self_intersections.intersection_warnings(self.declared, facts),
            *dynamic_warnings.energy_warning(self.declared, self.analysis, track),
            *dynamic_warnings.dissipation_warning(self.declared, track, self.problem),
            *dynamic_warnings.time_step_warning(self.declared, self.analysis, resolution),
            *fields.notes,
        )
        facts |= {} if resolution is None else {"resolution": resolution.facts}
        return Solution(
            "capped" if missed else "converged",
            f"{missed} of {len(track.solved)} time steps were accepted unconverged" if missed else None,
            facts | fields.facts,
            fields.displacement,
            notes,
            self._history(track, kept, fields),
            fields.mesh,
            followed=self._contact_history(track),
            reduction_error=fields.reduction_error,
            step_errors=self._step_errors,
        )

    def _history(self, track: Trajectory, kept: list[int], fields: MotionFields) -> History:
        """Return the displacement history, with the times that steps took, events and energies."""
        step = self.analysis.step
        return History(
            track.times[kept],
            fields.history,
            tuple(_sums_per_step(track, track.wall, step).tolist()),
            tuple(_sums_per_step(track, track.cpu, step).tolist()),
            step,
            tuple((_sums_per_step(track, ~track.solved, step) == 0).tolist()),
            events=tuple((e.time, e.text) for e in track.events),
            energies={name: values[kept] for name, values in track.energies.items()},
        )

    def _resolution(self) -> Resolution | None:
        """Return how well the time step resolves the slowest vibration or, if worse, a rotation; None if unknown."""
        problem, times = self.problem, (self.analysis.duration, self.analysis.step)
        if problem.integrator.explicit or self.static.mode_field is None:
            return None
        if problem.turning is not None:
            problem.turning.reset()  # frequencies are those about rest
        with np.errstate(all="ignore"):
            found = find_resolution(problem, self.points, *times)
        spin = float(np.linalg.norm(self.analysis.spin))
        turn = resolve_vibration(problem.integrator, Rayleigh(problem.damping.alpha), spin, *times) if spin else None
        if turn is not None and (found is None or turn.error > found.error):
            return replace(turn, motion="turn")
        return found

    def _step_errors(self) -> ModalErrors | None:
        """Return the time-step error of small vibrations, with the field of each mode; None if unknown."""
        from softmark.solvers.dynamics.time_step_error import estimate_step_error

        if (mode_field := self.static.mode_field) is None:
            return None
        if self.problem.turning is not None:
            self.problem.turning.reset()
        with np.errstate(all="ignore"):
            found = estimate_step_error(self.problem, self.points, self.analysis.duration, self.analysis.step)
        if found is None:
            return None
        return ModalErrors(found, tuple(mode_field(self.problem, shape) for shape in found.shapes.T))

    def _contact_history(self, track: Trajectory) -> ContactHistoryResults | None:
        """Return the contact history of a trajectory; None if the body has no contacts."""
        if track.touched is None or self.mesh is None:
            return None
        from softmark.interpreter.models.postprocessing.contact_history_results import ContactHistoryResults

        small = vars(self.declared.thing).get("strain") == "small"
        contacts = self.problem.assembly.rigid_contacts
        return ContactHistoryResults(self.case, contacts, self._self_contacts, self.mesh, track, small)

    @property
    def _self_contacts(self) -> dict[str, DynamicPatternEnergy]:
        """Energy of each self-contact, by name."""
        names = [pair.name for pair in self.case.pairs if isinstance(pair.thing, SelfContact)]
        return dict(zip(names, self.problem.meets, strict=True))

    def _intersection_counts(self, mesh: DeformedMesh | None) -> dict[str, Any]:
        """Return the largest number of intersecting pairs of faces over stored states of the `mesh`, by contact."""
        if mesh is None or mesh.frames is None or not self.problem.meets:
            return {}
        known = [
            self_intersections.count_intersections(self._self_contacts, mesh.frames[i].ravel())
            for i in pick_evenly(len(mesh.frames), LOOKED)
        ]
        return {"crossings": {n: max(seen["crossings"][n] for seen in known) for n in known[0]["crossings"]}}


def _sums_per_step(track: Trajectory, values: NDArray[Any], step: float) -> Floats:
    """Return sums of values over each requested time step, s; the parts of a halved step are added to their step."""
    number = np.floor((track.times[:-1] + 1e-6 * step) / step).astype(int)
    return np.asarray(np.bincount(number, weights=values), dtype=np.float64)


@dataclass
class _StateRecorder:
    """Observer of time integration that stores every `every`-th state and the last, with their indices."""

    every: int
    state: Callable[[Motion], Floats]
    watch: Watch
    indices: list[int] = field(default_factory=list)
    states: list[Floats] = field(default_factory=list)
    count: int = 0

    def __call__(self, motion: Motion) -> None:
        """Store the state of a motion, free the state before if it is not needed, and report progress."""
        if self.count and (self.count - 1) % self.every:
            del self.indices[-1], self.states[-1]
        else:
            self.watch(Iteration("steps in time", 1.0, self.count, 0.0, 1.0))
        self.indices.append(self.count)
        self.states.append(self.state(motion))
        self.count += 1
