"""Checks of hexahedral models of bodies that only tetrahedra can fill."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from softmark.interpreter.language.message_builder import diagnostic
from softmark.solvers.elements import ELEMENTS, element_of
from softmark.solvers.elements.reference_cells import Tetrahedron
from softmark.solvers.mesh.surface_bodies import SurfaceBody, Tetrahedralized

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.mesh.shape import Shape

FIT = " or ".join(f"`{name}`" for name, element in ELEMENTS.items() if element.family == Tetrahedron.family)


def check_filled_surface(model: Declared, case: Case, shape: SurfaceBody) -> Diagnostic | None:
    """Return the error for elements that cannot fill the inside of a surface, or None."""
    kind = _hexahedral_element(model)
    if not kind:
        return None
    name = Path(shape.file).name if isinstance(shape, Tetrahedralized) else case.body.name
    return diagnostic("E577", model.at(), f"`{model.name}` needs {kind}, but `{name}` is filled with tetrahedra",
                      "tetrahedra only", f"use {FIT}; tet10 does not lock as tet4 does")  # fmt: skip


def check_hexahedral_mesh(model: Declared, case: Case, shape: Shape) -> Diagnostic | None:
    """Return the error for hexahedral elements of a shape that has no hexahedral mesh, or None."""
    kind = _hexahedral_element(model)
    if not kind:
        return None
    problem = (
        f"`{model.name}` needs {kind}, but `{case.body.name}` has no mesh of hexahedra: {shape.no_hexahedra_reason}"
    )
    return diagnostic("E335", model.at(), problem, "tetrahedra only", f"use {FIT}, or another shape")


def _hexahedral_element(model: Declared) -> str:
    """Return the solid element of a model if it is not a tetrahedron, else ""."""
    kind: str = model.thing.mesh_key()[0]
    return kind if kind in ELEMENTS and element_of(kind).family != Tetrahedron.family else ""
