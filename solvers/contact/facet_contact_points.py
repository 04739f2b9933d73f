"""Contact points inside facets: a lattice with as many steps per side as the rigid body needs.

Facets of eight nodes need a contact point in the middle. A uniform pressure on such a facet corresponds to tensile
forces at its corners, which contact at the corner nodes cannot provide. Without the middle point the corners lose
contact, and the body is too soft by 1 to 1.5 % on any mesh (for the sphere in tests/shared/indented_cylinder.py). The
middle point distributes its force by shape functions, so that nodal forces may have either sign, as in quadratic
elements.

Rigid bodies that are sharper than the facets they touch penetrate between nodes. A finer lattice limits the depth of
penetration to less than the spacing of its points.
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

MOST = 4  # largest number of steps between two nodes: sharper bodies are treated as if they were blunter


def add_points_inside_facets(
    touching: RigidContact, points: Floats, facets: Ints, steps: int, depth: float = 0.0, still: Any = None
) -> RigidContact:
    """Return the same contact with more points: a lattice of `steps` steps along each side of facets (f, a).

    `points` (n, 3), m, are the nodes at rest. For an axisymmetric model `depth` is the thickness of the slice, m.
    Points whose nodes are all fixed, as marked by `still` (nodes,), are left out.
    """
    kind = facets.shape[1]
    xi, parts = subdivide_facet(kind, steps)
    N = FACETS[kind].shape(xi)
    marks = np.random.default_rng(0).random(
        (len(points), 2)
    )  # two random numbers per node identify a point by its weights
    mark = np.einsum("la,fam->flm", N, marks[facets]).reshape(-1, 2)
    keys = np.round(mark / SAME).astype(np.int64)
    _, first, which = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    of, shares = facets[first // len(xi)], N[first % len(xi)]
    at_rest = np.einsum("pa,pai->pi", shares, points[of])
    split = which.reshape(len(facets), -1)[:, parts].reshape(-1, 3)
    _, areas = node_areas(at_rest, split, ((0, 1, 2),), depth)
    own = np.ones(len(of), dtype=np.bool_) if still is None else ((np.abs(shares) > SAME) & ~still[of]).any(axis=1)
    return replace(touching, A=areas[own], of=of[own], shares=shares[own], at_rest=at_rest[own])


def make_searched_facets(
    points: Floats, facets: Ints, steps: int, flat: bool = False, depth: float = 0.0
) -> SearchedFacets:
    """Return the facets (f, a) to search for penetration between the points of a lattice with `steps` steps.

    `points` (n, 3), m, are the nodes at rest; `flat` is true for a slice, and `depth`, m, its thickness in an
    axisymmetric model. A point added to a facet later has the area of one lattice point.
    """
    kind: Any = FACETS[facets.shape[1]]
    split = facets[:, np.array(kind.triangles)].reshape(-1, 3)
    area = corner_areas(points, split, depth).reshape(len(facets), -1).sum(axis=1)
    return SearchedFacets(facets, points[facets], area / max(kind.nodes, len(kind.lattice(max(steps, 1)))), flat)
