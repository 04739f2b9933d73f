"""Checks of surfaces that are to be filled with tetrahedra; they do not run the mesher."""

from __future__ import annotations

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.shared.filled_mesh_notes import repair_warning, thickness_warning
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.validation.tetrahedra_checks import check_filled_surface
from softmark.solvers.mesh.boolean_operations import MISSING
from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh
from softmark.solvers.mesh.surface_bodies import SurfaceBody


def doubts(model: Declared, case: Case, shape: SurfaceBody) -> tuple[Diagnostic, ...]:
    """Return errors and warnings about a model whose body is the inside of a closed surface.

    For a surface of a public data set, which is not read here, only the element of the model is checked.
    """
    found = [check_filled_surface(model, case, shape)]
    if not shape.fault and "data:" not in shape.file:
        try:
            surface = shape.closed(model.thing.size)
        except UnreadableMesh as error:
            if error.code == MISSING:  # reported by the run, as is a missing mesher
                return tuple(d for d in found if d is not None)
            problem = f"the surface of `{case.body.name}` cannot be filled with tetrahedra: {error}"
            remedy = error.remedy or "name a file with one closed surface"
            return (diagnostic(error.code, case.body.at("shape"), problem, "cannot be filled", remedy),)
        found += [repair_warning(case, surface), thickness_warning(model, case, surface)]
    return tuple(d for d in found if d is not None)
