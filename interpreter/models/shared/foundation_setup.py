"""Supports by springs, created from the scene on facets of a mesh."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.models.shared.loaded_surface import surface_of
from softmark.interpreter.problem.body_case import fault
from softmark.interpreter.problem.surface_selection.facet_patches import Patches
from softmark.interpreter.problem.symmetry_planes import must_not_act_on_axis, must_not_act_on_plane
from softmark.records import dataclass
from softmark.solvers.elements import moment_fitted_quadrature
from softmark.solvers.elements.boundary_facets import FACETS
from softmark.solvers.energies.elastic_foundation import ElasticFoundation
from softmark.solvers.energies.energy import Floats, Ints

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.language.coordinate_conditions import Condition
    from softmark.interpreter.problem.body_case import Case
    from softmark.interpreter.problem.surface_selection.loaded_surface_part import LoadedSurface
    from softmark.solvers.mesh.mesh import Mesh

SOME = 1000  # number of points processed at a time
PLANE = 1e-6  # largest deviation of the normals of a plane face from their mean
RIGID = 1e6  # stiffness of the springs that keep a plate plane, relative to the body
MOST = 2000  # largest number of nodes of one plate: their full matrix takes 32 MB
EXACT, FINE = 4, 10  # squared: Gauss points on flat facets, where products of shape functions are of fourth order


def create_foundations(case: Case, mesh: Mesh) -> dict[str, ElasticFoundation]:
    """Return the springs and dashpots of every support by springs, by name. Raises Fault if one has no area."""
    return {bed.name: bed.thing.springs(SurfaceSprings(case, bed, mesh)) for bed in case.beds}


def constraint_rows(case: Case, mesh: Mesh, centre: Floats) -> Iterator[tuple[Ints, Floats]]:
    """Yield, for each foundation, the rigid motions about `centre` that it resists: nodes (r,) and rows (r, 6).

    A rigid motion (translation and rotation, 6 numbers) is resisted if its product with a row is nonzero. Rows contain
    lengths but no stiffnesses. The nodes show to which piece of the body each row belongs.
    """
    for bed in case.beds:
        facets, N, _, normal = _quadrature_points(surface_of(case, bed, bed.thing.where, mesh))
        X = np.einsum("pa,pai->pi", N, mesh.points[facets]) - centre
        rows = bed.thing.resisted_motions(X, normal)
        yield np.repeat(facets[:, 0], rows.shape[1]), rows.reshape(-1, 6)


@dataclass(frozen=True)
class SurfaceSprings:
    """Operations by which a support acts on the surface of a mesh (vocabulary/supports/spring_support.py)."""

    case: Case
    support: Declared
    mesh: Mesh

    def distributed_springs(
        self, where: Condition, stiffness: float, damping: float, normal: bool
    ) -> ElasticFoundation:
        """Return springs, Pa/m, and dashpots, Pa s/m, integrated over facets, or the selected part of each facet.

        With `normal` they act along the undeformed normal only. Raises Fault if they lie on a plane of symmetry.
        """
        case, mesh = self.case, self.mesh
        surface = surface_of(case, self.support, where, mesh)
        X = mesh.points[surface.selected_facets]
        must_not_act_on_plane(case, self.support, X, mesh.points)
        must_not_act_on_axis(case, self.support, X, mesh.points)
        facets, N, dA, n = _quadrature_points(surface, case.depth)
        each, which = np.unique(facets, axis=0, return_inverse=True)
        k = 3 * facets.shape[1]
        K = np.zeros((len(each), k, k))
        for at in range(0, len(facets), SOME):
            some = slice(at, at + SOME)
            D = n[some, :, None] * n[some, None, :] if normal else np.eye(3) + np.zeros((len(n[some]), 1, 1))
            blocks = np.einsum("p,pa,pb,pij->paibj", stiffness * dA[some], N[some], N[some], D, optimize=True)
            np.add.at(K, which.ravel()[some], blocks.reshape(-1, k, k))
        return ElasticFoundation(each, K, damping / stiffness)

    def plane_keeping_springs(self, where: Condition) -> ElasticFoundation:
        """Return springs that keep a face plane: they connect each point of the face to the mean of all its points.

        The springs couple all nodes of the face in one dense block. Raises Fault.
        """
        case, plate, mesh = self.case, self.support, self.mesh
        facets, N, dA, normal = _quadrature_points(surface_of(case, plate, where, mesh), case.depth)
        along = int(np.abs(normal.sum(axis=0)).argmax())
        uneven = float(np.abs(normal[:, along].mean() - normal[:, along]).max())
        if uneven > PLANE or abs(normal[0, along]) < 1.0 - PLANE:
            raise fault(
                "E411",
                plate.at("where"),
                f"`{plate.name}` selects no face of `{case.body.name}` that is normal to x, y or z",
                "no such plane face",
                "select one plane face of the body, and orient the scene so that it is normal to x, y or z",
            )
        nodes, place = np.unique(facets, return_inverse=True)
        place = place.reshape(facets.shape)
        if len(nodes) > MOST:
            problem = f"`{plate.name}` couples {len(nodes)} nodes, each with all others"
            help = "use a larger size, or a plane or revolved body"
            raise fault("E412", plate.at("where"), problem, f"more than {MOST} nodes", help)
        M = np.zeros((len(nodes), len(nodes)))
        np.add.at(M, (place[:, :, None], place[:, None, :]), np.einsum("p,pa,pb->pab", dA, N, N, optimize=True))
        m, area = M.sum(axis=1), float(dA.sum())
        M -= np.outer(m, m) / area
        return ElasticFoundation(nodes[None], plate_stiffness(case, mesh, area) * M[None], along=along)


def plate_stiffness(case: Case, mesh: Mesh, area: float) -> float:
    """Return the stiffness per area, Pa/m, of the springs that keep a plate of the given `area`, m^2, plane.

    It follows from the stiffness and height of the body behind the plate; verification uses the same number.
    """
    modulus = float(max(material.shear_modulus for material in case.typical))
    volume = float(mesh.volumes.sum())
    if case.depth:  # all around
        middle = mesh.points[mesh.cells].mean(axis=1)[:, 0]
        volume = float((mesh.volumes * 2.0 * np.pi * middle).sum()) / case.depth
    return RIGID * modulus * area / volume


def _quadrature_points(part: LoadedSurface, depth: float = 0.0) -> tuple[Ints, Floats, Floats, Floats]:
    """Return the quadrature points of a loaded surface: their facets, shape functions, areas and normals.

    Shapes are (p, k), (p, k), (p,), m^2, and (p, 3). Facets are given by their node indices. For a body of
    revolution `depth`, m, is the depth of its slice; areas are then those of whole rings.
    """
    flat = Patches(part.points[part.whole], 1.0).affine
    each = [(part.nodes, part.xi, part.w)]
    for whole, n in ((part.whole[flat], EXACT), (part.whole[~flat], FINE)):  # of curved ones no polynomial
        xi, w = moment_fitted_quadrature.gauss_rule(whole.shape[1], n)
        each.append((np.repeat(whole, len(w), axis=0), np.tile(xi, (len(whole), 1)), np.tile(w, len(whole))))
    facets, places, weights = (np.concatenate(columns) for columns in zip(*each, strict=True))
    facet = FACETS[facets.shape[1]]
    N = facet.shape(places)
    t = np.einsum("pkj,pki->jpi", facet.gradient(places), part.points[facets])
    way = np.cross(t[0], t[1])
    size = np.linalg.norm(way, axis=1)
    dA = weights * size
    if depth:
        from softmark.solvers.energies.axisymmetric import circumference_in_slices

        dA = dA * circumference_in_slices((N * part.points[facets, 0]).sum(axis=1), depth)
    return facets, N, dA, way / size[:, None]
