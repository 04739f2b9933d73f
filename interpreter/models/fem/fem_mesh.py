"""Meshes of finite element models, shared by the models of a run."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.fem import solver_options
from softmark.interpreter.models.fem.fem_declaration import Fem
from softmark.interpreter.models.shared import mesh_notes
from softmark.interpreter.models.shared.prepared_model import BuildContext
from softmark.interpreter.problem.body_case import Case, Fault, fault
from softmark.interpreter.problem.conforming_mesh import Cuts
from softmark.interpreter.problem.data_sets import download_shape
from softmark.solvers.elements import ELEMENTS, UnknownElement, solid_element_name
from softmark.solvers.mesh.files.mesh_reader import UnreadableMesh
from softmark.solvers.mesh.mesh import Mesh

if TYPE_CHECKING:
    from softmark.solvers.mesh.shape import Shape


def mesh_of(model: Fem, declared: Declared, case: Case, workshop: BuildContext) -> Mesh:
    """Return the mesh of a model, shared by all models with the same mesh key. Raises Fault."""
    key = model.meshed_as(case)
    if key in workshop.meshes:
        workshop.borrowed = workshop.seconds.get(key, (0.0, 0.0))
    else:
        wall, cpu = time.perf_counter(), time.process_time()
        at = declared.at("mesh") if model.mesh is not None else case.shape_location
        shape = download_shape(model.mesh or case.shape, at)
        cuts = model.cuts(case, shape)
        try:
            made = _make_mesh(model, case, shape, cuts)
            workshop.meshes[key] = mesh_notes.distort_to_quality(made, model, declared)
        except UnknownElement as error:
            raise Fault(solver_options.unknown_element(declared, error)) from error
        except UnreadableMesh as error:
            raise fault(
                error.code,
                at,
                f"the mesh of `{case.body.name}` cannot be used: {error}",
                help=error.remedy or _describe_accepted_cells(),
            ) from error
        workshop.seconds[key] = time.perf_counter() - wall, time.process_time() - cpu
    mesh: Mesh = workshop.meshes[key]
    return mesh


def _make_mesh(model: Fem, case: Case, shape: Shape, cuts: Cuts) -> Mesh:
    """Return the mesh of a shape that conforms to `cuts`, with the groups of its file, if any. Raises Fault."""
    kind = solid_element_name(model.element)
    if not case.groups:
        return shape.mesh(kind, model.size or 0.0, cuts)  # a file's has no size but its own
    from softmark.interpreter.problem import mesh_group_conditions

    mesh = shape.mesh_with_groups(kind) if shape.prebuilt else shape.mesh(kind, model.size or 0.0, cuts)
    mesh_group_conditions.check_mesh_groups(case.groups, mesh)
    return mesh


def _describe_accepted_cells() -> str:
    """Return a description of the file cells that each element can be made from."""
    hexahedra, tetrahedra = ([n for n, e in ELEMENTS.items() if e.family == f] for f in ("hexahedra", "tetrahedra"))
    takes = "takes" if len(hexahedra) == 1 else "take"
    either, other = (solver_options.join_words(names, "and") for names in (hexahedra, tetrahedra))
    return f"{either} {takes} hexahedra; {other} take tetrahedra, or hexahedra that are split"
