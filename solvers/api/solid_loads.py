"""Loads on a solid, as energies or follower forces of `solvers.energies`."""

from __future__ import annotations

import numpy as np

from softmark.solvers.api.elastic_solid import Solid
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.external_loads import DeadForces, FollowerPressure

Vector = tuple[float, float, float]


def gravity(solid: Solid, acceleration: Vector) -> DeadForces:
    """Return the weight of a solid under an acceleration (3,), m/s^2, such as (0, 0, -9.81) on earth.

    Raises ValueError if the acceleration is not three finite numbers.
    """
    g = _vector(acceleration, "an acceleration")
    return DeadForces(solid.mass() @ np.tile(g, len(solid.points)))


def traction(solid: Solid, stress: Vector, facets: Ints) -> DeadForces:
    """Return the load of a stress vector (3,), Pa, with constant direction, on facets (f, k) from `Solid.facets`.

    It is a force per undeformed area. Raises ValueError.
    """
    areas = _areas(solid, facets)
    t = _vector(stress, "a traction")
    return _nodal_forces(solid, facets, np.linalg.norm(areas, axis=-1)[..., None] * t)


def pressure(solid: Solid, size: float, facets: Ints) -> DeadForces | FollowerPressure:
    """Return the load of a pressure `size`, Pa, on facets (f, k) from `Solid.facets`.

    A positive pressure pushes inward. It stays normal to the deforming surface; with small strain it acts on the
    undeformed surface. Raises ValueError.
    """
    if not np.isfinite(size):
        raise ValueError(f"a pressure must be finite, not {size}")
    areas = _areas(solid, facets)
    if solid.strain == "small":
        return _nodal_forces(solid, facets, -size * areas)
    return FollowerPressure(solid.points, facets, size)


def _vector(given: Vector, what: str) -> Floats:
    found = np.array(given, dtype=np.float64)
    if found.shape != (3,) or not np.isfinite(found).all():
        raise ValueError(f"{what} must be three finite numbers, not {given}")
    return found


def _areas(solid: Solid, facets: Ints) -> Floats:
    """Return the area vectors (f, q, 3), m^2, at the q integration points of each facet, times their weights.

    Raises ValueError for an array that does not list facets of the mesh.
    """
    facet, facets = solid.mesh.element.facet, np.asarray(facets)
    width = facet.nodes
    if facets.ndim != 2 or facets.shape[1] != width or not len(facets):
        raise ValueError(f"facets of {solid.mesh.kind} must be node numbers (f, {width}), not {facets.shape}")
    xi, w = facet.quadrature()
    first, second = np.einsum("qkj,fki->jfqi", facet.gradient(xi), solid.points[facets])
    found: Floats = w[:, None] * np.cross(first, second)
    return found


def _nodal_forces(solid: Solid, facets: Ints, forces: Floats) -> DeadForces:
    """Return the nodal forces that are equivalent to forces (f, q, 3), N, at the integration points of facets."""
    facet = solid.mesh.element.facet
    f = np.zeros_like(solid.points)
    np.add.at(f, facets, np.einsum("qk,fqi->fki", facet.shape(facet.quadrature()[0]), forces))
    return DeadForces(f.ravel())
