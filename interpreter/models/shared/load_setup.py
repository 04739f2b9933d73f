"""Loads on solid meshes, created from the scene as nodal forces and follower pressures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.models.shared.loaded_surface import surface_of
from softmark.interpreter.models.shared.material_regions import regions_by_material
from softmark.interpreter.problem.body_case import Case, fault
from softmark.interpreter.problem.surface_selection.loaded_surface_part import LoadedSurface
from softmark.interpreter.problem.symmetry_planes import (
    must_not_act_on_axis,
    must_not_act_on_plane,
    refuse_moment_at_plane,
)
from softmark.interpreter.vocabulary.loads.load import Matrix3, Vector3
from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.external_loads import AffineMassForces, DeadForces, FaceMoment, FollowerPressure
from softmark.solvers.mesh.element_interpolation import IntegrationPoints, locate_points
from softmark.solvers.mesh.mesh import Mesh

MOST_NODES = 1500  # largest number of nodes of a moment: its tangent couples all pairs of nodes and takes 0.2 GB
Distribution = Literal["consistent", "lumped", "uniform"]


def merge_loads(applied: Sequence[tuple[Declared, Energy]], dofs: int) -> list[Energy]:
    """Return the energies of all loads, with all dead forces (those of fixed direction) merged into one energy."""
    found = [energy for _, energy in applied]
    dead = sum((e.f for e in found if isinstance(e, DeadForces)), np.zeros(dofs))
    return [DeadForces(dead), *(e for e in found if not isinstance(e, DeadForces))]


def nodal_forces_at_rest(load: Energy, points: Floats) -> Floats:
    """Return the nodal forces (n, 3), N, of a load on the undeformed body, whose nodes are `points` (n, 3), m."""
    g = np.zeros(points.size)
    load.add_gradient(np.zeros_like(g), g)
    return -g.reshape(-1, 3)


def single_loads(
    case: Case, mesh: Mesh, parts: IntegrationPoints, small: bool, mass: Distribution = "consistent"
) -> list[tuple[Declared, Energy]]:
    """Return the energy of each load separately, at full size. Raises Fault.

    If `small`, pressure acts on the undeformed surface.
    """
    return [(load, _load(case, load, mesh, parts, small, mass)) for load in case.loads]


def _load(case: Case, load: Declared, mesh: Mesh, parts: IntegrationPoints, small: bool, mass: Distribution) -> Energy:
    """Return the energy of one load at full size. Raises Fault."""
    energy: Energy = load.thing.action.solid_energy(SolidLoads(case, load, mesh, parts, small, mass))
    return energy


@dataclass(frozen=True)
class SolidLoads:
    """Operations by which a load applies its forces to the mesh of a solid (vocabulary/loads/load.py)."""

    case: Case
    load: Declared
    mesh: Mesh
    parts: IntegrationPoints
    small: bool  # pressures and moments act on the undeformed surface
    mass: Distribution

    def mass_forces(self, constant: Vector3, gradient: Matrix3 | None = None) -> Energy:
        """Return the energy of a force per mass `constant + gradient x`, m/s^2, in the current positions x, m.

        For small strain these are the undeformed positions. Raises Fault.
        """
        if gradient is not None:
            return self._affine_mass_forces(np.array(constant), np.array(gradient))
        mesh, dead = self.mesh, np.zeros((len(self.mesh.points), 3))
        for own in regions_by_material(self.case, mesh, self.parts):
            weights = nodal_mass(own.mesh, own.parts, own.density, self.mass, self.case.depth)
            dead += weights[:, None] * np.array(constant)
        return DeadForces(dead.ravel())

    def _affine_mass_forces(self, constant: Floats, gradient: Floats) -> Energy:
        """Return the energy of a force per mass that is affine in positions. Raises Fault."""
        mesh, depth = self.mesh, self.case.depth
        regions = regions_by_material(self.case, mesh, self.parts)
        if self.mass == "consistent":
            cells = np.concatenate([own.mesh.cells for own in regions])
            masses = np.concatenate([_cell_mass_matrices(own.mesh, own.density, depth) for own in regions])
        else:
            cells = np.arange(len(mesh.points))[:, None]
            carried = sum(nodal_mass(own.mesh, own.parts, own.density, self.mass, depth) for own in regions)
            masses = np.reshape(carried, (-1, 1, 1))
        found = AffineMassForces(mesh.points, cells, masses, constant, gradient)
        return DeadForces(nodal_forces_at_rest(found, mesh.points).ravel()) if self.small else found

    def area_forces(self, where: Condition, push: Any, linear: bool) -> Energy:
        """Return the energy of dead forces on the part of the surface that a condition selects. Raises Fault.

        `push` is a function from outward area vectors, m^2, to forces, N; `linear` states whether it is linear.
        """
        dead = np.zeros((len(self.mesh.points), 3))
        self._surface(where).add_load_forces(dead, push, linear, self.case.depth)
        return DeadForces(dead.ravel())

    def follower_pressure(self, where: Condition, pressure: float) -> Energy:
        """Return the energy of a pressure, Pa, on the selected part of the deformed surface. Raises Fault."""
        points, depth = self.mesh.points, self.case.depth
        facets, of_parts = self._surface(where).facets_with_weights
        if depth:
            from softmark.solvers.energies.axisymmetric import AxisymmetricPressure

            return AxisymmetricPressure(points, facets, pressure, of_parts, depth=depth)
        return FollowerPressure(points, facets, pressure, of_parts)

    def surface_moment(self, where: Condition, moment: Vector3) -> Energy:
        """Return the energy of a moment, N m, on the selected part of the surface.

        Raises Fault, also if its nodes are too many for a fully coupled tangent.
        """
        case, load, points = self.case, self.load, self.mesh.points
        surface = self._surface(where)
        taken = np.concatenate([surface.whole, surface.nodes])
        refuse_moment_at_plane(case, load, points[taken], points)
        if (count := len(np.unique(taken))) > MOST_NODES:
            raise fault(
                "E520",
                load.at("where"),
                f"`{load.name}` acts on {count} nodes of the mesh of `{case.body.name}`, each coupled to all others",
                f"at most {MOST_NODES}",
                "use a coarser mesh, a smaller part of the face, or `rotated(...)`, which imposes the angle instead",
            )
        nodes, products = surface.shape_function_integrals()
        turning = FaceMoment(points, nodes, products, np.array(moment))
        return DeadForces(nodal_forces_at_rest(turning, points).ravel()) if self.small else turning

    def point_force(self, at: Vector3, force: Vector3) -> Energy:
        """Return the energy of a dead force, N, at a material point, m. Raises Fault outside a body from a file."""
        case, load, mesh = self.case, self.load, self.mesh
        dead, place = np.zeros((len(mesh.points), 3)), locate_points(mesh, np.array([at]))
        if case.shape.file and place.outside[0] > 0:
            away = units.format_value(float(place.outside[0]), units.LENGTH)
            raise fault(
                "E504",
                load.at("at"),
                f"`{load.name}` acts at a point about {away} outside `{case.body.name}`",
                "outside the body",
                "write coordinates of the undeformed body",
            )
        if case.planar:  # distributed along z exactly, since all nodes along z move alike
            half = 0.5 * case.body.thing.thickness / np.sqrt(3.0)
            place = locate_points(mesh, np.array([(*at[:2], -half), (*at[:2], half)]))
        np.add.at(dead, place.nodes, place.N[:, :, None] * (np.array(force) / len(place.nodes)))
        return DeadForces(dead.ravel())

    def line_force(self, begin: Vector3, end: Vector3, force: Vector3) -> Energy:
        """Return the energy of a dead force per length, N/m, along a line, cell by cell.

        Raises Fault where the line leaves a body from a file.
        """
        from softmark.solvers.mesh.mesh_line import line_quadrature

        case, load, mesh = self.case, self.load, self.mesh
        X, w = line_quadrature(mesh, np.array(begin), np.array(end))
        dead, place = np.zeros((len(mesh.points), 3)), locate_points(mesh, X)
        if case.shape.file and (away := float(place.outside.max())) > 0.0:
            raise fault(
                "E504",
                load.at("from"),
                f"`{load.name}` extends up to {units.format_value(away, units.LENGTH)} outside `{case.body.name}`",
                "outside the body",
                "write end points with no gap of the undeformed body between them",
            )
        np.add.at(dead, place.nodes, (w[:, None] * place.N)[:, :, None] * np.array(force))
        return DeadForces(dead.ravel())

    def _surface(self, where: Condition) -> LoadedSurface:
        """Return the loaded part of the surface. Raises Fault, also for dead loads on a plane of symmetry."""
        case, load, points = self.case, self.load, self.mesh.points
        found = surface_of(case, load, where, self.mesh)
        must_not_act_on_axis(case, load, points[found.selected_facets], points)
        if load.thing.action.dead:  # a pressure on the plane is carried by the plane's support
            must_not_act_on_plane(case, load, points[found.selected_facets], points)
        return found


def nodal_mass(mesh: Mesh, parts: IntegrationPoints, density: Any, mass: Distribution, depth: float = 0.0) -> Floats:
    """Return the mass of each node (n,), kg.

    `mass` selects how it is computed: row sums of the consistent matrix, its diagonal, or equal shares of cells.
    `density` is a number, kg/m^3, or an object with a method `at`. For a body of revolution `depth`, m, is the
    depth of its slice; masses are then those of whole rings, by the consistent matrix.
    """
    if mass == "uniform":
        whole = (
            float(parts.w.sum()) * density
            if isinstance(density, float | int)
            else _mass_quadrature(mesh, density)[1].sum()
        )
        return np.full(len(mesh.points), float(whole) / len(mesh.points))
    if mass == "lumped":
        lumped: Floats = mass_matrix(mesh, parts, density, mass)[::3]
        return lumped
    N, w, density = _mass_quadrature(mesh, density)  # weights of the mass matrix
    w = _whole_rings(mesh, N, w, depth)
    carried = np.zeros(len(mesh.points))
    np.add.at(carried, mesh.cells, density * w @ N if N.ndim == 2 else density * np.einsum("mq,mqa->ma", w, N))
    return carried


def _cell_mass_matrices(mesh: Mesh, density: Any, depth: float) -> Floats:
    """Return the mass matrix of each cell (m, a, a), kg, for one displacement component.

    With a `depth`, m, the mesh is a slice of that depth, and the masses are those of whole rings.
    """
    from softmark.solvers.dynamics.mass_matrices import cell_mass_matrices

    N, w, density = _mass_quadrature(mesh, density)
    return cell_mass_matrices(N, _whole_rings(mesh, N, w, depth), density)


def _whole_rings(mesh: Mesh, N: Floats, w: Floats, depth: float) -> Floats:
    """Return the volumes (m, q), m^3, of the points with shape functions N.

    With a `depth`, m, the mesh is a slice of that depth, and the volumes are those of whole rings.
    """
    if not depth:
        return w
    from softmark.solvers.energies.axisymmetric import circumference_in_slices

    return w * circumference_in_slices((N @ mesh.points[mesh.cells, 0][:, :, None])[:, :, 0], depth)


def _mass_quadrature(mesh: Mesh, density: Any) -> tuple[Floats, Floats, float]:
    """Return the quadrature of mass integrals: shape functions (q, a), volumes (m, q), m^3, and the density, kg/m^3.

    A varying density is multiplied into the volumes, and the returned density is then one. Shape functions are (m,
    q, a) if cells have different points.
    """
    from softmark.solvers.dynamics.mass_matrices import mass_shapes_and_volumes

    if isinstance(density, float | int):
        return *mass_shapes_and_volumes(mesh.points, mesh.cells, mesh.element), density
    N, w, X = density.points(mesh)
    return N, w * density.at(X), 1.0


def mass_matrix(mesh: Mesh, parts: IntegrationPoints, density: Any, mass: Distribution) -> Any:
    """Return the mass matrix, kg: sparse (3n, 3n) if it is consistent, else its diagonal (3n,)."""
    from softmark.solvers.dynamics.mass_matrices import consistent_mass, lumped_mass

    if mass == "uniform":
        return np.repeat(nodal_mass(mesh, parts, density, mass), 3)
    N, w, density = _mass_quadrature(mesh, density)
    form = consistent_mass if mass == "consistent" else lumped_mass
    return form(mesh.cells, N, w, density, len(mesh.points))
