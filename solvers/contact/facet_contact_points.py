"""Contact points inside facets: a lattice with as many steps per side as the rigid body needs.

Facets of eight nodes need a point in the middle. A uniform pressure pulls at their corners, which nodes with only
compressive forces cannot provide: they lose contact, and the body is softer by 1 to 1.5 % on any mesh (for the sphere
in tests/shared/indented_cylinder.py). With the middle point nodal forces may have either sign, as those of quadratic
elements do.

Rigid bodies that are sharper than the facets they touch enter between nodes: a finer lattice limits their depth to
less than the distance of its points.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from softmark.solvers.contact.contact_surface import subdivide_facet
from softmark.solvers.contact.facet_penetration import SearchedFacets
from softmark.solvers.contact.rigid_contact import RigidContact, corner_areas, node_areas
from softmark.solvers.contact.surface_points import SAME
from softmark.solvers.elements.boundary_facets import FACETS
from softmark.solvers.energies.energy import Floats, Ints

MOST = 4  # parts between two nodes: what is sharper is met as if it were as blunt as that


def add_points_inside_facets(
    touching: RigidContact, points: Floats, facets: Ints, steps: int, depth: float = 0.0, still: Any = None
) -> RigidContact:
    """Return the same contact with points on a lattice of `steps` steps along each side of `facets` (f, a) of its
    surface.

    Points whose nodes are all fixed, as marked by `still` (nodes,), are left out.
    """
    kind = facets.shape[1]
    xi, parts = subdivide_facet(kind, steps)
    N = FACETS[kind].shape(xi)
    marks = np.random.default_rng(0).random((len(points), 2))  # two numbers that tell any point by its shares
    mark = np.einsum("la,fam->flm", N, marks[facets]).reshape(-1, 2)
    keys = np.round(mark / SAME).astype(np.int64)
    _, first, which = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    of, shares = facets[first // len(xi)], N[first % len(xi)]
    at_rest = np.einsum("pa,pai->pi", shares, points[of])
    split = which.reshape(len(facets), -1)[:, parts].reshape(-1, 3)
    _, areas = node_areas(at_rest, split, ((0, 1, 2),), depth)
    own = np.ones(len(of), dtype=np.bool_) if still is None else ((np.abs(shares) > SAME) & ~still[of]).any(axis=1)
    return replace(touching, A=areas[own], of=of[own], shares=shares[own], at_rest=at_rest[own])


def select_penetrating_facets(
    points: Floats, facets: Ints, steps: int, flat: bool = False, depth: float = 0.0
) -> SearchedFacets:
    """Return facets (f, a) that may penetrate between points of such a lattice; added points have the same area."""
    kind: Any = FACETS[facets.shape[1]]
    split = facets[:, np.array(kind.triangles)].reshape(-1, 3)
    area = corner_areas(points, split, depth).reshape(len(facets), -1).sum(axis=1)
    return SearchedFacets(facets, points[facets], area / max(kind.nodes, len(kind.lattice(max(steps, 1)))), flat)
