"""Base class of the setups of theories, one class for each kind of problem that references solve."""

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

CLEAR = "it neglects contact", "compare with a theory of contact such as `hertz(...)`, or remove the contact"
FULL = (
    "its body is poroelastic",
    "compare with `terzaghi`, `mandel`, `unconfined` or `confined`, or use the drained law only",
)
DRY = "its body is not poroelastic", "use the material `biphasic(LAW, permeability = 1e-15 m^4/(N*s))`"


class TheorySetup:
    """Setup of a theory: the cases that it admits, the problem of a case, and the results of a solution.

    By default it admits one elastic body in a static analysis, without contact, rigid plates and elastic foundations,
    and gives no results but displacements.
    """

    admits_rigid_contact: ClassVar[bool] = False
    admits_rigid_plates: ClassVar[bool] = False
    admits_material_history: ClassVar[bool] = False  # such a theory requires a quasistatic analysis itself
    admits_motion: ClassVar[bool] = False  # a dynamic analysis
    is_poroelastic: ClassVar[bool] = False  # its body is poroelastic; other theories refuse such a body
    estimates_force_error: ClassVar[bool] = False

    @property
    def gives_forces(self) -> bool:
        """True if the theory gives reactions and energies, that is if its class defines `forces`."""
        return type(self).forces is not TheorySetup.forces

    @property
    def gives_stress(self) -> bool:
        """True if the theory gives stress and strain, that is if its class defines `stress`."""
        return type(self).stress is not TheorySetup.stress

    def check_case(self, reference: Declared, case: Case) -> None:
        """Check that the theory admits the case. Raises Fault, and NotApplicable."""
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
            raise NotApplicable(*(FULL if case.porous else DRY))
        if case.contacts and not self.admits_rigid_contact:
            raise NotApplicable(*CLEAR)
        if case.has_material_history and not self.admits_material_history:
            raise NotApplicable("its body is viscoelastic", "compare with the elastic law, or with `prony(...)`")
        if isinstance(case.analysis, Dynamic) and not (self.admits_motion or self.admits_material_history):
            raise NotApplicable("the analysis is dynamic", "use a static analysis")

    def problem_from(self, reference: Declared, case: Case) -> Any:
        """Return the problem of a case, which `solve` of the reference takes.

        Raises NotApplicable if an assumption of the theory is violated.
        """
        raise NotImplementedError(f"{type(self).__name__} makes no problem of a case")

    def forces(self, case: Case, solution: Any) -> EquilibriumForces | None:
        """Return the reaction forces, contact forces and energies of a solution; None if the theory gives none."""
        return None

    def stress(self, solution: Any) -> AnalyticField | None:
        """Return the stress field of a solution; None if the theory gives none."""
        return None

    def warning(self, solution: Any) -> str | None:
        """Return why the theory is inaccurate for the loaded body, or None."""
        return None

    def facts(self, solution: Any) -> Mapping[str, Any]:
        """Return the facts about a solution for the report, except its error."""
        return {}
