"""Solution of a model by an external program: write the problem, run the program, and check its results."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, cast

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.external import external_process
from softmark.interpreter.models.external.adapters import adapter
from softmark.interpreter.models.external.exporters.named_parts import collect_named_parts
from softmark.interpreter.models.external.external_declaration import ExternalSolver
from softmark.interpreter.models.external.external_dynamics import dynamic_solution, motion_of, times_of
from softmark.interpreter.models.external.external_problem import (
    Answer,
    ExternalNotConverged,
    Motion,
    NoAnswer,
    Problem,
)
from softmark.interpreter.models.external.external_process import ProgramEnd
from softmark.interpreter.models.external.external_program import GB, ExternalModel
from softmark.interpreter.models.external.problem_transfer import NotTransferable, problem_of
from softmark.interpreter.models.fem import fem_builder as fem
from softmark.interpreter.models.fem.fem_builder import PreparedSolid
from softmark.interpreter.models.postprocessing import vibrations
from softmark.interpreter.models.procedures.derived_model import DerivedModel
from softmark.interpreter.models.procedures.dynamic_discretization import MotionFields
from softmark.interpreter.models.shared.prepared_model import (
    BuildContext,
    ElapsedTime,
    Prepared,
    Solution,
    Status,
)
from softmark.interpreter.models.shared.unavailable_model import UnavailableModel
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats
from softmark.solvers.runtime.work_count import count_seconds
from softmark.solvers.statics.residual_forces import relative_residual
from softmark.solvers.statics.static_equilibrium import Equilibrium

if TYPE_CHECKING:
    from softmark.solvers.assembly.assembly import Assembly
    from softmark.solvers.statics.static_equilibrium import Watch

BALANCED = 1e-4  # of the larger of loads and reactions: largest residual of a program's results in our equations
HELD = 1e-6  # of the largest displacement: tolerance of the position of a held node
VAGUE = 0.1  # of the loads: if rounding of the results has a larger effect, they cannot be checked
TOLD = 3.0  # safety factor of the residual caused by rounding, which is estimated from one random sample
OURS = ("iterations", "steps", "history", "started")  # report entries about our own solver
NOT_KNOWN = "an external program solved it, and its tangent stiffness is not available"


@dataclass(frozen=True)
class PreparedExternalModel(DerivedModel):
    """Static model that an external program solves.

    `static` is softmark's own finite element model on the same mesh. It defines the problem and checks the results.
    """

    model: ExternalModel
    declared: Declared
    case: Case
    static: PreparedSolid
    lost: ClassVar[Status] = "not_converged"  # status if the program itself reports no solution
    unsettled: ClassVar[str] = "{title} reports no solution: {why}"

    @property
    def assembly(self) -> Assembly:
        """Energies and loads of softmark's own model, in terms of nodal displacements."""
        return self.static.assembly

    def asked(self) -> Problem:
        """Return the problem that the program solves. Raises NotTransferable, Fault."""
        problem = problem_of(self.static, self.case)
        return (
            replace(problem, named=collect_named_parts(self.static, self.case))
            if self.model.program_entry.by_name
            else problem
        )

    def checked_displacements(self, answer: Answer, problem: Problem) -> Floats:
        """Return the program's displacements (n, 3), m, at full load. Raises NoAnswer if they are invalid."""
        found: Floats = checked_states(answer, problem, len(problem.shares))[-1]
        return found

    def solve(self, watch: Watch) -> Solution:
        """Run the program and return its solution, checked with softmark's own equations.

        The solution has no displacements, only the reason, if the program is not installed or does not support the
        problem.
        """
        known: dict[str, Any] = {"program": self.model.program_entry.title}
        program = adapter(self.model.program)
        if (version := program.version()) is None:
            return Solution("skipped", f"{self.model.program_entry.title} is not installed: {program.install}", known)
        try:
            problem = self.asked()
        except NotTransferable as untold:
            return Solution("unsupported", self.model.words_of(untold.reasons), known)
        if reasons := program.refuses(problem):
            return Solution("unsupported", self.model.words_of(reasons), known)
        known["program"] = f"{self.model.program_entry.title} {version}"
        with tempfile.TemporaryDirectory(prefix="softmark-outside-", ignore_cleanup_errors=True) as folder:
            return self._run_program(program, problem, Path(folder), known)

    def _run_program(self, program: Any, problem: Problem, folder: Path, known: dict[str, Any]) -> Solution:
        """Run an installed program on a problem in a folder, and return its solution."""
        program.write(problem, folder)
        model = self.model
        end = external_process.run(program.command(folder), folder, model.time, model.memory * GB, model.threads)
        count_seconds(end.wall_s if end.cpu_s is None else end.cpu_s)
        known = known | {"process": {"wall_s": end.wall_s, "cpu_s": end.cpu_s}}
        try:
            answer, u = self._read_answer(program, problem, folder, end)
        except ExternalNotConverged as why:
            return Solution(self.lost, self.unsettled.format(title=model.program_entry.title, why=why), known)
        except NoAnswer as none:
            return Solution("failed", f"{model.program_entry.title}: {none}", known)
        spent = elapsed_time(answer, end, model.threads)
        known = known | {"clock": dict(answer.clocks), "says": answer.said or None}
        known |= {} if answer.iterations is None else {"iterations": answer.iterations}
        return replace(self._make_checked_solution(answer, u, problem, known), spent=spent)

    def _read_answer(self, program: Any, problem: Problem, folder: Path, end: ProgramEnd) -> tuple[Answer, Floats]:
        """Return the results of a program and their displacements.

        Raises NoAnswer or ExternalNotConverged, also if the program ended with a failure.
        """
        if end.how not in ("done", "died"):
            raise NoAnswer(end.message)
        try:
            answer = program.read(folder)
            u = self.checked_displacements(answer, problem)
        except ExternalNotConverged:
            raise
        except NoAnswer as none:
            words = f"; {end.words}" if end.last else ""
            raise NoAnswer(end.message if end.how == "died" else f"{none}{words}") from none
        if end.how == "died":
            raise NoAnswer(end.message)
        return answer, u

    # ------------------------------------------------------------------ judging

    def _make_checked_solution(self, answer: Answer, u: Floats, problem: Problem, known: dict[str, Any]) -> Solution:
        """Return the solution with displacements u (n, 3), m, after checking their residual in softmark's equations.

        `known` are entries of its report.
        """
        title, x = self.model.program_entry.title, u.ravel()
        held, values = 3 * problem.held[:, 0] + problem.held[:, 1], problem.values
        moved = max(float(np.abs(u).max(initial=0.0)), float(np.abs(values).max(initial=0.0)))
        slipped = float(np.abs(x[held] - values).max(initial=0.0))
        if slipped > max(HELD, TOLD * answer.rounding) * moved:
            return Solution("failed", f"{title}: a supported node is {slipped:.2g} m from its imposed position", known)
        x = x.copy()
        x[held] = values  # to the last digit
        fixed = self.static.problem.fixed
        with np.errstate(all="ignore"):
            residual = relative_residual(self.assembly, x, fixed)
            told = self._rounding_residual(answer, x, residual)
        known |= {"residual": residual, "residual_of_rounding": told}
        allowed = BALANCED + TOLD * told
        if answer.settled is False:
            return Solution(
                "not_converged", f"{title} reports no convergence: {answer.said or 'no reason given'}", known
            )
        if told > VAGUE:
            words = (
                f"rounding of its printed digits alone leaves {told:.1e} of the loads in softmark's "
                "equations, so the result cannot be checked"
            )
            return Solution("not_converged", f"{title} writes too few digits: {words}", known)
        if not residual <= allowed:
            return Solution("not_converged", self._unbalanced_message(residual, allowed), known)
        state = Equilibrium(x, residual, (), 1, stable=None, linear_solver=f"solved by {title}")
        return self._with_program_facts(self.static.make_solution(state), known)

    def _unbalanced_message(self, residual: float, allowed: float) -> str:
        """Return the error message for a residual, relative to the loads, that exceeds the `allowed` one."""
        title = self.model.program_entry.title
        if not np.isfinite(residual):
            return f"the displacements of {title} are not valid: cells are inverted"
        return (
            f"the displacements of {title} leave a residual of {residual:.1e} of the loads in "
            f"softmark's equations, more than the allowed {allowed:.1e}"
        )

    def _rounding_residual(self, answer: Answer, x: Floats, residual: float) -> float:
        """Return the residual, relative to loads, that the limited number of digits in the results causes.

        It is estimated from a fixed random sample.
        """
        if not answer.rounding or not np.isfinite(residual):
            return 0.0
        drawn = np.random.default_rng(0).uniform(-1.0, 1.0, len(x)) * answer.rounding * np.abs(x)
        fixed = self.static.problem.fixed
        drawn[fixed] = 0.0
        apart = relative_residual(self.assembly, x + drawn, fixed, self.assembly.gradient(x, 1.0))
        return apart if np.isfinite(apart) else 0.0

    def _with_program_facts(self, found: Solution, known: dict[str, Any]) -> Solution:
        """Return a solution whose report describes the program, not softmark's own solver.

        `known` are the report entries about the program. Frequencies are not available.
        """
        ours = {n: v for n, v in found.facts.items() if n not in OURS}
        facts = {**ours, **known, "stable": None}
        facts |= {"criterion": "residual of the program's displacements in softmark's equations"}
        return replace(found, facts=facts, vibrations=vibrations.undefined_frequencies(NOT_KNOWN))


