"""Independent nodal forces of loads on solids, by integrals over swept facets (facet_sweep.py) and over cells."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.models.shared.material_regions import mass_points
from softmark.interpreter.models.shared.prepared_model import DeformedMesh
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.verification.cell_materials_check import split_by_material
from softmark.interpreter.verification.facet_sweep import MOST_UNSURE, sample_facets, select_facets
from softmark.interpreter.verification.unverified_model_error import NoIndependentFormula
from softmark.interpreter.vocabulary.loads.load import Matrix3, Vector3
from softmark.records import dataclass
from softmark.solvers.independent_forces import mass_forces, solid_forces
from softmark.solvers.independent_forces.solid_forces import Floats, Ints

if TYPE_CHECKING:
    from softmark.solvers.mesh.mesh import Mesh


def load_forces(case: Case, mesh: DeformedMesh, u: Floats, small: bool, mass: str) -> tuple[Floats, float]:
    """Return the nodal forces of all loads (n, 3), N, and their uncertainty, N. Raises NoIndependentFormula."""
    total, unsure = np.zeros_like(mesh.points), 0.0
    check = IndependentSolidLoads(case, mesh, u, small, mass)
    for load in case.loads:
        if (own := load.thing.action.independent_forces(check)) is None:
            raise NoIndependentFormula(f"no independent formula is available for the load `{load.name}`")
        found, left = own
        if left > MOST_UNSURE * float(np.abs(found).sum()):
            raise NoIndependentFormula("the border of the loaded area is too complex to be integrated independently")
        total += found
        unsure += left
    return total, unsure


@dataclass(frozen=True)
class IndependentSolidLoads:
    """Operations from which loads compute their nodal forces (n, 3), N, and their uncertainty, N, for verification.

    The formulas are independent of the solver. `u` (n, 3), m, are the displacements of the nodes. All methods raise
    NoIndependentFormula.
    """

    case: Case
    mesh: DeformedMesh
    u: Floats
    small: bool
    mass: str

    def mass_forces(self, constant: Vector3, gradient: Matrix3 | None = None) -> tuple[Floats, float]:
        """Return the forces of a force per mass `constant + gradient x`, m/s^2, in the current positions x, m."""
        mesh, found = self.mesh, np.zeros_like(self.mesh.points)
        now = mesh.points if self.small else mesh.points + self.u
        c, G = np.array(constant), np.zeros((3, 3)) if gradient is None else np.array(gradient)

        def field(x: Floats) -> Floats:
            return c + x @ G.T

        for own, which in split_by_material(self.case, mesh):
            cells, density, depth = mesh.cells[which], _density(own), self.case.depth
            rules = mass_points(own, mesh.mesh, which)
            if gradient is not None and self.mass == "consistent":
                found += mass_forces.affine_mass_forces(
                    mesh.points, now, cells, mesh.kind, density, field, depth, rules
                )
            else:
                carried = mass_forces.nodal_masses(
                    mesh.points, cells, mesh.kind, density, self.mass, len(mesh.points), depth, rules
                )
                found += carried[:, None] * field(now)
        return found, 0.0

    def area_forces(
        self, where: Condition, push: Callable[[Floats], Floats], linear: bool = False, deformed: bool = False
    ) -> tuple[Floats, float]:
        """Return the nodal forces of a traction on the selected surface.

        `push` maps area vectors, m^2, to forces, N; `linear` states whether this map is linear. The area vectors are
        those of the undeformed surface or, with `deformed`, of the deformed one.
        """
        surface = self.mesh.points + self.u if deformed else self.mesh.points
        return _area_forces(where, linear, self.case, self.mesh.mesh, surface, push)

    def surface_moment(self, where: Condition, moment: Vector3) -> tuple[Floats, float]:
        """Return the forces of a moment, N m, on the selected part of the surface."""
        surface = self.mesh.points if self.small else self.mesh.points + self.u
        return _moment_forces(where, moment, self.case, self.mesh.mesh, surface)

    def point_force(self, at: Vector3, force: Vector3) -> tuple[Floats, float]:
        """Return the forces of a force, N, at a material point, m."""
        from softmark.interpreter.verification import point_and_line_loads_check  # only imported for these loads

        return point_and_line_loads_check.at_points(at, force, self.case, self.mesh), 0.0

    def line_force(self, begin: Vector3, end: Vector3, force: Vector3) -> tuple[Floats, float]:
        """Return the forces of a force per length, N/m, along a straight line."""
        from softmark.interpreter.verification import point_and_line_loads_check

        return point_and_line_loads_check.along_line(begin, end, force, self.mesh.mesh)


def _density(case: Case) -> Any:
    """Return the density, kg/m^3, or a function of points."""
    if case.uniform:
        return case.material.density
    from softmark.interpreter.verification.heterogeneous_constants_check import density_of

    return density_of(case)


def _area_forces(
    where: Condition,
    linear: bool,
    case: Case,
    mesh: Mesh,
    surface: Floats,
    push: Callable[[Floats], Floats],
) -> tuple[Floats, float]:
    """Return nodal forces (n, 3), N, of a load on a part of the surface through nodes `surface` (n, 3), m.

    Also the norm of their uncertainty, N. `push` maps area vectors to forces. Raises NoIndependentFormula.
    """
    found: Floats = np.zeros_like(surface)
    unsure = 0.0
    for whole, (f, xi, w), (g, left) in select_facets(where, case, mesh):
        if linear or whole.shape[1] == 3:
            found += solid_forces.surface_forces(surface, whole, push, case.depth)
        else:
            for each, at, weights in sample_facets(whole):
                found += solid_forces.part_forces(surface, each, at, weights, push, case.depth)
        found += solid_forces.part_forces(surface, f, xi, w, push, case.depth)
        vague = solid_forces.part_forces(surface, g, np.full((len(g), 2), 0.25), left, push, case.depth)
        unsure += float(np.abs(vague).sum())
    return found, unsure


def _moment_forces(where: Condition, moment: Vector3, case: Case, mesh: Mesh, surface: Floats) -> tuple[Floats, float]:
    """Return nodal forces (n, 3), N, of a moment on the selected part of a surface now at `surface` (n, 3), m.

    `surface` (n, 3), m, are the current nodes. The traction is t = c x (x - middle), with int (x - middle) x t dA =
    moment. Raises NoIndependentFormula.
    """
    known: list[tuple[Ints, Floats, Floats]] = []  # nodes, shape functions and area of every point
    vague = 0.0
    for whole, parts, (g, left) in select_facets(where, case, mesh):
        for facets, xi, w in (*sample_facets(whole), parts):
            known.append(
                (facets, solid_forces.shape_functions(facets.shape[1], xi), w * _area_ratio(mesh.points, facets, xi))
            )
        vague += float(left @ _area_ratio(mesh.points, g, np.full((len(g), 2), 0.25)))
    area = np.concatenate([own for _, _, own in known])
    x = np.concatenate([np.einsum("pa,pai->pi", N, surface[facets]) for facets, N, _ in known])
    r = x - area @ x / area.sum()
    J = (area @ (r**2).sum(axis=1)) * np.eye(3) - np.einsum("p,pi,pj->ij", area, r, r)
    forces = area[:, None] * np.cross(np.linalg.solve(J, np.array(moment)), r)
    found, begin = np.zeros_like(surface), 0
    for facets, N, own in known:
        some, begin = forces[begin : begin + len(own)], begin + len(own)
        np.add.at(found, facets, N[:, :, None] * some[:, None])
    return found, vague / float(area.sum()) * float(np.linalg.norm(forces, axis=1).sum())


def _area_ratio(points: Floats, facets: Ints, xi: Floats) -> Floats:
    """Return the ratio of area, m^2, to local area (p,) at local points xi (p, 2) of facets (p, k)."""
    t = np.einsum("pai,paj->jpi", points[facets], solid_forces.shape_derivatives(facets.shape[1], xi))
    found: Floats = np.linalg.norm(np.cross(t[0], t[1]), axis=1)
    return found
