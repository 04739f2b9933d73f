"""Dynamic analyses of solid models: setup of time integration from the scene, and conversion to a solution."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import field, fields, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.shared import self_intersections
from softmark.interpreter.models.shared.mesh_notes import mesh_facts
from softmark.interpreter.models.shared.prepared_model import DeformedMesh, ModalErrors, Prepared, Solution, Status
from softmark.interpreter.problem.amplitude_tables import table_fault
from softmark.interpreter.problem.body_case import Case, Fault, RigidBodyContact
from softmark.interpreter.results.even_thinning import pick_evenly
from softmark.interpreter.results.motion_history import KEPT, History
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly, number_energies
from softmark.solvers.dynamics import INTEGRATORS, Integrator
from softmark.solvers.dynamics.dynamic_problem import Dynamics, Rayleigh
from softmark.solvers.dynamics.energy_balance import LOSS
from softmark.solvers.dynamics.integrator import Motion, StepTooLong
from softmark.solvers.dynamics.load_amplitudes import Amplitude, Constant
from softmark.solvers.dynamics.time_integration import march
from softmark.solvers.dynamics.time_step_resolution import WRONG, Resolution, find_resolution, resolve_vibration
from softmark.solvers.dynamics.trajectory import ContactHistory, Diverged, MotionNotConverged, Trajectory
from softmark.solvers.energies.energy import DynamicPatternEnergy, Energy, Floats, LaggedTangentEnergy
from softmark.solvers.statics.static_problem import Iteration

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from softmark.interpreter.models.postprocessing.contact_history_results import ContactHistoryResults
    from softmark.solvers.dynamics.time_step_error import StepError
    from softmark.solvers.mesh.mesh import Mesh
    from softmark.solvers.statics.static_equilibrium import Statics, Watch

LOOKED = 10  # stored states in which intersecting faces are searched for, because the search is slow
MOMENTS = 200  # number of times at which a report has energies
BOUNCES = 50  # largest number of impacts in a report
KEEPS = "trapezoidal"  # integrator with the least numerical damping
REMEDY = "use a smaller step, another integrator or more damping"


@dataclass(frozen=True)
class PreparedMotion:
    """Dynamic analysis of a body, ready to solve. `static` is the static model of the body, with its mesh."""

    static: Prepared
    declared: Declared
    analysis: Dynamic
    problem: Dynamics
    mesh: Mesh | None
    case: Case | None = field(default=None, kw_only=True)  # case, needed for contacts

    @property
    def friction_contact_names(self) -> tuple[str, ...]:
        """Names of rigid contacts with friction, followed by self-contacts with friction."""
        meet: tuple[Any, ...] = () if self.case is None else (*self.case.contacts, *self.case.pairs)
        return tuple(touch.name for touch in meet if getattr(touch.thing, "friction", 0.0))

    @property
    def beds(self) -> Any:
        """Foundations, ties and self-contacts by name; only finite element models have them."""
        return getattr(self.static, "beds", {})

    @property
    def size(self) -> Mapping[str, int]:
        """Numbers of nodes, elements and degrees of freedom, by name."""
        return self.static.size

    @property
    def notes(self) -> tuple[Diagnostic, ...]:
        """Warnings found while the static model was built."""
        return self.static.notes

    @property
    def assembly(self) -> None:
        """Energies in terms of nodal displacements: None, because only static models provide them."""
        return

    @property
    def points(self) -> Floats:
        """Undeformed points (n, 3), m, at which loads act."""
        return self.static.points

    def after(self, before: DeformedMesh) -> Self:
        """Return the analysis itself, because a dynamic analysis is not a sequence of states."""
        return self

    def forces(self) -> Sequence[tuple[Declared, Floats]]:
        """Return each load at full size with its forces (n, 3), N, on the undeformed body."""
        return self.static.forces()

    def warm(self) -> None:
        """Compile the code that the solution needs, by two time steps, before timing starts."""
        self.static.warm()
        with suppress(MotionNotConverged, StepTooLong):  # it is for the solution to say so
            march(self.problem, 2 * self.analysis.step, self.analysis.step, lambda motion: None)

    def outside(self, X: Floats) -> float:
        """Return the largest distance, m, by which points X (n, 3), m, lie outside the mesh."""
        return self.static.outside(X)

    def solve(self, watch: Watch) -> Solution:
        """Return the solution by time integration from the start to the end of the analysis."""
        steps = int(np.ceil(self.analysis.duration / self.analysis.step - 1e-9))
        every = -(-steps // KEPT)
        keep = _StateRecorder(every, self._state, watch)
        try:
            track = march(self.problem, self.analysis.duration, self.analysis.step, keep)
        except StepTooLong as refused:
            message = f"{refused}; use a smaller step or an implicit integrator"
            return Solution("failed", message, {"critical_step_s": refused.critical})
        except Diverged as gained:
            return Solution("diverged", f"{gained.reason}; {REMEDY}", _facts(gained.trajectory, self.problem.tolerance))
        except MotionNotConverged as failure:
            return Solution(
                "not_converged", f"{failure.reason}; {REMEDY}", _facts(failure.trajectory, self.problem.tolerance)
            )
        return self._finish(track, every)

    def _resolution(self) -> Resolution | None:
        """Return how well the time step resolves the slowest vibration or, if worse, a rotation; None if explicit."""
        problem, times = self.problem, (self.analysis.duration, self.analysis.step)
        if problem.integrator.explicit:
            return None
        with np.errstate(all="ignore"):
            found = find_resolution(problem, self.points, *times)
        spin = float(np.linalg.norm(self.analysis.spin))
        turn = resolve_vibration(problem.integrator, Rayleigh(problem.damping.alpha), spin, *times) if spin else None
        if turn is not None and (found is None or turn.error > found.error):
            return replace(turn, motion="turn")
        return found

    def _step_error(self) -> StepError | None:
        """Return the time-step error of small vibrations, as a sum over vibration modes; None if it is unknown."""
        from softmark.solvers.dynamics.time_step_error import estimate_step_error

        with np.errstate(all="ignore"):
            return estimate_step_error(self.problem, self.points, self.analysis.duration, self.analysis.step)

    def _mode_field(self, shape: Floats) -> Callable[[Floats], Floats]:
        """Return the displacement field, a function of points X (n, 3), m, of a vibration mode `shape` (dofs,)."""
        from softmark.interpreter.models.shared.deformed_mesh import displacement_of

        assert self.mesh is not None
        return displacement_of(self.mesh, shape.reshape(-1, 3))

    def _step_errors(self) -> ModalErrors | None:
        """Return the time-step error with the displacement field of each mode; None if unknown."""
        found = self._step_error()
        return None if found is None else ModalErrors(found, tuple(self._mode_field(s) for s in found.shapes.T))

    def _finish(self, track: Trajectory, every: int) -> Solution:
        """Return the solution of a trajectory, with its report and warnings."""
        step, kept = self.analysis.step, stored_indices(track, every)
        shown = self._solution_fields(track.times[kept], np.array([track.observed[i].x for i in kept]))
        history = History(
            track.times[kept],
            shown.pop("course"),
            tuple(_sums_per_step(track, track.wall, step).tolist()),
            tuple(_sums_per_step(track, track.cpu, step).tolist()),
            step,
            tuple((_sums_per_step(track, ~track.solved, step) == 0).tolist()),
            events=tuple((e.time, e.text) for e in track.events),
            energies={name: values[kept] for name, values in track.energies.items()},
        )
        missed = int((~track.solved).sum())
        message = f"{missed} of {len(track.solved)} time steps were accepted unconverged" if missed else None
        found = self._resolution()
        facts = (
            _facts(track, self.problem.tolerance)
            | _friction_report(track, self.friction_contact_names)
            | self._mesh_facts()
            | self._intersection_counts(shown.get("mesh"))
        )
        notes = (
            *_halved_step_warning(self.declared, track),
            *self_intersections.intersection_warnings(self.declared, facts),
            *_energy_warning(self.declared, self.analysis, track),
            *_dissipation_warning(self.declared, track, self.problem),
            *_time_step_warning(self.declared, self.analysis, found),
        )
        facts |= {} if found is None else {"resolution": found.facts}
        status: Status = "capped" if missed else "converged"
        known: dict[str, Any] = {"history": history, "followed": self._contact_history(track)}
        known["step_errors"] = self._step_errors
        return Solution(status, message, facts, notes=notes, **known, **shown)

    def _contact_history(self, track: Trajectory) -> ContactHistoryResults | None:
        """Return the contact history of a trajectory; None if the body has no contacts."""
        if track.touched is None or self.mesh is None or self.case is None:
            return None
        from softmark.interpreter.models.postprocessing.contact_history_results import ContactHistoryResults

        small = vars(self.declared.thing).get("strain") == "small"
        contacts = self.problem.assembly.rigid_contacts
        meets = {name: bed for name, bed in self.beds.items() if isinstance(bed, DynamicPatternEnergy)}
        return ContactHistoryResults(self.case, contacts, meets, self.mesh, track, small)

    def _state(self, motion: Motion) -> Floats:
        """Return the stored variables of a motion: nodal displacements (3 n,), m, unless a subclass adds others."""
        return motion.x.copy()

    def _solution_fields(self, times: Floats, states: Floats) -> dict[str, Any]:
        """Return the solution fields `course`, `displacement` and, if any, `mesh` from stored states (t, ...)."""
        from softmark.interpreter.models.shared.deformed_mesh import fields_of_motion

        assert self.mesh is not None
        return fields_of_motion(self.mesh, times, states.reshape(len(states), -1, 3))

    def _intersection_counts(self, mesh: Any) -> dict[str, Any]:
        """Return the largest number of intersecting pairs of faces over stored states of the `mesh`, by contact."""
        if mesh is None or not self.problem.meets:
            return {}
        known = [
            self_intersections.count_intersections(self.beds, mesh.frames[i].ravel())
            for i in pick_evenly(len(mesh.frames), LOOKED)
        ]
        return {"crossings": {n: max(seen["crossings"][n] for seen in known) for n in known[0]["crossings"]}}

    def _mesh_facts(self) -> dict[str, Any]:
        return {} if self.mesh is None else mesh_facts(self.mesh)


def stored_indices(track: Trajectory, every: int) -> list[int]:
    """Return the indices of the stored states of a trajectory: every `every`-th state, and the last."""
    last = len(track.observed) - 1
    return [i for i in range(last + 1) if i % every == 0 or i == last]


def _sums_per_step(track: Trajectory, values: NDArray[Any], step: float) -> Floats:
    """Return sums of values over each requested time step, s; the parts of a halved step are added to their step."""
    number = np.floor((track.times[:-1] + 1e-6 * step) / step).astype(int)
    return np.asarray(np.bincount(number, weights=values), dtype=np.float64)


@dataclass
class _StateRecorder:
    """Observer of time integration that stores every `every`-th state and the last; other states are freed."""

    every: int
    state: Callable[[Motion], Floats]
    watch: Watch
    count: int = 0
    last: _StoredState | None = None

    def __call__(self, motion: Motion) -> _StoredState:
        """Store the state of a motion, free the state before if it is not needed, and report progress."""
        row = _StoredState(self.state(motion))
        if self.last is not None and (self.count - 1) % self.every:
            self.last.x = None
        else:
            self.watch(Iteration("steps in time", 1.0, self.count, 0.0, 1.0))
        self.last, self.count = row, self.count + 1
        return row


@dataclass
class _StoredState:
    """State that a time integration has stored; its arrays are None once they have been freed."""

    x: Floats | None


def _facts(track: Trajectory, tolerance: float) -> dict[str, Any]:
    """Return the `solve` part of a report. Residuals of solved steps are reported as at most the tolerance."""
    left = np.where(track.solved, np.minimum(track.residuals, tolerance), track.residuals)
    facts: dict[str, Any] = {
        "iterations": int(track.iterations.sum()),
        "steps": len(track.steps),
        "residual": float(left.max()) if len(left) else None,
        "lagged": int(track.lagged.sum()),
        "fallbacks": int(track.fallbacks),
        "unsolved": int((~track.solved).sum()),
        "reached_s": float(track.times[-1]) if len(track.times) else 0.0,
        "events": [{"time": e.time, "what": e.text} for e in track.events[:200]],
        "halved": len(track.events),
    }
    if len(track.times):
        some = pick_evenly(len(track.times), MOMENTS)
        facts["times"] = track.times[some].tolist()
        facts["energies"] = {name: values[some].tolist() for name, values in track.energies.items()}
        facts["energy"] = track.balance.facts
        facts["drift_J"] = float(track.energies["drift"][-1])
    if track.touched is not None:
        facts["momentum"] = _momentum(track.touched)
    if track.impacts is not None:
        facts["impacts"] = [
            {"begin_s": b.begin, "end_s": b.end, "before_m_s": b.before.tolist(), "after_m_s": b.after.tolist(),
             "restitution": b.restitution}
            for b in track.impacts[:BOUNCES]
        ]  # fmt: skip
    return facts


def _momentum(touched: ContactHistory) -> dict[str, Any]:
    """Return the momentum balance of the deformable body, N s: momentum change, and impulses of its causes.

    `off` is the imbalance relative to the largest of these, about the solver tolerance; with supports, bdf2,
    generalised-alpha and implicit Euler add the impulse of one step.
    """
    each = dict(zip(("contacts_Ns", "loads_Ns", "supports_Ns", "damping_Ns"), touched.impulses, strict=True))
    missing = float(np.linalg.norm(touched.change - touched.impulses.sum(axis=0)))
    most = max(float(np.linalg.norm(one)) for one in (touched.change, *touched.impulses))
    told = {"change_Ns": touched.change.tolist()} | {name: one.tolist() for name, one in each.items()}
    return told | {"off": missing / most if most else 0.0}


def _friction_report(track: Trajectory, names: Sequence[str]) -> dict[str, Any]:
    """Return the report of friction of every contact, at the times of the energies; empty without friction."""
    if not track.rubbed:
        return {}
    own = [track.rubbed[i] for i in pick_evenly(len(track.times), MOMENTS)]
    each = {name: [seen[k] for seen in own] for k, name in enumerate(names)}
    return {"friction": {n: {"slip_m": [s.slip for s in seen], "sticks": [s.sticks for s in seen]}
                         for n, seen in each.items()}}  # fmt: skip


def _energy_warning(declared: Declared, analysis: Dynamic, track: Trajectory) -> tuple[Diagnostic, ...]:
    """Return a warning if energy increases without a source, or if numerical damping has dissipated most of it."""
    found, at = track.balance, declared.at()
    if found.has_excessive_gain:
        problem = f"{100 * found.gain:.0f} % of the largest energy was created"
        return (
            diagnostic(
                "W318",
                at,
                f"the energy of `{declared.name}` is not conserved: {problem}",
                "the step is too long",
                "use a smaller step, or write an `amplitude` for loads and supports that act suddenly",
            ),
        )
    if found.loss <= LOSS:
        return ()
    other = "" if analysis.integrator == KEEPS else f", or `{KEEPS}`"
    return (
        diagnostic(
            "W361",
            at,
            f"the integrator dissipated {100 * found.loss:.0f} % of the energy of `{declared.name}`",
            "numerical damping",
            f"use a smaller step{other}: the final state at rest is accurate, the motion towards it is not",
        ),
    )


def _dissipation_warning(declared: Declared, track: Trajectory, problem: Dynamics) -> Iterator[Diagnostic]:
    """Yield a warning if the dissipated viscoelastic energy decreases in time."""
    if (history := problem.remembering) is None:
        return
    from softmark.interpreter.models.shared.viscoelastic_limits import dissipation_warnings

    moved = float((track.energies["kinetic"] + track.energies["strain"]).max())
    yield from dissipation_warnings(declared, np.array(history.losses), moved, history.has_unknown_energy)


def _time_step_warning(declared: Declared, analysis: Dynamic, found: Resolution | None) -> tuple[Diagnostic, ...]:
    """Return a warning if the time step is too long for the slowest vibration that loads excite."""
    if found is None or not found.doubtful:
        return ()
    moves = {"vibration": "slowest vibration", "turn": "turning", "return": "return to rest"}[found.motion]
    of = "time" if found.motion == "return" else "period"
    period = units.format_value(float(f"{found.period:.3g}"), units.TIME)
    problem = (
        f"{found.steps:.2g} steps per {of} of {period}"
        if found.steps < found.few
        else f"at the end its error is {100 * min(found.error, 1.0):.0f} % of the amplitude ({of} {period})"
    )
    message = f"the {moves} of `{declared.name}` is not resolved by the time step: {problem}"
    step, shorter = units.format_value(analysis.step, units.TIME), _suggested_step(found, analysis)
    remedy = f"use a step of {shorter} or less: states at rest are accurate, the motion is not"
    return (diagnostic("W362", declared.at(), message, f"a step of {step}", remedy),)


def _suggested_step(found: Resolution, analysis: Dynamic) -> str:
    """Return a rounded time step, as text, that resolves the motion, from the error order of the integrator."""
    order = 1.0 if analysis.integrator == "implicit_euler" else 0.5
    step = min(found.period / (2.0 * found.few), analysis.step * (0.5 * WRONG / max(found.error, 1e-9)) ** order)
    return units.format_value(float(f"{step:.1g}"), units.TIME)


def _halved_step_warning(declared: Declared, track: Trajectory) -> tuple[Diagnostic, ...]:
    """Return a warning if time steps were halved."""
    if not track.events:
        return ()
    at, first = declared.at(), track.events[0]
    return (
        diagnostic(
            "W315",
            at,
            f"`{declared.name}` halved its time step {len(track.events)} times",
            f"first at {units.format_value(first.time, units.TIME)}",
            first.text,
        ),
    )


def integrator_of(analysis: Dynamic) -> Integrator:
    """Return the time integrator that an analysis selects, with its constants."""
    cls: Any = INTEGRATORS[analysis.integrator]
    own = "spectral_radius"
    known = any(f.name == own for f in fields(cls))
    made: Integrator = cls(**{own: analysis.spectral_radius}) if known else cls()
    return made


def build_solid_dynamics(
    static: Prepared,
    declared: Declared,
    case: Case,
    mesh: Mesh,
    mass: Any,
    internal: Sequence[Energy],
    loads: Sequence[tuple[Declared, Energy]],
    rest: Statics,
    pulling: int = 0,
) -> PreparedMotion:
    """Return the dynamic analysis of a body of given mass, kg; the last `pulling` of the `loads` are muscles."""
    analysis = case.analysis
    if not isinstance(analysis, Dynamic):
        raise TypeError("the analysis is static")
    check_amplitudes(case, analysis)
    integrator = integrator_of(analysis)
    dofs = mesh.points.size
    ways = {touch.name: amplitude_of_rigid(touch) for touch in case.contacts}
    contacts = {
        name: contact.at(ways[name].at(0.0)).without_initial_energy()
        for name, contact in rest.assembly.rigid_contacts.items()
    }
    meets = [energy for energy in internal if isinstance(energy, DynamicPatternEnergy)]
    internal = [energy for energy in internal if not isinstance(energy, DynamicPatternEnergy)]
    acting = number_energies("load", [energy for _, energy in loads])
    problem = Dynamics(
        Assembly(dofs, rest.fixed, internal, acting | contacts),
        mass,
        np.zeros(dofs),
        initial_velocities(analysis, mesh.points, mass),
        rest.fixed,
        rest.target,
        support_amplitude(case),
        (*(amplitude_of(load) for load, _ in loads), *(ways[name] for name in contacts)),
        Rayleigh(analysis.damping_mass, analysis.damping_stiffness),
        integrator,
        analysis.tolerance,
        analysis.max_iterations,
        sound=next((e.has_no_inverted_cells for e in internal if isinstance(e, LaggedTangentEnergy)), rest.sound),
        cap=(cap := declared.thing.iteration_cap),
        pulling=pulling,
        lagged=cap is None,  # with a cap on iterations, steps are plain Newton steps, as in other programs
        way=rest.way,
        meets=(*meets,),
    )
    return PreparedMotion(static, declared, analysis, problem, mesh, case=case)


def initial_velocities(analysis: Dynamic, points: Floats, mass: Any) -> Floats:
    """Return initial nodal velocities (3 n,), m/s, from the velocity and spin about the centre of mass."""
    weights = (mass if mass.ndim == 1 else np.asarray(mass.sum(axis=1)).ravel())[::3]
    centre = weights @ points / weights.sum()
    v: Floats = np.array(analysis.velocity) + np.cross(np.array(analysis.spin), points - centre)
    return v.ravel()


def check_amplitudes(case: Case, analysis: Dynamic) -> None:
    """Raise Fault if the table of an amplitude cannot be read or is shorter than the analysis."""
    pulling = (load for touch in case.contacts for load in touch.loads)  # on rigid bodies
    for moved in (*case.loads, *case.muscles, *case.supports, *pulling):
        if (wrong := table_fault(moved, analysis.duration)) is not None:
            raise Fault(wrong)


def amplitude_of(load: Declared) -> Amplitude:
    """Return the amplitude of a load or support; by default it is 1 from the start."""
    course: Amplitude | None = load.thing.amplitude
    return course or Constant()


def amplitude_of_rigid(touch: RigidBodyContact) -> Amplitude:
    """Return the amplitude of the supports of a rigid body; a constant if the rigid body does not move."""
    first = next((s for s in touch.moved if s.thing.moves), None)
    return Constant() if first is None else amplitude_of(first)


def support_amplitude(case: Case) -> Amplitude:
    """Return the common amplitude of all moving supports. Validation refuses scenes with different amplitudes."""
    moving = (s for s in case.supports if s.thing.follows_amplitude)
    first = next(moving, None)
    return Constant() if first is None else amplitude_of(first)
