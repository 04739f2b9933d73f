"""Building and solving a solid finite element model: everything here is arrays."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter import units
from softmark.interpreter.case import Case, fault
from softmark.interpreter.models import outcome
from softmark.interpreter.models.fem import LARGE_ANGLE, Fem, element_class
from softmark.interpreter.models.holding import solid_supports
from softmark.interpreter.models.loading import solid_loads
from softmark.interpreter.models.prepared import Solution, Workshop
from softmark.interpreter.scene import Declared
from softmark.solvers.assembly import Assembly
from softmark.solvers.elements.interpolation import integration, locate
from softmark.solvers.energies.elastic import Elastic
from softmark.solvers.energies.energy import Floats, VectorSpace
from softmark.solvers.materials import law_for
from softmark.solvers.mesh.file import Unreadable
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.statics import Equilibrium, Statics, equilibrium

if TYPE_CHECKING:
    from softmark.solvers.statics import Watch

LOST_VOLUME = 0.05  # share of the body's volume that a mesh may miss without a warning


@dataclass(frozen=True)
class PreparedSolid:
    """A mesh, its elastic energy, and the static problem."""

    model: Fem
    declared: Declared
    shape: Any
    mesh: Mesh
    elastic: Elastic
    problem: Statics
    size: dict[str, int]
    notes: tuple[Diagnostic, ...]

    def warm(self) -> None:
        """Run every kernel once on the first cell."""
        one = replace(
            self.elastic,
            cells=np.arange(self.elastic.cells.shape[1])[None],
            dNdX=self.elastic.dNdX[:1],
            w=self.elastic.w[:1],
        )
        n = one.cells.size * 3
        small = Assembly(n, np.zeros(0, dtype=np.int64), [one], [])
        small.value(np.zeros(n), 1.0)
        small.gradient(np.zeros(n), 1.0)
        small.tangent(np.zeros(n), 1.0)

    def outside(self, X: Floats) -> float:
        """How far, in m, the farthest of the points X (n, 3) lies outside a mesh that was read from a file."""
        if not getattr(self.shape, "prebuilt", False):
            return 0.0
        return float(locate(self.mesh, X).outside.max(initial=0.0))

    def solve(self, watch: Watch) -> Solution:
        """Static equilibrium from rest."""
        remedy = "try a smaller load, a finer mesh or another strain measure"
        problem = replace(self.problem, watch=watch)
        return outcome.solution(lambda: equilibrium(problem), remedy, self._finish)

    def _finish(self, found: Equilibrium) -> Solution:
        u = found.x.reshape(-1, 3)
        solution = outcome.converged(found, lambda X: locate(self.mesh, X).interpolate(u))
        return replace(
            solution, notes=(*self._misread_rotation(found.x), *outcome.doubts(self.declared, found))
        )

    def _misread_rotation(self, x: Floats) -> tuple[Diagnostic, ...]:
        if self.model.strain != "small":
            return ()
        H = self.elastic.F(x) - np.eye(3)
        skew = 0.5 * (H - H.transpose(0, 2, 1))
        angle = float(np.sqrt(0.5 * np.sum(skew**2, axis=(1, 2))).max())
        if angle < LARGE_ANGLE:
            return ()
        at = self.declared.at("strain")
        return (
            Diagnostic(
                "W306",
                f"`{self.declared.name}` took rotations of up to {units.show(angle, units.ANGLE)} for small ones",
                at.source,
                at.span,
                "outside its range",
                "its numbers are those of a model that does not apply",
            ),
        )


def prepare(model: Fem, declared: Declared, case: Case, workshop: Workshop) -> PreparedSolid:
    """Everything that solving needs. Raises Fault."""
    mesh = mesh_of(model, case, workshop)
    element = element_class(model.element)
    parts = integration(mesh, element)
    elastic = Elastic(mesh.cells, parts.dNdX, parts.w, law_for(case.material, model.strain))
    fixed, target = solid_supports(case, mesh)
    loads = solid_loads(case, mesh, parts, small=model.strain == "small")
    dofs = mesh.points.size
    assembly = Assembly(dofs, fixed, [elastic], loads)
    twin = None
    if model.strain == "finite":
        softer = replace(elastic, law=law_for(case.material, "corotational"))
        twin = assembly.with_internal([softer])

    def sound(x: Floats) -> bool:
        return model.strain == "small" or bool(np.all(np.linalg.det(elastic.F(x)) > 0))

    problem = Statics(
        assembly,
        VectorSpace(dofs),
        np.zeros(dofs),
        fixed,
        target,
        case.analysis.tolerance,
        case.analysis.max_iterations,
        twin,
        sound,
        convex=model.strain == "small" and assembly.conservative,
        extent=mesh.extent,
    )
    size = {"nodes": len(mesh.points), "elements": len(mesh.cells), "dofs": len(assembly.free)}
    return PreparedSolid(
        model, declared, case.shape, mesh, elastic, problem, size, _volume_note(declared, case, mesh)
    )


def mesh_of(model: Fem, case: Case, workshop: Workshop) -> Mesh:
    """The body's mesh, made once for all models that want the same."""
    key = (case.body.name, model.element, model.size)
    if key in workshop.meshes:
        workshop.borrowed = workshop.seconds.get(key, (0.0, 0.0))
    else:
        wall, cpu = time.perf_counter(), time.process_time()
        try:
            workshop.meshes[key] = case.shape.mesh(model.size)
        except Unreadable as error:
            raise fault(
                "E403",
                case.body.at("shape"),
                f"the mesh of `{case.body.name}` cannot be used: {error}",
                help="the file must hold tetrahedra of positive volume",
            ) from error
        workshop.seconds[key] = time.perf_counter() - wall, time.process_time() - cpu
    mesh: Mesh = workshop.meshes[key]
    return mesh


def _volume_note(declared: Declared, case: Case, mesh: Mesh) -> tuple[Diagnostic, ...]:
    if not hasattr(case.shape, "volume"):
        return ()
    lost = 1.0 - float(mesh.volumes.sum()) / case.shape.volume
    if lost < LOST_VOLUME:
        return ()
    at = declared.at("size")
    return (
        Diagnostic(
            "W305",
            f"the mesh of `{declared.name}` holds {100 * lost:.1f} % less volume than the body",
            at.source,
            at.span,
            "too coarse for the curved surface",
            "use a smaller size",
        ),
    )
