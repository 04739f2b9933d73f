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
from softmark.interpreter.problem.symmetry_planes import must_not_act_on_axis, must_not_act_on_plane, must_not_turn_half
from softmark.interpreter.vocabulary.load_words import (
    BodyForce,
    LineForce,
    MomentLoad,
    PointLoad,
    PressureLoad,
    RemoteStress,
    SurfaceTraction,
    Vector3,
)
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.external_loads import DeadForces, FaceMoment, FollowerPressure
from softmark.solvers.mesh.element_interpolation import Integration, locate_points
from softmark.solvers.mesh.mesh import Mesh

MOST_NODES = 1500  # that a moment is put on: its tangent has an entry for every pair, 0.2 GB of them
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
    case: Case, mesh: Mesh, parts: Integration, small: bool, mass: Distribution = "consistent"
) -> list[tuple[Declared, Energy]]:
    """Return the energy of each load separately, at full size. Raises Fault.

    If `small`, pressure acts on the undeformed surface.
    """
    return [(load, _load(case, load, mesh, parts, small, mass)) for load in case.loads]


def _load(case: Case, load: Declared, mesh: Mesh, parts: Integration, small: bool, mass: Distribution) -> Energy:
    """Return the energy of one load at full size. Raises Fault."""
    dead = np.zeros((len(mesh.points), 3))
    match load.thing.action:
        case BodyForce(acceleration=g):
            for own in regions_by_material(case, mesh, parts):
                weights = nodal_mass(own.mesh, own.parts, own.density, mass, case.depth)
                dead += weights[:, None] * np.array(g)
        case SurfaceTraction(where=where, traction=traction):
            t = np.array(traction)
            surface = _loaded_surface(case, load, where, mesh)
            surface.spread(dead, lambda A: np.linalg.norm(A, axis=-1)[..., None] * t, False, case.depth)
        case RemoteStress(where=where) as pull:
            sigma = np.array(pull.tensor)
            _loaded_surface(case, load, where, mesh).spread(dead, lambda A: A @ sigma, True, case.depth)
        case PressureLoad(where=where, pressure=p) if small:
            _loaded_surface(case, load, where, mesh).spread(dead, lambda A: -p * A, True, case.depth)
        case PressureLoad(where=where, pressure=p):
            facets, of_parts = _loaded_surface(case, load, where, mesh).weighted
            if case.depth:
                from softmark.solvers.energies.axisymmetric import AxisymmetricPressure

                return AxisymmetricPressure(mesh.points, facets, p, of_parts, depth=case.depth)
            return FollowerPressure(mesh.points, facets, p, of_parts)
        case MomentLoad(where=where, moment=moment):
            turning = _surface_moment(case, load, where, np.array(moment), mesh)
            if not small:
                return turning
            dead = nodal_forces_at_rest(turning, mesh.points)
        case PointLoad(at=at, force=force):
            _add_point_force(dead, case, load, at, force, mesh)
        case LineForce():
            _add_line_force(dead, case, load, mesh)
        case unknown:  # refused when a scene is checked
            raise TypeError(f"solids do not support loads of the type {type(unknown).__name__}")
    return DeadForces(dead.ravel())


def _surface_moment(case: Case, load: Declared, where: Condition, moment: Floats, mesh: Mesh) -> FaceMoment:
    """Return the energy of a moment, N m, that acts on a part of the surface.

    Its tangent couples all nodes of that part; raises Fault if these are too many.
    """
    surface = _loaded_surface(case, load, where, mesh)
    if (count := len(np.unique(np.concatenate([surface.whole, surface.nodes])))) > MOST_NODES:
        raise fault(
            "E520",
            load.at("where"),
            f"`{load.name}` acts on {count} nodes of the mesh of `{case.body.name}`, each coupled to all others",
            f"at most {MOST_NODES}",
            "use a coarser mesh, a smaller part of the face, or `rotated(...)`, which imposes the angle instead",
        )
    nodes, products = surface.products()
    return FaceMoment(mesh.points, nodes, products, moment)


