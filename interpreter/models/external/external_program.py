"""Base class of models that an external program solves, with checks of the features that the program supports."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.external.adapters import Program, program
from softmark.interpreter.models.shared.model_declaration import Model
from softmark.interpreter.vocabulary.analysis_words import Dynamic

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.models.external.problem_transfer import Reason
    from softmark.interpreter.problem.body_case import Case

GB = 1e9  # bytes


class ExternalModel(Model):
    """Model that an external program solves, with fields for the program, its process limits and its time steps."""

    reason_without_robustness = "an external program solves it and reports no error estimate to compare with"
    instead = "use `fem(...)`, which supports all of this"

    program: str
    time: float
    memory: float
    threads: int
    step: float | None
    iterations: int | None

    @property
    def program_entry(self) -> Program:
        """Entry of the program in the table of supported features."""
        return program(self.program)

    @property
    def ours(self) -> Model:
        """softmark's own model of the same problem, which determines mesh, supports and loads."""
        raise NotImplementedError(f"{type(self).__name__} is told of none of ours")

    def diagnostics(self, declared: Declared, case: Case) -> list[Diagnostic]:
        """Return errors and warnings about our model in a case, and about features that the program lacks."""
        found = self.ours.diagnostics(replace(declared, thing=self.ours), _case_without_explicit_integrator(case))
        if any(d.severity == "error" for d in found):
            return found
        return [*found, *self.unsupported(declared, case)]

    def reasons(self, case: Case) -> list[Reason]:
        """Return the features of the scene that the program cannot compute exactly, with reasons."""
        raise NotImplementedError(f"{type(self).__name__} has no reasons")

    def unsupported(self, declared: Declared, case: Case) -> Iterator[Diagnostic]:
        """Yield a warning if the program does not support a feature of the scene."""
        if reasons := self.reasons(case):
            yield diagnostic(
                "W710",
                declared.at("program"),
                f"`{declared.name}` will not be computed: {self.words_of(reasons)}",
                "unsupported",
                f"the other models of the scene are computed; {self.instead}",
            )

    def words_of(self, reasons: list[Reason]) -> str:
        """Return a description of why the program does not support the scene."""
        each = dict.fromkeys(f"{what} ({why})" for what, why in reasons)
        return f"{self.program_entry.title} cannot represent {', '.join(each)}"

    def invalid_step_options(self, case: Case) -> Iterator[Reason]:
        """Yield each invalid time step option of the model, with a reason.

        `step` and `iterations` are invalid for a static program. `step` is also invalid if the duration of the motion
        is not a whole number of steps.
        """
        if not self.program_entry.moves:
            for name in ("step", "iterations"):
                if getattr(self, name) is not None:
                    yield name, "only for programs that step through time"
        elif isinstance(case.analysis, Dynamic):
            count = case.analysis.duration / (self.step or case.analysis.step)
            if abs(count - round(count)) > 1e-6 * count or round(count) < 1:
                yield "step", "the duration must be a whole number of steps"


def _case_without_explicit_integrator(case: Case) -> Case:
    """Return a case without our explicit integrator, whose requirements do not apply to other programs."""
    analysis = case.analysis
    if not (isinstance(analysis, Dynamic) and analysis.explicit):
        return case
    return replace(case, analysis=replace(analysis, integrator="implicit_euler"))
