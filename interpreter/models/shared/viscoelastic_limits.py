"""Checks of viscoelastic bodies: invalid Prony series, and analyses, options and laws that exclude relaxation."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.shared.option_limits import VISCOELASTIC_OPTIONS
from softmark.interpreter.vocabulary.analysis_words import Dynamic, Quasistatic
from softmark.solvers.materials.viscoelastic import Viscoelastic

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared, Location
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.energies.energy import Floats

ANALYSIS_EXAMPLE = "`analysis hold = quasistatic(duration = 10 s, step = 0.1 s)`"
SUM_TOLERANCE = 1e-9  # rounding of the sum of relaxing fractions, which may not exceed one
DECREASE_TOLERANCE = 1e-3  # of the dissipated energy: a smaller decrease causes no warning
SOLVER_TOLERANCE = 1e-7  # of the work: error of the dissipated energy due to the solver tolerance
LARGEST_STEP = 0.5  # of a relaxation time: longer time steps do not resolve it


def check_material(case: Case) -> Iterator[Diagnostic]:
    """Yield the error about an invalid Prony series of a case."""
    bad = [_prony_series_problem(material) for material in case.materials if isinstance(material, Viscoelastic)]
    if problem := next(filter(None, bad), None):
        yield diagnostic("E360", case.body.at("material"), f"the Prony series of `{case.body.name}` is "
                                                           f"invalid: {problem[0]}",
                         problem[1], problem[2])  # fmt: skip


def check_model(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """Yield errors if a model or its analysis excludes a viscoelastic body, and a warning about long time steps."""
    if not isinstance(case.analysis, Quasistatic | Dynamic):
        yield diagnostic("E359", declared.at(), f"`{case.body.name}` is viscoelastic, which needs an "
                                                "analysis over time", "needs an analysis over time",
                         f"write {ANALYSIS_EXAMPLE}, or use only the elastic law")  # fmt: skip
    else:
        yield from _incompatible_option_errors(declared, case)
        yield from (_check_solid if declared.thing.mesh_key() is not None else _check_beam)(declared, case)
        yield from _time_step_warnings(case)


def _prony_series_problem(material: Viscoelastic) -> tuple[str, str, str] | None:
    """Return the problem, label and help of an error about a Prony series; None if the series is valid."""
    g, tau = material.g.values, material.tau.values
    if isinstance(material.law, Viscoelastic):
        return "its law already is viscoelastic", "nested Prony series", "write the terms of both in one series"
    if len(g) != len(tau):
        shares, times = (f"{n} {what}{'' if n == 1 else 's'}" for n, what in ((len(g), "share"), (len(tau), "time")))
        return (f"it has {shares} and {times}", "numbers differ",
                "write as many of each: `g = [0.3, 0.2], tau = [1, 10] s`")  # fmt: skip
    if sum(g) > 1.0 + SUM_TOLERANCE:
        return f"the sum of its shares is {sum(g):.3g}", "greater than 1", "write shares whose sum is at most 1"
    return None


def _incompatible_option_errors(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """Yield errors for options of the model and for rotating supports, which viscoelastic bodies do not support."""
    yield from VISCOELASTIC_OPTIONS.excluded_value_errors(declared, case)
    if support := next((s for s in case.supports if s.thing.rotates), None):
        yield diagnostic(
            "E362",
            support.at(),
            f"`{support.name}` rotates a viscoelastic body",
            "not with viscoelasticity",
            "use `displaced(...)` instead",
        )


def _material_owner(declared: Declared, case: Case) -> tuple[Location, str]:
    """Return where the material of a model is declared, and the name of the declaration.

    The declaration is the model if it has its own material, else the body.
    """
    if getattr(declared.thing, "material", None) is not None:
        return declared.at("material"), declared.name
    return case.body.at("material"), case.body.name


def _check_beam(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """Yield an error if the constants of a viscoelastic beam vary in space."""
    if not case.uniform:
        at, named = _material_owner(declared, case)
        yield diagnostic("E362", at, f"`{named}` is viscoelastic with varying constants",
                         "cannot be combined", "use constants that do not vary")  # fmt: skip


def _check_solid(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """Yield errors for a viscoelastic solid in plane stress, with varying constants, or with an unsuitable law."""
    if case.planar == "plane_stress":
        yield diagnostic(
            "E362",
            case.body.at(),
            f"`{case.body.name}` is viscoelastic and in plane stress",
            "not in plane stress",
            "use a thin solid, or `plane_strain`",
        )
        return
    if not case.uniform:
        at, named = _material_owner(declared, case)
        yield diagnostic(
            "E362",
            at,
            f"`{named}` is viscoelastic with varying constants",
            "cannot be combined",
            "use regions of constant material: `region stiff = part(...)`",
        )
        return
    for material in case.materials:
        if isinstance(material, Viscoelastic):
            yield from _check_law(declared, case, material)


def _check_law(declared: Declared, case: Case, material: Viscoelastic) -> Iterator[Diagnostic]:
    """Yield an error if a viscoelastic law cannot be used with the formulation or the strain measure of a model.

    Mixed formulations exclude a relaxing pressure. Finite strain needs a law with a separate deviatoric stress.
    """
    from softmark.solvers.materials.viscoelastic_increment import relaxing_part

    model = declared.thing
    if material.of == "whole" and model.formulation != "displacement":
        whose = _material_owner(declared, case)[1]
        yield diagnostic("E362", declared.at("formulation"), f"all stress of `{whose}` relaxes (`of = "
                                                             f"whole`), but the pressures of `{declared.name}` "
                                                             "cannot relax", "not with `of = whole`",
                         "remove `of`, so that only the deviatoric stress relaxes")  # fmt: skip
    elif (
        model.strain == "finite" and material.law.finite_law() is not None and relaxing_part(material, "finite") is None
    ):
        at, named = _material_owner(declared, case)
        yield diagnostic(
            "E362",
            at,
            f"the law of `{named}` has no separate deviatoric stress",
            "needs an isochoric-volumetric split",
            "use `neo_hookean_isochoric(...)`, or `of = whole`",
        )


def _time_step_warnings(case: Case) -> Iterator[Diagnostic]:
    """Yield a warning if the time step is too long to resolve the shortest relaxation time of the body."""
    analysis: Any = case.analysis
    times = [tau for material in case.materials for _, tau in material.branches]
    fast = [tau for tau in times if analysis.step > LARGEST_STEP * tau]
    if fast and (case.loads or any(support.thing.amplitude is not None for support in case.supports)):
        shown = units.format_value(float(f"{min(fast):.4g}"), units.TIME)
        yield diagnostic(
            "W369",
            case.body.at("material"),
            f"a step of {units.format_value(analysis.step, units.TIME)} does not resolve the relaxation time {shown}",
            "only the average is accurate",
            "compare with half the step: slow relaxation is accurate, the fast one is not resolved",
        )


def dissipation_warnings(declared: Declared, lost: Floats, work: float, unknown: bool) -> Iterator[Diagnostic]:
    """Yield a warning if the dissipated energy of a viscoelastic model is not known, or decreases in time.

    `lost` (t,), J, is the dissipated energy at each time, and `unknown` states that the model cannot compute it.
    `work`, J, is the scale of the energies, from which the tolerance is taken.
    """
    from softmark.solvers.energies.viscoelastic_memory import largest_drop_below_maximum

    if unknown:
        yield diagnostic("W368", declared.at(), f"the stored and dissipated energy of `{declared.name}` is "
                                                "not known",
                         "its law is not convex there", "forces are still valid; for energies use another "
                                                        "law, for rubber with `of = shape`")  # fmt: skip
        return
    fall, most = largest_drop_below_maximum(lost), float(abs(lost).max())
    if fall <= DECREASE_TOLERANCE * most + SOLVER_TOLERANCE * work:
        return
    yield diagnostic(
        "W368",
        declared.at(),
        f"{100.0 * fall / most:.2g} % of the energy dissipated by `{declared.name}` is recovered",
        "physically impossible",
        "use another law, for rubber with `of = shape`: this one creates energy",
    )
