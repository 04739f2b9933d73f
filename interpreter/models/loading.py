"""Loads on solid meshes: from what a scene says to nodal forces and follower pressures."""

from __future__ import annotations

import numpy as np

from softmark.interpreter import units
from softmark.interpreter.case import Case, fault
from softmark.interpreter.scene import Declared
from softmark.interpreter.vocabulary.loads import Gravity, PointForce, Pressure, Traction
from softmark.solvers.elements.interpolation import Integration, locate
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.energies.loads import DeadForces, FollowerPressure
from softmark.solvers.mesh.mesh import Mesh

FINENESS = 8  # a surface triangle is sampled at the centroids of FINENESS^2 parts of equal area


def solid_loads(case: Case, mesh: Mesh, parts: Integration, small: bool) -> list[Energy]:
    """All loads of a case on a mesh. `small`: pressure acts on the undeformed surface. Raises Fault."""
    dead = np.zeros((len(mesh.points), 3))
    followers: list[Energy] = []
    for load in case.loads:
        match load.thing:
            case Gravity(magnitude=magnitude, direction=direction):
                shares = case.material.density * parts.w @ parts.N  # (m, a) kg on each node of each cell
                np.add.at(dead, mesh.cells, shares[:, :, None] * (magnitude * np.array(direction)))
            case Traction(vector=vector):
                faces, share = _faces(case, load, mesh)
                areas = np.linalg.norm(_area_vectors(mesh, faces), axis=1)
                _spread(dead, faces, (share * areas)[:, None] * np.array(vector))
            case Pressure(magnitude=p) if small:
                faces, share = _faces(case, load, mesh)
                _spread(dead, faces, -p * share[:, None] * _area_vectors(mesh, faces))
            case Pressure(magnitude=p):
                faces, share = _faces(case, load, mesh)
                followers.append(FollowerPressure(mesh.points, faces, p * share))
            case PointForce():
                _point_force(dead, case, load, mesh)
            case _:
                raise fault("E501", load.location, f"no solid model knows the load `{load.name}`")
    return [DeadForces(dead.ravel()), *followers]


def _spread(dead: Floats, faces: Ints, forces: Floats) -> None:
    """A third of each face's force (f, 3) to each of its corners."""
    np.add.at(dead, faces, np.broadcast_to(forces[:, None] / 3, (len(faces), 3, 3)))


def _point_force(dead: Floats, case: Case, load: Declared, mesh: Mesh) -> None:
    place = locate(mesh, np.array([load.thing.at]))
    if getattr(case.shape, "prebuilt", False) and place.outside[0] > 0:
        away = units.show(float(place.outside[0]), units.LENGTH)
        raise fault(
            "E504",
            load.at("at"),
            f"`{load.name}` acts at a point about {away} outside `{case.body.name}`",
            "not in the body",
            "give coordinates of the undeformed body",
        )
    np.add.at(dead, place.nodes[0], place.N[0][:, None] * np.array(load.thing.vector))


def _faces(case: Case, load: Declared, mesh: Mesh) -> tuple[Ints, Floats]:
    """Boundary triangles that a condition selects, and the part of each that it does (f,). Raises Fault.

    A triangle across the border of the selection counts by its part inside: the resultant does not jump with the mesh.
    """
    corners = mesh.points[mesh.faces]  # (f, 3, 3)
    x, y, z = np.einsum("sc,fcx->xfs", _samples(), corners)
    share: Floats = np.broadcast_to(load.thing.where.holds(x, y, z, mesh.extent), x.shape).mean(axis=1)
    chosen = share > 0
    if not chosen.any():
        raise fault(
            "E302",
            load.at("where"),
            f"`{load.name}` selects no part of the surface of `{case.body.name}`",
            "selects nothing",
            "the condition must hold on a part of the surface that has an area",
        )
    return mesh.faces[chosen], share[chosen]


def _samples() -> Floats:
    """Barycentric coordinates (FINENESS^2, 3) of the centroids of equal parts of a triangle."""
    n = FINENESS
    up = [(3 * i + 1, 3 * j + 1) for i in range(n) for j in range(n - i)]
    down = [(3 * i + 2, 3 * j + 2) for i in range(n - 1) for j in range(n - 1 - i)]
    first = np.array([*up, *down]) / (3 * n)
    return np.concatenate([first, 1 - first.sum(axis=1, keepdims=True)], axis=1)


def _area_vectors(mesh: Mesh, faces: Ints) -> Floats:
    """Outward normals times areas (f, 3), m^2."""
    a, b, c = (mesh.points[faces[:, i]] for i in range(3))
    vectors: Floats = 0.5 * np.cross(b - a, c - a)
    return vectors