@dataclass(frozen=True)
class PreparedExternalDynamics(PreparedExternalModel):
    """Dynamic analysis by an external program; `static` is our static model, which has the mesh and the loads."""

    motion: Motion
    lost: ClassVar[Status] = "diverged"
    unsettled: ClassVar[str] = "the result of {title} is not a valid motion of the body: {why}; use a shorter `step`"

    @property
    def assembly(self) -> Any:
        """Energies in terms of nodal displacements: None, because only static models provide them."""
        return None

    def asked(self) -> Problem:
        """Return the problem that the program solves. Raises NotTransferable."""
        return problem_of(self.static, self.case, motion=self.motion)

    def checked_displacements(self, answer: Answer, problem: Problem) -> Floats:
        """Return the displacements (t, n, 3), m, after the requested steps. Raises NoAnswer if they are invalid."""
        return checked_states(answer, problem, len(self.motion.after))

    def _make_checked_solution(self, answer: Answer, u: Floats, problem: Problem, known: dict[str, Any]) -> Solution:
        """Return the solution after checking that the program's displacements satisfy the supports.

        Equilibrium is not checked, because the mechanical model is the program's own.
        """
        moved = problem.held[:, 1] < 3  # the other components are rotations of sections
        node, component = problem.held[moved].T
        slipped = float(np.abs(u[:, node, component] - problem.values[moved]).max(initial=0.0))
        title, known = (
            self.model.program_entry.title,
            known | {"means": self.model.program_entry.moves, "steps": self.motion.count},
        )
        if slipped > HELD * float(np.abs(u).max(initial=0.0)):
            return Solution("failed", f"{title}: a supported node is {slipped:.2g} m from its imposed position", known)
        return dynamic_solution(self.motion, answer, self.seen(answer, u), known)

    def seen(self, answer: Answer, u: Floats) -> MotionFields:
        """Return the displacement fields of nodal displacements u (t, n, 3), m."""
        return self.static.motion_fields(times_of(self.motion), u)


