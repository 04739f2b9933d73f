"""Table of the builder module of each model class. Builders need arrays; they are imported only when used.

To add a model, add its declaration to MODELS and its builder module here. The module has `load(model)`, which
imports the libraries that building needs, and `prepare(model, declared, case, workshop)`, which raises Fault.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.loaded_plugin import find_faulty_plugin
from softmark.interpreter.models.beam.beam_declaration import Beam6Dof
from softmark.interpreter.models.beam_frame.frame_declaration import Frame6Dof
from softmark.interpreter.models.external.external_declaration import ExternalSolver
from softmark.interpreter.models.external.rods.external_rod_declaration import ExternalRod
from softmark.interpreter.models.fem.fem_declaration import Fem
from softmark.interpreter.models.imported_results.imported_results_declaration import Results
from softmark.interpreter.models.material_point.material_point_declaration import Homogeneous
from softmark.interpreter.models.reduced.reduced_declaration import Modal, Pod
from softmark.interpreter.models.shared.prepared_model import BuildContext, Prepared
from softmark.interpreter.models.spring_network.spring_declaration import MassSpring
from softmark.interpreter.problem.body_case import Case
from softmark.records import dataclass


@dataclass(frozen=True)
class Builder:
    """Interface of the builder of a model that a plugin defines."""

    load: Callable[[Any], None]
    prepare: Callable[[Any, Declared, Case, BuildContext], Prepared]


PREPARED = ("size", "notes", "mesh", "assembly", "points", "forces", "outside", "warm", "after", "solve")

BUILDERS: dict[type[Any], str | Builder] = {
    Fem: "softmark.interpreter.models.fem.fem_builder",
    Beam6Dof: "softmark.interpreter.models.beam.beam_builder",
    Frame6Dof: "softmark.interpreter.models.beam_frame.frame_builder",
    Homogeneous: "softmark.interpreter.models.material_point.material_point_builder",
    MassSpring: "softmark.interpreter.models.spring_network.spring_builder",
    ExternalSolver: "softmark.interpreter.models.external.external_builder",
    ExternalRod: "softmark.interpreter.models.external.rods.external_rod_builder",
    Modal: "softmark.interpreter.models.reduced.reduced_builder",
    Pod: "softmark.interpreter.models.reduced.reduced_builder",
    Results: "softmark.interpreter.models.imported_results.imported_results_builder",
}

# builders for viscoelastic bodies
REMEMBERING: dict[type[Any], str] = {
    Fem: "softmark.interpreter.models.fem.fem_relaxation",
    Beam6Dof: "softmark.interpreter.models.beam.beam_relaxation",
    ExternalSolver: "softmark.interpreter.models.external.external_builder",  # which reports that it is unsupported
    ExternalRod: "softmark.interpreter.models.external.rods.external_rod_builder",
}
# builders for poroelastic bodies
SOAKED: dict[type[Any], str] = {
    Fem: "softmark.interpreter.models.fem.poroelastic_analysis",
    ExternalSolver: "softmark.interpreter.models.external.external_builder",
}


def load(model: Any) -> None:
    """Import the modules that building a model needs, before timing starts. Raises KeyError for an unknown model."""
    _builder(model).load(model)


def build(declared: Declared, case: Case, workshop: BuildContext) -> Prepared:
    """Return a model of a scene built as arrays, ready to solve. Raises Fault.

    The builder may build other models through the workshop.
    """
    workshop.build = build
    builder = _builder(declared.thing)
    if case.has_material_history:
        known = (SOAKED if case.porous else REMEMBERING).get(type(declared.thing))
        builder = builder if known is None else import_module(known)
    try:
        prepared: Prepared = builder.prepare(declared.thing, declared, case, workshop)
        missing = [n for n in PREPARED if isinstance(builder, Builder) and not hasattr(prepared, n)]
    except Exception as error:
        if (whose := find_faulty_plugin(error)) is None:
            raise
        from softmark.interpreter.models.shared.unavailable_model import UnavailableModel

        return UnavailableModel(whose, "failed")
    if missing:
        from softmark.interpreter.models.shared.unavailable_model import UnavailableModel

        return UnavailableModel(f"its builder returns a {type(prepared).__name__} without `{missing[0]}`", "failed")
    return prepared


def _builder(model: Any) -> Any:
    known = BUILDERS[type(model)]
    return known if isinstance(known, Builder) else import_module(known)
