"""Construction of rod models that an external program solves."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.beam import beam_builder as beam
from softmark.interpreter.models.beam.tapered_sections import inertia
from softmark.interpreter.models.external.external_builder import PreparedExternalDynamics
from softmark.interpreter.models.external.external_dynamics import motion_of, times_of
from softmark.interpreter.models.external.external_problem import Answer, ExternalMaterial, NoAnswer, Problem, Section
from softmark.interpreter.models.external.rods.external_rod_declaration import ExternalRod
from softmark.interpreter.models.procedures.dynamic_discretization import MotionFields
from softmark.interpreter.models.shared.prepared_model import BuildContext, Prepared
from softmark.interpreter.models.shared.unavailable_model import UnavailableModel
from softmark.interpreter.problem.body_case import Case
from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats
from softmark.solvers.energies.rod_rotation import quaternion, rotation
from softmark.solvers.energies.rod_state import chain_elements

if TYPE_CHECKING:
    from softmark.interpreter.models.beam.beam_builder import PreparedBeam


@dataclass(frozen=True)
class PreparedRod(PreparedExternalDynamics):
    """Dynamic analysis of a rod by an external program.

    `static` is softmark's own static model of the rod, which provides the nodes, sections and loads.
    """

    @property
    def rod(self) -> PreparedBeam:
        """Softmark's own static rod model, which defines the problem that the external program solves."""
        return cast("PreparedBeam", self.static)

    def asked(self) -> Problem:
        """Return the problem that the program solves."""
        rod, case = self.rod, self.case
        fixed = np.asarray(rod.problem.fixed, dtype=np.int64)
        material = case.material
        young = 2.0 * material.shear_modulus * (1.0 + material.poisson)
        law = ExternalMaterial("linear_elastic", {"young": young, "poisson": material.poisson}, material.density,
                    np.arange(len(rod.points) - 1, dtype=np.int64))  # fmt: skip
        section, first = case.prism.section, rod.rest.reshape(-1, 7)[:1, 3:]
        stiffness, turned = cast(Any, rod.elastic.stiffness).diagonal, np.array(inertia(section))
        return Problem(
            points=rod.points,
            cells=chain_elements(len(rod.points)),
            element="rod",
            strain="finite",
            stuff=(law,),
            held=np.stack(np.divmod(fixed, 6), axis=1),
            values=np.zeros(len(fixed)),
            forces=sum((f[:, :3] for _, f in rod.forces()), np.zeros_like(rod.points)),
            motion=self.motion,
            section=Section(section.area, stiffness, material.density * turned[1:], rotation(first)[0]),
        )

    def checked_displacements(self, answer: Answer, problem: Problem) -> Floats:
        """Return nodal displacements (t, n, 3), m, after the requested steps. Raises NoAnswer if invalid."""
        u = super().checked_displacements(answer, problem)
        turned = answer.turned
        if turned is None or turned.shape != (*u.shape[:2], 3, 3) or not np.all(np.isfinite(turned)):
            raise NoAnswer("its result does not include section rotations")
        return u

    def seen(self, answer: Answer, u: Floats) -> MotionFields:
        """Return the displacement fields, with sections rotated as the program computed."""
        assert answer.turned is not None
        states = np.concatenate([self.rod.points + u, quaternion(answer.turned)], axis=2).reshape(len(u), -1)
        return self.rod.motion_fields(times_of(self.motion), states)


def load(model: ExternalRod) -> None:
    """Import the libraries that `prepare` needs, so that their import does not count as building time."""
    beam.load(model.ours)


def prepare(model: ExternalRod, declared: Declared, case: Case, workshop: BuildContext) -> Prepared:
    """Return the rod model that an external program solves. Raises Fault.

    If the program does not support the scene, the result is a placeholder with the reason.
    """
    if reasons := model.reasons(case):
        return UnavailableModel(model.words_of(reasons), "unsupported")
    rod = beam.build_static(model.ours, replace(declared, thing=model.ours), case)
    masses = np.asarray(rod.mass()[::6])
    motion = motion_of(model, cast(Any, case.analysis), masses)
    return cast(Prepared, PreparedRod(model, declared, case, cast(Any, rod), motion))
