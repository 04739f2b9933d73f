"""Surfaces that are to be filled, looked at when a scene is checked: the mesher has no part in it."""

from __future__ import annotations

from pathlib import Path

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.messages import diagnostic
from softmark.interpreter.language.scene import Declared
from softmark.interpreter.models.shared.filled import repaired, too_thin
from softmark.interpreter.problem.case import Case
from softmark.solvers.elements import ELEMENTS, element_of
from softmark.solvers.elements.cells import Tetrahedron
from softmark.solvers.mesh.combining import MISSING
from softmark.solvers.mesh.files.flaws import UnreadableMesh
from softmark.solvers.mesh.filled import Enclosed, Filled


def doubts(model: Declared, case: Case, shape: Enclosed) -> tuple[Diagnostic, ...]:
    """What speaks against a model of a body that such a surface encloses; of a public data set only its elements."""
    found = [_hexahedra(model, case, shape)]
    if not shape.fault and "data:" not in shape.file:
        try:
            surface = shape.closed(model.thing.size)
        except UnreadableMesh as error:
            if error.code == MISSING:  # which is said when the scene runs, as a mesher that is missing is
                return tuple(d for d in found if d is not None)
            problem = f"the surface of `{case.body.name}` cannot be filled: {error}"
            remedy = error.remedy or "name a file of one closed surface"
            return (diagnostic(error.code, case.body.at("shape"), problem, "encloses no body", remedy),)
        found += [repaired(case, surface), too_thin(model, case, surface)]
    return tuple(d for d in found if d is not None)


def _hexahedra(model: Declared, case: Case, shape: Enclosed) -> Diagnostic | None:
    """Elements that a filled surface cannot be made of."""
    kind = model.thing.mesh_key()[0]
    if kind not in ELEMENTS or element_of(kind).family == Tetrahedron.family:
        return None
    fit = [f"`{name}`" for name, element in ELEMENTS.items() if element.family == Tetrahedron.family]
    name = Path(shape.file).name if isinstance(shape, Filled) else case.body.name
    return diagnostic("E577", model.at(), f"`{model.name}` asks for {kind}, and `{name}` is filled with tetrahedra",
                      "tetrahedra only", f"take {' or '.join(fit)}; tet10 does not lock as tet4 does")  # fmt: skip
