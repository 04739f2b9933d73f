"""Transfer of a model to an external program: its mesh, supports, loads and materials.

`reasons` returns the features of a model and its case that cannot be transferred, found without building
arrays; `problem_of` returns the arrays.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

from softmark.interpreter.models.fem.fem_declaration import Fem
from softmark.interpreter.vocabulary.analysis_words import Dynamic, Static
from softmark.solvers.materials import WORDS

if TYPE_CHECKING:
    from softmark.interpreter.models.external.external_problem import ExternalMaterial, Motion, Problem
    from softmark.interpreter.models.fem.fem_builder import PreparedSolid
    from softmark.interpreter.models.shared.material_regions import MaterialRegion
    from softmark.interpreter.problem.body_case import Case

Reason = tuple[str, str]  # unsupported feature, and the reason

_NO_TIME = "external programs solve static analyses only"
_NO_PAST = "the exchange format has no deformation history"
_NO_REST = "it steps through time and solves no static equilibrium: use a dynamic analysis"
_FROM_REST = "motions start from rest, under loads that act in full from the start"
_DEAD = "loads are exchanged as dead forces on nodes of the undeformed body, and this load follows the body"


class NotTransferable(Exception):
    """Error that a model cannot be transferred to other programs; `reasons` has its features, with reasons."""

    def __init__(self, reasons: list[Reason]) -> None:
        """Store the features that cannot be transferred, with reasons."""
        super().__init__("; ".join(f"{what}: {why}" for what, why in reasons))
        self.reasons = reasons


def untransferable_features(model: Any, case: Case, moves: bool = False) -> list[Reason]:
    """Return the features of a model and its case that a `Problem` cannot express, with reasons.

    `moves` is true for a program that integrates in time.
    """
    found = untransferable_case_features(model, case, moves)
    return (
        [*_untransferable_model_features(model), *found, *untransferable_loads(model, case)]
        if isinstance(model, Fem)
        else found
    )


def untransferable_case_features(model: Any, case: Case, moves: bool = False) -> list[Reason]:
    """Return features of the analysis, body and supports that a `Problem` cannot express, with reasons.

    They exclude every program.

    `moves` is true for a program that integrates in time.
    """
    if not isinstance(model, Fem):
        return [("the model", "only `fem(...)` has cells, nodes and a law that other programs know")]
    analysis = unsupported_motion(case) if moves else _untransferable_analysis_features(case)
    return [*analysis, *unsupported_body(case), *_unsupported_supports(case)]


def _untransferable_model_features(model: Fem) -> Iterator[Reason]:
    """Yield features of a finite element model that cannot be transferred, with reasons."""
    if model.strain == "corotational":
        yield (
            "strain = corotational",
            "this energy is specific to softmark: other programs have small strain or laws at finite strain",
        )
    if model.formulation != "displacement":
        yield f"formulation = {model.formulation}", "other programs get a displacement formulation, without pressures"
    if model.integration != "full":
        yield (
            f"integration = {model.integration}",
            "reduced and selective integration mean different things in other programs",
        )
    if model.max_iterations is not None or model.max_linear_iterations is not None:
        yield (
            "max_iterations" if model.max_iterations is not None else "max_linear_iterations",
            "other programs do not accept unconverged states in this way",
        )


def _untransferable_analysis_features(case: Case) -> Iterator[Reason]:
    """Yield features of the analysis that cannot be transferred, with reasons."""
    if isinstance(case.analysis, Dynamic):
        yield "the dynamic analysis", _NO_TIME
    elif not isinstance(case.analysis, Static):
        yield "the quasistatic analysis", _NO_TIME
    elif case.analysis.path != "load":
        yield (
            f"path = {case.analysis.path}",
            "other programs raise the load in steps and do not follow a path past a limit point",
        )
    elif case.analysis.disturbed != "none":
        yield f"disturbed = {case.analysis.disturbed}", "other programs start from rest"


def unsupported_motion(case: Case) -> Iterator[Reason]:
    """Yield features of a motion that cannot be transferred: a start not at rest, or varying loads and supports."""
    analysis = case.analysis
    if not isinstance(analysis, Dynamic):
        rest = "static" if isinstance(analysis, Static) else "quasistatic"  # of one of its states too
        yield f"the {rest} analysis", _NO_REST
        return
    for name in ("velocity", "spin"):
        if any(getattr(analysis, name)):
            yield name, _FROM_REST
    for load in case.loads:
        if load.thing.amplitude is not None:
            yield f"load `{load.name}`", _FROM_REST
    for support in case.supports:
        if support.thing.moves:
            yield f"support `{support.name}`", "in a dynamic analysis supported nodes must stay at rest"


def unsupported_body(case: Case) -> Iterator[Reason]:
    """Yield features of a body and its material that cannot be transferred, with reasons."""
    if case.planar in ("plane_stress", "axisymmetric"):
        yield case.planar, "a plate or a body of revolution is not exchanged as a solid"
    for material in case.materials:
        name = type(material).__name__
        if not getattr(material, "uniform", True):
            yield f"the graded {name}", "the exchange format has one number for each material constant"
        if getattr(material, "directed", False):
            yield f"the directed {name}", "the exchange format has no fibres"
        if getattr(material, "pulls", False):
            yield f"the muscle {name}", "the exchange format has no active stress"
    if case.porous:
        yield "poroelastic material", _NO_PAST
    elif case.has_material_history:
        yield "viscoelastic material", _NO_PAST


def _unsupported_supports(case: Case) -> Iterator[Reason]:
    """Yield features of supports that cannot be transferred, with reasons."""
    for support in (*case.supports, *case.beds, *case.drains):
        if why := support.thing.export_fault:
            yield f"support `{support.name}`", why
    names = [*(touch.name for touch in case.contacts), *(pair.name for pair in case.pairs)]
    for name in names:
        yield f"contact `{name}`", "the exchange format has one body without contact"


def untransferable_loads(model: Fem, case: Case) -> Iterator[Reason]:
    """Yield the loads that cannot be transferred, with reasons: those that follow the deformed surface."""
    for load in case.loads:
        action = load.thing.action
        if not action.dead and (model.strain != "small" or action.balanced):
            yield f"load `{load.name}`", _DEAD


def problem_of(prepared: PreparedSolid, case: Case, mesh: bool = False, motion: Motion | None = None) -> Problem:
    """Return the problem of a prepared `fem(...)` model in a case, or in one state of it. Raises NotTransferable.

    Problems at small strain have the initial moduli of any material, so that their law is `linear_elastic`. Problems
    with a motion also have initial moduli, but keep the name of the law. If `mesh` is true, the caller uses only the
    mesh, and forces are those on the undeformed body.
    """
    import numpy as np

    from softmark.interpreter.models.external.external_problem import Problem

    if found := (untransferable_case_features if mesh else untransferable_features)(
        prepared.model, case, motion is not None
    ):
        raise NotTransferable(found)
    stuff = _transfer_material if motion is None else _material_by_moduli
    made, fixed = prepared.mesh, np.asarray(prepared.problem.fixed, dtype=np.int64)
    forces = sum((f for _, f in prepared.forces()), np.zeros_like(made.points))
    return Problem(
        points=made.points,
        cells=np.asarray(made.cells, dtype=np.int64),
        element=made.kind,
        strain=prepared.model.strain,
        stuff=tuple(stuff(own, prepared.model.strain, len(made.cells)) for own in prepared.pieces),
        held=np.stack(np.divmod(fixed, 3), axis=1),
        values=np.asarray(prepared.problem.target, dtype=np.float64),
        forces=forces,
        tolerance=case.analysis.tolerance,
        motion=motion,
    )


def _material_by_moduli(own: MaterialRegion, strain: str, count: int) -> ExternalMaterial:
    """Return a material with its initial moduli and the name of its law."""
    return replace(_transfer_material(own, "small", count), law=_law(own.case.material))


def _transfer_material(own: MaterialRegion, strain: str, count: int) -> ExternalMaterial:
    """Return the material of a region with its constants, and the cells that have it."""
    import numpy as np

    from softmark.interpreter.models.external.external_problem import ExternalMaterial

    cells = np.arange(count, dtype=np.int64)[own.which]
    material = own.case.material
    if strain != "finite":
        young = 2.0 * material.shear_modulus * (1.0 + material.poisson)
        return ExternalMaterial(
            "linear_elastic", {"young": young, "poisson": material.poisson}, material.density, cells
        )
    constants, choices = dict[str, float](), dict[str, str]()
    for name in (f.name for f in fields(material)):
        value = getattr(material, name)
        if isinstance(value, str):
            choices[name] = value
        elif isinstance(value, tuple):  # of a law with terms: mu_1, mu_2, ...
            constants |= {f"{name}_{i}": float(v) for i, v in enumerate(value, start=1)}
        elif value is not None and name != "density":
            constants[name] = float(value)
    return ExternalMaterial(_law(material), constants, material.density, cells, choices)


def _law(material: Any) -> str:
    """Return the name of the law of a material in the language."""
    return next(word for word, kind in WORDS.items() if type(material) is kind)
