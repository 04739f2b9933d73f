"""Loads on a solid, as energies or follower forces of `solvers.energies`."""

from __future__ import annotations

import numpy as np

from softmark.solvers.api.elastic_solid import Solid
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.external_loads import DeadForces, FollowerPressure

Vector = tuple[float, float, float]


def gravity(solid: Solid, acceleration: Vector) -> DeadForces:
    """Return the weight of a solid under an acceleration (3,), m/s^2: (0, 0, -9.81) on earth. Raises ValueError."""
    g = _vector(acceleration, "an acceleration")
    return DeadForces(solid.mass() @ np.tile(g, len(solid.points)))


def traction(solid: Solid, stress: Vector, facets: Ints) -> DeadForces:
    """Return a force per undeformed area (3,), Pa, on facets (f, k) of `Solid.facets`; it keeps its direction."""
    areas = _areas(solid, facets)
    t = _vector(stress, "a traction")
    return _nodal_forces(solid, facets, np.linalg.norm(areas, axis=-1)[..., None] * t)


def pressure(solid: Solid, size: float, facets: Ints) -> DeadForces | FollowerPressure:
    """Return a pressure in Pa on facets (f, k) of `Solid.facets`, inward; a negative one pulls.

    It stays normal to the surface as that moves; with small strain it acts on the undeformed surface.
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
    """Return weighted area vectors at the integration points of facets (f, q, 3), m^2. Raises ValueError."""
    facet, facets = solid.mesh.element.facet, np.asarray(facets)
    width = facet.nodes
    if facets.ndim != 2 or facets.shape[1] != width or not len(facets):
        raise ValueError(f"facets of {solid.mesh.kind} must be node numbers (f, {width}), not {facets.shape}")
    xi, w = facet.quadrature()
    first, second = np.einsum("qkj,fki->jfqi", facet.gradient(xi), solid.points[facets])
    found: Floats = w[:, None] * np.cross(first, second)
    return found


def _nodal_forces(solid: Solid, facets: Ints, forces: Floats) -> DeadForces:
    """Return nodal forces of forces at the integration points of facets (f, q, 3), N."""
    facet = solid.mesh.element.facet
    f = np.zeros_like(solid.points)
    np.add.at(f, facets, np.einsum("qk,fqi->fki", facet.shape(facet.quadrature()[0]), forces))
    return DeadForces(f.ravel())
