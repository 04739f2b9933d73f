"""Dispatch of references to their theories: the problem that each reference solves, and its results."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Protocol

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.problem.beam_theory_setup import cantilever_of
from softmark.interpreter.problem.body_case import Case, Fault, fault
from softmark.interpreter.vocabulary.support_words import RigidPlate
from softmark.references.straight_cantilever import NotApplicable

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.interpreter.results.reaction_results import EquilibriumForces


CONTACT = ("pressed", "stopped")  # kinds of contact theories
CLEAR = "it neglects contact", "compare with a theory of contact such as `hertz(...)`, or remove the contact"
POROUS = ("column", "pressed_column", "slab", "disc")  # kinds of poroelastic theories
FULL = (
    "its body is poroelastic",
    "compare with `terzaghi`, `mandel`, `unconfined` or `confined`, or use the drained law only",
)
DRY = "its body is not poroelastic", "use the material `biphasic(LAW, permeability = 1e-15 m^4/(N*s))`"


class Theory(Protocol):
    """Protocol of the solution of a theory, as a reference uses it."""

    @property
    def estimated_error(self) -> float:
        """Estimated displacement error at any point, m."""

    @property
    def displacement(self) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
        """Displacement field: maps undeformed points (n, 3), m, to displacements (n, 3), m."""


def problem_of(reference: Declared, case: Case) -> Any:
    """Return the problem that a reference solves. Raises Fault if an assumption of its theory is violated."""
    if any(getattr(material, "directed", False) for material in case.materials):
        from softmark.interpreter.problem.anisotropy_limits import must_be_isotropic

        must_be_isotropic(reference, case)
    for bed in case.beds:
        if isinstance(bed.thing, RigidPlate) and reference.thing.about in POROUS:
            continue
        why = f"`{bed.name}` puts `{case.body.name}` on an elastic foundation"
        raise _assumption_fault(reference, NotApplicable(why, "use `self_converged(...)`, which refines solids"))
    if not case.uniform:
        from softmark.interpreter.problem.heterogeneity_limits import must_be_uniform

        must_be_uniform(reference, case)
    try:
        if case.porous != (reference.thing.about in POROUS):
            raise NotApplicable(*(FULL if case.porous else DRY))
        if case.contacts and reference.thing.about not in CONTACT:
            raise NotApplicable(*CLEAR)
        if reference.thing.about not in ("relaxing", *POROUS) and case.has_material_history:
            raise NotApplicable("its body is viscoelastic", "compare with the elastic law, or with `prony(...)`")
        return _problem(reference, case)
    except NotApplicable as refused:
        raise _assumption_fault(reference, refused) from refused


def _problem(reference: Declared, case: Case) -> Any:
    """Return the problem that a reference solves. Raises NotApplicable if an assumption is violated."""
    match reference.thing.about:
        case "torsion":
            from softmark.interpreter.problem.torsion_theory_setup import cylinder_of

            return cylinder_of(case)
        case "inflation":
            from softmark.interpreter.problem.inflation_theory_setup import ball_of

            return ball_of(case)
        case "sphere" | "hole":
            from softmark.interpreter.problem.inclusion_theory_setup import round_body_of

            return round_body_of(reference, case)
        case "tendons":
            from softmark.interpreter.problem.tendon_theory_setup import driven_rod_of

            return driven_rod_of(case)
        case "relaxing":
            from softmark.interpreter.problem import relaxation_theory_setup

            return relaxation_theory_setup.bar_of(case)
        case "column" | "pressed_column" | "slab" | "disc" as about:
            from softmark.interpreter.problem import porous_theory_setup

            if about in ("slab", "disc"):
                return porous_theory_setup.compressed_body_of(reference, case)
            return (
                porous_theory_setup.column_of(case)
                if about == "column"
                else porous_theory_setup.pressed_column_of(case)
            )
        case "pressed":
            from softmark.interpreter.problem.contact_theory_setup import indentation_of

            return indentation_of(reference, case)
        case "stopped":
            from softmark.interpreter.problem.signorini_theory_setup import bar_of as stopped_bar_of

            return stopped_bar_of(case)
        case "stacked":
            from softmark.interpreter.problem.patch_theory_setup import stack_of

            return stack_of(case)
        case "frame":
            from softmark.interpreter.problem.frame_problem import frame_of

            return frame_of(case)
        case "bar":
            from softmark.interpreter.problem.bar_theory_setup import bar_of

            return bar_of(case)
    return cantilever_of(reference, case)


def solve_theory(reference: Declared, case: Case) -> Theory:
    """Solve the problem of a reference. Raises Fault, and any error of the theory's solver."""
    problem = problem_of(reference, case)
    try:
        found: Theory = reference.thing.solve(problem)
    except NotApplicable as refused:
        raise _assumption_fault(reference, refused) from refused
    return found


