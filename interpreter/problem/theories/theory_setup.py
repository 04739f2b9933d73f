"""Base class of the classes that prepare a case for a theory, one class for each kind of problem."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.references.straight_cantilever import NotApplicable

if TYPE_CHECKING:
    from softmark.interpreter.results.reaction_results import EquilibriumForces
    from softmark.solvers.stress_recovery.analytic_stress_field import AnalyticField

CONTACT_NEGLECTED = (
    "the theory neglects contact",
    "compare with a theory of contact such as `hertz(...)`, or remove the contact",
)
BODY_IS_POROELASTIC = (
    "its body is poroelastic",
    "compare with `terzaghi`, `mandel`, `unconfined` or `confined`, or use the drained law only",
)
BODY_IS_NOT_POROELASTIC = (
    "its body is not poroelastic",
    "use the material `biphasic(LAW, permeability = 1e-15 m^4/(N*s))`",
)


class TheorySetup:
    """Setup of a theory: checks a case, makes the problem that the theory solves, and reads results from its solution.

    This base class accepts one elastic body in a static analysis. It refuses contact, rigid plates and elastic
    foundations, unless a derived class sets the attributes below. Its theory gives only displacements; derived classes
    add forces and stress.
    """

    admits_rigid_contact: ClassVar[bool] = False
    admits_rigid_plates: ClassVar[bool] = False
    admits_material_history: ClassVar[bool] = False  # such a theory requires a quasistatic analysis itself
    admits_motion: ClassVar[bool] = False  # a dynamic analysis
    is_poroelastic: ClassVar[bool] = False  # its body is poroelastic; other theories refuse such a body
    estimates_force_error: ClassVar[bool] = False

    @property
    def gives_forces(self) -> bool:
        """True if the theory gives reactions and energies, because its class defines `forces`."""
        return type(self).forces is not TheorySetup.forces

    @property
    def gives_stress(self) -> bool:
        """True if the theory gives stress and strain, because its class defines `stress`."""
        return type(self).stress is not TheorySetup.stress

    def check_case(self, reference: Declared, case: Case) -> None:
        """Check that the theory applies to the material, contacts and foundations of a case.

        Raises Fault about the material, and NotApplicable about all else.
        """
        if any(getattr(material, "directed", False) for material in case.materials):
            from softmark.interpreter.problem.anisotropy_limits import must_be_isotropic

            must_be_isotropic(reference, case)
        for bed in case.beds:
            if not (self.admits_rigid_plates and bed.thing.is_massless_plate):
                why = f"`{bed.name}` puts `{case.body.name}` on an elastic foundation"
                raise NotApplicable(why, "use `self_converged(...)`, which refines solids")
        if not case.uniform:
            from softmark.interpreter.problem.heterogeneity_limits import must_be_uniform

            must_be_uniform(reference, case)
        if case.porous != self.is_poroelastic:
            raise NotApplicable(*(BODY_IS_POROELASTIC if case.porous else BODY_IS_NOT_POROELASTIC))
        if case.contacts and not self.admits_rigid_contact:
            raise NotApplicable(*CONTACT_NEGLECTED)
        if case.has_material_history and not self.admits_material_history:
            raise NotApplicable("its body is viscoelastic", "compare with the elastic law, or with `prony(...)`")
        if isinstance(case.analysis, Dynamic) and not (self.admits_motion or self.admits_material_history):
            raise NotApplicable("the analysis is dynamic", "use a static analysis")

    def problem_from(self, reference: Declared, case: Case) -> Any:
        """Return the problem that `solve` of the reference takes, from the shape, supports and loads of a case.

        Raises NotApplicable if the case violates an assumption of the theory.
        """
        raise NotImplementedError(f"{type(self).__name__} makes no problem of a case")

    def forces(self, case: Case, solution: Any) -> EquilibriumForces | None:
        """Return the reaction forces, contact forces and energies of a solution; None if the theory gives none."""
        return None

    def stress(self, solution: Any) -> AnalyticField | None:
        """Return the stress field of a solution; None if the theory gives none."""
        return None

    def warning(self, solution: Any) -> str | None:
        """Return why the theory is inaccurate for this body under its loads; None if it is accurate."""
        return None

    def facts(self, solution: Any) -> Mapping[str, Any]:
        """Return further facts about a solution for the report, by name; its error is reported elsewhere."""
        return {}
