"""Motions that other programs compute: told, run and looked at; what their model is, they say themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from softmark.interpreter.models.outside.build import PreparedOutside, states
from softmark.interpreter.models.outside.problem import Answer, Motion, Problem
from softmark.interpreter.models.outside.telling import told
from softmark.interpreter.models.shared.deformed import Deformed, displacement_of
from softmark.interpreter.models.shared.prepared import Solution, Status
from softmark.interpreter.results.history import History
from softmark.interpreter.results.thinning import picked
from softmark.interpreter.vocabulary.analyses import Dynamic
from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats
from softmark.solvers.mesh.interpolation import locate

if TYPE_CHECKING:
    from softmark.solvers.assembly.assembly import Assembly

KEPT = 2000  # states of a motion; of more steps, every second, third ... is kept
FRAMES = 40  # of the mesh that are kept for other programs
HELD = 1e-6  # of the greatest displacement: how far a node that is held may be from where it is held


@dataclass(frozen=True)
class PreparedMoving(PreparedOutside):
    """A body that a program moves; `solid` is the same of ours, at rest, which knows its mesh and its loads."""

    masses: Floats  # (n,) kg
    lost: ClassVar[Status] = "diverged"

    @property
    def assembly(self) -> Assembly:
        """Of a state of rest alone."""
        return None  # type: ignore[return-value]  # as of motions of ours

    @property
    def motion(self) -> Motion:
        """What it is told of time."""
        analysis, model = self.case.analysis, self.model
        assert isinstance(analysis, Dynamic)
        step = model.step or analysis.step
        count = round(analysis.duration / step)
        every = -(-count // KEPT)
        after = np.unique([*range(0, count + 1, every), count])
        return Motion(step, count, after, self.masses, analysis.damping_mass, analysis.damping_stiffness,
                      analysis.explicit, model.iterations)  # fmt: skip

    def asked(self) -> Problem:
        """What the program is told. Raises Untold."""
        return told(self.solid, self.case, motion=self.motion)

    def looked_at(self, answer: Answer, problem: Problem) -> Floats:
        """Displacements (t, n, 3) after the steps that were asked for, m. Raises NoAnswer where they are none."""
        return states(answer, problem, len(self.motion.after))

    def _judged(self, answer: Answer, u: Floats, problem: Problem, known: dict[str, Any]) -> Solution:
        """Its displacements u (t, n, 3), m, as a motion: whether what is held stays is all that is asked of them."""
        node, component = problem.held.T
        slipped = float(np.abs(u[:, node, component] - problem.values).max(initial=0.0))
        moved, title = float(np.abs(u).max(initial=0.0)), self.model.told.title
        known |= {"means": self.model.told.moves, "steps": self.motion.count}
        if slipped > HELD * moved:
            return Solution("failed", f"{title}: what is held is {slipped:.2g} m from where it is held", known)
        return self._shown(answer, u, known)

    def _shown(self, answer: Answer, u: Floats, known: dict[str, Any]) -> Solution:
        motion, body = self.motion, self.mesh
        times: Floats = np.asarray(motion.step * motion.after, dtype=np.float64)

        def course(X: Floats) -> Floats:
            place = locate(body, X)
            return np.array([place.interpolate(one) for one in u])

        steps = () if answer.steps_s is None else tuple(np.asarray(answer.steps_s, dtype=np.float64).tolist())
        history = History(times, course, steps, (), motion.step)
        some = picked(len(times), FRAMES)
        mesh = Deformed(body, u[-1], times[some], u[some])
        capped = answer.settled is False
        status: Status = "capped" if capped else "converged"
        said = answer.said if capped else None
        return Solution(status, said, known, displacement_of(body, u[-1]), history=history, mesh=mesh)