def _assumption_fault(reference: Declared, refused: NotApplicable) -> Fault:
    problem = f"`{reference.name}` does not apply to this scene: {refused.reason}"
    return fault("E503", reference.at(), problem, help=refused.remedy)


def theory_forces(reference: Declared, case: Case, found: Theory) -> EquilibriumForces | None:
    """Return the forces of a theory; None if it has none."""
    if not reference.thing.with_forces:
        return None
    own: Any = found
    if reference.thing.about in CONTACT:
        from softmark.interpreter.problem import contact_theory_setup

        return contact_theory_setup.contact_theory_forces(reference, case, own)
    if reference.thing.about == "stacked":
        from softmark.interpreter.problem import patch_theory_setup

        return patch_theory_setup.patch_theory_forces(case, own)
    if reference.thing.about in POROUS:
        from softmark.interpreter.problem import porous_theory_setup

        return porous_theory_setup.porous_theory_forces(case, own)
    if reference.thing.about == "relaxing":
        from softmark.interpreter.problem import relaxation_theory_setup

        return relaxation_theory_setup.bar_forces(case, own)
    from softmark.interpreter.problem import torsion_theory_setup

    return torsion_theory_setup.torsion_forces(case, own)


def stress_of(reference: Declared, found: Theory) -> Callable[[], Any] | None:
    """Return the stress field of a theory in the form that models use; None if it has none."""
    if not reference.thing.with_stress:
        return None
    own: Any = found
    told: Any
    if reference.thing.about == "stacked":
        from softmark.interpreter.problem import patch_theory_setup

        told = patch_theory_setup.PatchStress(own)
    else:
        from softmark.interpreter.problem import inclusion_theory_setup

        told = inclusion_theory_setup.InclusionStress(own)
    return lambda: told


def doubt_of_theory(reference: Declared, found: Theory) -> str | None:
    """Return why the theory is inaccurate for the loaded body, or None."""
    if reference.thing.about in POROUS:
        from softmark.interpreter.problem import porous_theory_setup

        return porous_theory_setup.doubt_of(found)
    if reference.thing.about in (*CONTACT, "stacked"):
        from softmark.interpreter.problem import contact_theory_setup

        return contact_theory_setup.doubt_of(found)
    if not reference.thing.with_stress:
        return None
    from softmark.interpreter.problem.inclusion_theory_setup import doubt_of

    return doubt_of(found)  # type: ignore[arg-type]


def facts_of_theory(reference: Declared, found: Theory) -> Mapping[str, Any]:
    """Return the facts about a theory's solution for the report, except its error."""
    own: Any = found
    if reference.thing.about == "inflation":
        limit = own.limit
        return {"limit": None if limit is None else {"stretch": limit[0], "pressure_Pa": limit[1]}}
    if reference.thing.about in (*CONTACT, "stacked"):
        from softmark.interpreter.problem import contact_theory_setup

        return contact_theory_setup.facts_of(own)
    if reference.thing.about == "pressed_column":
        return {"force_error_N": own.pull_error}
    if not reference.thing.with_stress:
        return {}
    from softmark.interpreter.problem.inclusion_theory_setup import size_effect_note

    return {"size_matters": own.size_matters, "said": size_effect_note(own)}