def checked_states(answer: Answer, problem: Problem, count: int) -> Floats:
    """Return the displacements (count, n, 3), m, of the requested states. Raises NoAnswer if they are invalid."""
    u = np.asarray(answer.u)
    wanted = (count, *problem.points.shape)
    if u.shape != wanted:
        raise NoAnswer(f"its result has displacements of shape {u.shape}, and {wanted} were expected")
    if not np.all(np.isfinite(u)):
        raise NoAnswer(f"{int((~np.isfinite(u)).sum())} of its {u.size} displacements are not finite numbers")
    found: Floats = np.asarray(u, dtype=np.float64)
    return found


def elapsed_time(answer: Answer, end: ProgramEnd, threads: int) -> ElapsedTime:
    """Return the solution time of a program, measured by its own clock if it has one.

    Otherwise its total time, or the time of its process, is an upper bound.
    """
    cpu = end.wall_s if end.cpu_s is None else end.cpu_s  # CPU time of all threads
    solve, whole = answer.clocks.get("solve_s"), answer.clocks.get("whole_s")
    if solve is not None and 0.0 <= solve <= end.wall_s:
        return ElapsedTime(solve, min(cpu, threads * solve), False)
    if whole is not None and 0.0 <= whole <= end.wall_s:
        return ElapsedTime(whole, cpu, True)
    return ElapsedTime(end.wall_s, cpu, True)


def load(model: ExternalSolver) -> None:
    """Import the libraries that `prepare` needs, so that their import does not count as building time."""
    fem.load(model.solid)


def prepare(model: ExternalSolver, declared: Declared, case: Case, workshop: BuildContext) -> Prepared:
    """Return the model that an external program solves, static or dynamic. Raises Fault.

    If the program does not support the scene, the result is a placeholder with the reason.
    """
    if reasons := model.reasons(case):
        return UnavailableModel(model.words_of(reasons), "unsupported")
    if isinstance(case.analysis, Dynamic):
        return cast(Prepared, build_external_dynamics(model, declared, case, workshop))
    solid, _ = fem.build_static(model.solid, replace(declared, thing=model.solid), case, workshop)
    return cast(Prepared, PreparedExternalModel(model, declared, case, solid))


def build_external_dynamics(
    model: ExternalSolver, declared: Declared, case: Case, workshop: BuildContext
) -> PreparedExternalDynamics:
    """Build the dynamic analysis by an external program. Raises Fault."""
    solid, parts = fem.build_static(model.solid, replace(declared, thing=model.solid), case, workshop)
    masses = fem.mass_of(model.solid, case, solid.mesh, parts)[::3]
    return PreparedExternalDynamics(
        model, declared, case, solid, motion_of(model, cast(Dynamic, case.analysis), masses)
    )