def nodal_mass(mesh: Mesh, parts: Integration, density: Any, mass: Distribution, depth: float = 0.0) -> Floats:
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
    N, w, density = _mass_quadrature(mesh, density)  # as the mass matrix has them: g is g at every node
    if depth:
        from softmark.solvers.energies.axisymmetric import circumference_in_slices

        w = w * circumference_in_slices((N @ mesh.points[mesh.cells, 0][:, :, None])[:, :, 0], depth)
    carried = np.zeros(len(mesh.points))
    np.add.at(carried, mesh.cells, density * w @ N if N.ndim == 2 else density * np.einsum("mq,mqa->ma", w, N))
    return carried


def _mass_quadrature(mesh: Mesh, density: Any) -> tuple[Floats, Floats, float]:
    """Return the quadrature of mass integrals: shape functions (q, a), volumes (m, q), m^3, and the density, kg/m^3.

    A varying density is multiplied into the volumes, and the returned density is then one. Shape functions are (m,
    q, a) if cells have different points.
    """
    from softmark.solvers.dynamics.mass_matrices import mass_points

    if isinstance(density, float | int):
        return *mass_points(mesh.points, mesh.cells, mesh.element), density
    N, w, X = density.points(mesh)
    return N, w * density.at(X), 1.0


def mass_matrix(mesh: Mesh, parts: Integration, density: Any, mass: Distribution) -> Any:
    """Return the mass matrix, kg: sparse (3n, 3n) if it is consistent, else its diagonal (3n,)."""
    from softmark.solvers.dynamics.mass_matrices import consistent_mass, lumped_mass

    if mass == "uniform":
        return np.repeat(nodal_mass(mesh, parts, density, mass), 3)
    N, w, density = _mass_quadrature(mesh, density)
    form = consistent_mass if mass == "consistent" else lumped_mass
    return form(mesh.cells, N, w, density, len(mesh.points))


def _add_point_force(dead: Floats, case: Case, load: Declared, at: Vector3, force: Vector3, mesh: Mesh) -> None:
    """Add a point force, N, at a point to the nodal forces `dead` (n, 3), N, in place. Raises Fault."""
    place = locate_points(mesh, np.array([at]))
    if case.shape.file and place.outside[0] > 0:
        away = units.format_value(float(place.outside[0]), units.LENGTH)
        raise fault(
            "E504",
            load.at("at"),
            f"`{load.name}` acts at a point about {away} outside `{case.body.name}`",
            "outside the body",
            "write coordinates of the undeformed body",
        )
    if case.planar:  # spread along z, exactly for what elements have there: all z move as one
        half = 0.5 * case.body.thing.thickness / np.sqrt(3.0)
        place = locate_points(mesh, np.array([(*at[:2], -half), (*at[:2], half)]))
    np.add.at(dead, place.nodes, place.N[:, :, None] * (np.array(force) / len(place.nodes)))


def _add_line_force(dead: Floats, case: Case, load: Declared, mesh: Mesh) -> None:
    """Add a force per length along a line to the nodal forces `dead`, cell by cell.

    Raises Fault where the line leaves the body.
    """
    from softmark.solvers.mesh.mesh_line import integrate_along

    line: LineForce = load.thing.action
    X, w = integrate_along(mesh, np.array(line.begin), np.array(line.end))
    place = locate_points(mesh, X)
    if case.shape.file and (away := float(place.outside.max())) > 0.0:
        raise fault(
            "E504",
            load.at("from"),
            f"`{load.name}` extends up to {units.format_value(away, units.LENGTH)} outside `{case.body.name}`",
            "outside the body",
            "write end points with no gap of the undeformed body between them",
        )
    np.add.at(dead, place.nodes, (w[:, None] * place.N)[:, :, None] * np.array(line.force))


def _loaded_surface(case: Case, load: Declared, where: Condition, mesh: Mesh) -> LoadedSurface:
    """Return the surface of a load. Raises Fault if it is empty or incompatible with planes of symmetry."""
    found = surface_of(case, load, where, mesh)
    must_not_act_on_axis(case, load, mesh.points[found.touched], mesh.points)
    if isinstance(load.thing.action, SurfaceTraction | RemoteStress):  # of a pressure, the plane's support takes all
        must_not_act_on_plane(case, load, mesh.points[found.touched], mesh.points)
    if isinstance(load.thing.action, MomentLoad):
        must_not_turn_half(case, load, mesh.points[np.concatenate([found.whole, found.nodes])], mesh.points)
    return found
