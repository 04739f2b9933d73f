"""Dynamic analyses by external programs: data of the motion for the program, and conversion to a solution."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.models.external.external_problem import Answer, Motion
from softmark.interpreter.models.shared.prepared_model import Solution, Status
from softmark.interpreter.results.motion_history import KEPT, History
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.solvers.energies.energy import Floats

if TYPE_CHECKING:
    from typing import Any

    from softmark.interpreter.models.external.external_program import ExternalModel
    from softmark.interpreter.models.procedures.dynamic_discretization import MotionFields


def motion_of(model: ExternalModel, analysis: Dynamic, masses: Floats) -> Motion:
    """Return the time steps, damping and nodal masses (n,), kg, of a motion that a program integrates."""
    step = model.step or analysis.step
    count = round(analysis.duration / step)
    after = np.unique([*range(0, count + 1, -(-count // KEPT)), count])
    return Motion(step, count, after, masses, analysis.damping_mass, analysis.damping_stiffness, analysis.explicit,
                  model.iterations)  # fmt: skip


def times_of(motion: Motion) -> Floats:
    """Return the times of the requested states (t,), s."""
    times: Floats = np.asarray(motion.step * motion.after, dtype=np.float64)
    return times


def dynamic_solution(motion: Motion, answer: Answer, fields: MotionFields, known: dict[str, Any]) -> Solution:
    """Return the solution of a motion; it is `capped` if the program left steps unsolved.

    `known` is the report.
    """
    steps = () if answer.steps_s is None else tuple(np.asarray(answer.steps_s, dtype=np.float64).tolist())
    solved = tuple(n >= answer.unsolved for n in range(motion.count))  # how many, in no order
    status: Status = "capped" if answer.unsolved else "converged"
    history = History(times_of(motion), fields.history, steps, (), motion.step, solved)
    message = answer.said if answer.unsolved else None
    return Solution(status, message, known, fields.displacement, history=history, mesh=fields.mesh)
