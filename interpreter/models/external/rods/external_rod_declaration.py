"""Declaration of rod models that external programs solve."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Literal

from softmark.interpreter.models.beam.beam_declaration import Beam6Dof
from softmark.interpreter.models.external.adapters import RODS, Program
from softmark.interpreter.models.external.external_program import ExternalModel
from softmark.interpreter.models.external.problem_transfer import Reason, unsupported_body, unsupported_motion
from softmark.interpreter.models.shared.capabilities import VISCOELASTICITY, supported_features
from softmark.interpreter.models.shared.model_declaration import Model
from softmark.interpreter.problem.cross_section_coverage import selects_whole_sections
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.loads.line_force import LineForce
from softmark.interpreter.vocabulary.loads.point_force import PointLoad
from softmark.interpreter.vocabulary.loads.tendon import TendonLoad
from softmark.records import dataclass
from softmark.solvers.mesh.shape import Prism

if TYPE_CHECKING:
    from softmark.interpreter.problem.body_case import Case
    from softmark.interpreter.results.run_report import ModelKind

    Word = str
else:
    Word = Literal[tuple(RODS)]

_NODAL = "loads are exchanged as dead forces on nodes"
# a h of a step h: what drifts under a force is too slow by 1 - a h / (exp(a h) - 1), and that is 5 % here; beyond, it
# calms steps too long to be stable as well, and a wrong motion would look like one that is damped
MOST_DAMPED = 0.1


@dataclass(frozen=True)
class ExternalRod(ExternalModel):
    """Rod that another program integrates in time, with nodes, sections, masses and forces of `beam6dof`.

    These are: stretch, shear, twist and bending stiffness, mass and rotary inertia of the sections for the same number
    of segments, dead nodal forces, and clamped or free ends. How they are combined, and how time steps are taken, is up
    to the program and is what is assessed; the outline and `solve.means` describe it. It runs in a separate process,
    with limits on time, memory and output; none of its code is imported.

    `mujoco` has a discrete elastic rod, which replaces its cable in version 4: it does not stretch or shear, and
    sections have no inertia about transverse axes. Released for 0.12 s under its weight, with 10, 20 and 40 segments
    and steps of 0.1 ms, a slender rod (length 22 times the thickness) differs by 1.2, 0.2 and 0.4 % of its displacement
    from `beam6dof` with 80 segments; the silicone beam (5 times) by 7.7, 8.8 and 9.1 %, which is the effect of the
    omitted shear, stretch and inertia. Its steps, `discrete`, solve one linear system each, so that they may be longer:
    with steps of 1 ms the difference is 0.8 to 1.2 %. It is held at one end, or at none.

    `pyelastica` takes explicit steps, by a position Verlet scheme, and supports only dynamic analyses: choose a `step`
    in which waves do not cross a segment, or it is `diverged`. `damping_mass` multiplies all velocities by exp(-a step)
    after each step, which is too much if a step is long relative to 1/a: it is refused if this exceeds a twentieth.
    Directions of sections are those of its segments, so that a clamp holds half a segment and answers are of first
    order in the segment length. Its law conserves volume: stretched sections grow thin.

    If the program cannot represent the scene exactly, nothing is approximated: the model is `unsupported`, with the
    reason, and validation reports W710. If it is not installed, the model is `skipped`. Dynamic results are not checked
    in softmark's equations, and no error of time steps or segments is stated: theories and other models assess them.
    `dsl robustness`, which compares models with their stated errors, leaves it out.
    """

    capabilities = supported_features(VISCOELASTICITY)  # reported as unsupported
    moves_by_sections = True
    resolution_fields = ("segments",)
    loads = (*Model.loads, LineForce, TendonLoad)
    instead = "use `beam6dof(...)`, which supports all of this"

    program: Annotated[Word, "external program"]
    segments: Annotated[int, "1 in [2, 10000]", "elements along the axis"]
    body: Annotated[str | None, "body", "body; needed if the scene has several"] = None
    time: Annotated[float, "s in (0, inf)", "limit of the program's wall-clock time"] = 60.0
    memory: Annotated[float, "1 in (0, 100000]", "limit of the program's address space, GB"] = 4.0
    threads: Annotated[int, "1 in [1, 256]", "number of threads that the program may use"] = 1
    step: Annotated[float | None, "s in (0, inf)", "time step of the program; default: that of the analysis"] = None

    iterations = None  # it solves nothing

    @property
    def program_entry(self) -> Program:
        """Entry of the program in the table of supported features."""
        return RODS[self.program]

    @property
    def ours(self) -> Beam6Dof:
        """softmark's own rod model of the same problem."""
        return Beam6Dof(self.segments, body=self.body)

    def reasons(self, case: Case) -> list[Reason]:
        """Return the features of the scene that the program cannot compute exactly, with reasons."""
        return [
            *unsupported_motion(case),
            *self._unsupported_body_features(case),
            *self._unsupported_loads(case),
            *self._unsupported_supports(case),
            *self.invalid_step_options(case),
        ]

    def _unsupported_body_features(self, case: Case) -> Iterator[Reason]:
        """Yield features of the body and its material that the program cannot represent, with reasons."""
        if not isinstance(case.prism, Prism) or case.prism.tapered:
            yield "the body", "a rod needs one section along a straight axis"
        yield from unsupported_body(case)
        if not isinstance(case.analysis, Dynamic):
            return
        if case.analysis.damping_stiffness:
            yield "damping_stiffness", "its damping is proportional to velocity only"
        shrinks = case.analysis.damping_mass * (self.step or case.analysis.step)
        if shrinks > MOST_DAMPED:
            least = f"{MOST_DAMPED / case.analysis.damping_mass:.3g} s"
            why = f"the step is too long for this damping: use a `step` of {least} or less"
            yield "damping_mass", why

    def _unsupported_loads(self, case: Case) -> Iterator[Reason]:
        """Yield loads that the program cannot represent, with reasons."""
        from softmark.interpreter.models.beam.beam_declaration import axis_station
        from softmark.interpreter.vocabulary.loads.body_force import BodyForce
        from softmark.interpreter.vocabulary.loads.surface_traction import SurfaceTraction

        for load in case.loads:
            action = load.thing.action
            dead = isinstance(action, BodyForce | SurfaceTraction | LineForce)
            if not dead and not (isinstance(action, PointLoad) and axis_station(case, action.at) is not None):
                yield f"load `{load.name}`", _NODAL

    def _unsupported_supports(self, case: Case) -> Iterator[Reason]:
        """Yield supports that the program cannot represent, with reasons."""
        nodes, held = tuple(self.stations(case)), set[int]()
        for support in case.supports:
            if len(support.thing.components) < 3:
                yield f"support `{support.name}`", "it supports only clamps"
            held |= {
                i for i, taken in enumerate(selects_whole_sections(support.thing.where, case.prism, nodes)) if taken
            }
        if not held <= {0, len(nodes) - 1}:
            yield "the supports", "it can be held only at its ends"
        elif len(held) == 2 and not self.program_entry.stretches:
            yield "the supports", "its length is fixed, so it cannot move between two clamps"

    def stations(self, case: Case) -> list[float]:
        """Return the stations of nodes along the axis, m from the root."""
        return self.ours.stations(case)

    def outline(self, case: Case) -> str:
        """Return a one-line description of the model for `dsl plan` and the report."""
        return f"{self.program_entry.title}: {self.segments} segments of a rod; {self.program_entry.moves}"

    def kind(self, case: Case) -> ModelKind:
        """Return the kind of the model: its description without the number of segments, and that number as text."""
        rod = self.ours.kind(case)
        return replace(rod, words=f"{rod.words}, {self.program_entry.title}")

    def orders(self) -> dict[str, int]:
        """Return the convergence order in the segment length, as stated in the table of programs.

        It is 1 for a program whose clamp holds half a segment.
        """
        return {"segments": self.program_entry.order}
