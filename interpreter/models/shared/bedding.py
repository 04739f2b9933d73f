"""Beds that a body lies on: from what a scene says to springs and dashpots on the facets of a mesh."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.models.shared.surfaces import surface_of
from softmark.interpreter.problem.parts.patches import Patches
from softmark.solvers.elements import moments
from softmark.solvers.elements.facets import FACETS
from softmark.solvers.energies.bedding import Bedding
from softmark.solvers.energies.energy import Floats, Ints

if TYPE_CHECKING:
    from softmark.interpreter.language.scene import Declared
    from softmark.interpreter.problem.case import Case
    from softmark.interpreter.problem.parts.surface import Loaded
    from softmark.solvers.mesh.mesh import Mesh

SOME = 1000  # points at a time
EXACT, FINE = 4, 10  # squared: Gauss points on flat facets, where products of shape functions are of fourth order


def beds_on(case: Case, mesh: Mesh) -> dict[str, Bedding]:
    """The springs and dashpots of every bed, by name. Raises Fault where a bed has no area."""
    return {bed.name: _spread(case, bed, mesh) for bed in case.beds}


def rows(case: Case, mesh: Mesh, centre: Floats) -> Iterator[Floats]:
    """What beds see of rigid motions about a centre (r, 6), as `holding` has them: no unit but of lengths."""
    from softmark.interpreter.models.beam.rigid import point_rows

    for bed in case.beds:
        facets, xi, _, normal = _points(surface_of(case, bed, bed.thing.where, mesh))
        X = np.einsum("pa,pai->pi", FACETS[facets.shape[1]].shape(xi), mesh.points[facets]) - centre
        if bed.thing.directions == "all":
            yield point_rows(X, (0, 1, 2))
        else:
            yield np.hstack([normal, np.cross(X, normal)])


def _spread(case: Case, bed: Declared, mesh: Mesh) -> Bedding:
    """Integrals over each facet, of its whole or of the selected part."""
    facets, xi, dA, normal = _points(surface_of(case, bed, bed.thing.where, mesh))
    N = FACETS[facets.shape[1]].shape(xi)
    if case.depth:
        from softmark.solvers.energies.revolved import around

        dA = dA * around((N * mesh.points[facets, 0]).sum(axis=1), case.depth)
    each, which = np.unique(facets, axis=0, return_inverse=True)
    k = 3 * facets.shape[1]
    K = np.zeros((len(each), k, k))
    for at in range(0, len(facets), SOME):
        some = slice(at, at + SOME)
        n = normal[some]
        D = n[:, :, None] * n[:, None, :] if bed.thing.directions == "normal" else np.eye(3) + np.zeros((len(n), 1, 1))
        blocks = np.einsum("p,pa,pb,pij->paibj", bed.thing.stiffness * dA[some], N[some], N[some], D, optimize=True)
        np.add.at(K, which.ravel()[some], blocks.reshape(-1, k, k))
    damping: float = bed.thing.damping
    return Bedding(each, K, damping / bed.thing.stiffness)


def _points(part: Loaded) -> tuple[Ints, Floats, Floats, Floats]:
    """Points to integrate at: their facets (p, k), local places (p, 2), areas (p,), m^2, and unit normals (p, 3)."""
    flat = Patches(part.points[part.whole], 1.0).affine
    each = [(part.nodes, part.xi, part.w)]
    for whole, n in ((part.whole[flat], EXACT), (part.whole[~flat], FINE)):  # of curved ones no polynomial
        xi, w = moments.fine(whole.shape[1], n)
        each.append((np.repeat(whole, len(w), axis=0), np.tile(xi, (len(whole), 1)), np.tile(w, len(whole))))
    facets, places, weights = (np.concatenate(columns) for columns in zip(*each, strict=True))
    t = np.einsum("pkj,pki->jpi", FACETS[facets.shape[1]].gradient(places), part.points[facets])
    dA = np.cross(t[0], t[1])
    size = np.linalg.norm(dA, axis=1)
    return facets, places, weights * size, dA / size[:, None]
