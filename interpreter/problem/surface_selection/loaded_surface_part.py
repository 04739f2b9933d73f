"""Part of a mesh's surface on which a load acts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.problem.mesh_group_conditions import facet_membership, split_by_groups
from softmark.interpreter.problem.surface_selection.facet_deviation import deviations, settle_within_deviation
from softmark.interpreter.problem.surface_selection.facet_patches import (
    ConditionOnPatches,
    Floats,
    Ints,
    Mask,
    Out,
    Patches,
)
from softmark.interpreter.problem.surface_selection.selected_facets import Part, select_patches
from softmark.records import dataclass
from softmark.solvers.elements import moment_fitted_quadrature
from softmark.solvers.elements.boundary_facets import FACETS

if TYPE_CHECKING:
    from softmark.solvers.mesh.mesh import Mesh
    from softmark.solvers.mesh.shape import Shape

SAME = 1e-8  # relative to the extent: tolerance for a border that coincides with a side
SOME = 1000  # curved facets processed at a time
TOUCHED = 1e-6  # relative to the selection: smaller areas on faces of a slice are tolerances


@dataclass(frozen=True)
class LoadedSurface:
    """Selected surface of a mesh: whole facets (w, k), and quadrature points on partly selected facets.

    The points have nodes (p, k), local coordinates xi (p, 2) and weights (p,) in local area. `remainder` is the area,
    m^2, of which it is not known whether it is selected.
    """

    points: Floats  # (n, 3) of the mesh, m
    whole: Ints
    nodes: Ints
    xi: Floats
    w: Floats
    remainder: float
    leaning: float = 0.0  # m^2 of facets not cut because they represent a curved surface

    @property
    def empty(self) -> bool:
        """True if the selected area is zero."""
        return not (len(self.whole) or np.any(self.w > 0.0))

    @property
    def selected_facets(self) -> Ints:
        """Facets (f, k) with selected area; a partly selected facet appears once for each of its points."""
        return np.concatenate([self.whole, self.nodes[self.w > 0.0]])

    def add_load_forces(self, dead: Floats, push: Any, linear: bool, depth: float = 0.0) -> None:
        """Add the forces of a load to the nodal forces `dead` (n, 3), N.

        `push` maps area vectors to forces; `linear` states whether that map is linear. With a `depth`, m, the mesh is a
        slice of a body of revolution, and forces are those on whole rings.
        """
        nodes = self.whole.shape[1]
        facet, bent = FACETS[nodes], np.zeros(len(self.whole), dtype=np.bool_)
        if not linear:  # the area of a curved facet is no polynomial
            bent = ~Patches(self.points[self.whole], 1.0).affine
        self._add_forces_of_whole_facets(dead, push, self.whole[~bent], facet.quadrature(), depth)
        curved = self.whole[bent]
        for at in range(0, len(curved), SOME):
            self._add_forces_of_whole_facets(
                dead, push, curved[at : at + SOME], moment_fitted_quadrature.gauss_rule(nodes), depth
            )
        t = np.einsum("pkj,pki->jpi", facet.gradient(self.xi), self.points[self.nodes])
        forces = self.w[:, None] * push(np.cross(t[0], t[1]))
        if depth:
            forces *= _slices_per_ring((facet.shape(self.xi) * self.points[self.nodes, 0]).sum(axis=1), depth)[:, None]
        np.add.at(dead, self.nodes, facet.shape(self.xi)[:, :, None] * forces[:, None])

    def _add_forces_of_whole_facets(
        self, dead: Floats, push: Any, facets: Ints, rule: tuple[Floats, Floats], depth: float
    ) -> None:
        facet, (xi, weights) = FACETS[facets.shape[1]], rule
        t = np.einsum("qkj,fki->jfqi", facet.gradient(xi), self.points[facets])
        forces = push(np.cross(t[0], t[1]))
        if depth:
            forces = forces * _slices_per_ring(self.points[facets, 0] @ facet.shape(xi).T, depth)[:, :, None]
        np.add.at(dead, facets, np.einsum("q,qa,fqi->fai", weights, facet.shape(xi), forces, optimize=True))

    def shape_function_integrals(self) -> tuple[Ints, Floats]:
        """Return the nodes of the selected surface (k,), and the integrals of N_a N_b over it (k, k), m^2."""
        facet = FACETS[self.whole.shape[1]]
        nodes = np.unique(np.concatenate([self.whole, self.nodes]))
        found = np.zeros((len(nodes), len(nodes)))
        xi, w = moment_fitted_quadrature.gauss_rule(self.whole.shape[1])
        for at in range(0, len(self.whole), SOME):
            some = self.whole[at : at + SOME]
            t = np.einsum("qkj,fki->jfqi", facet.gradient(xi), self.points[some])
            dA, N = w * np.linalg.norm(np.cross(t[0], t[1]), axis=-1), facet.shape(xi)
            _add_facet_matrices(
                found, np.searchsorted(nodes, some), np.einsum("fq,qa,qb->fab", dA, N, N, optimize=True)
            )
        t = np.einsum("pkj,pki->jpi", facet.gradient(self.xi), self.points[self.nodes])
        dA, N = self.w * np.linalg.norm(np.cross(t[0], t[1]), axis=-1), facet.shape(self.xi)
        _add_facet_matrices(found, np.searchsorted(nodes, self.nodes), np.einsum("p,pa,pb->pab", dA, N, N))
        return nodes, found

    def of_facets(self, facets: Ints) -> LoadedSurface:
        """Return the selected surface restricted to some facets (f, k)."""
        keys = {tuple(row) for row in facets.tolist()}
        own, cut = (np.array([tuple(r) in keys for r in f.tolist()], dtype=bool) for f in (self.whole, self.nodes))
        return replace(self, whole=self.whole[own], nodes=self.nodes[cut], xi=self.xi[cut], w=self.w[cut])

    def over(self, facets: Ints) -> float:
        """Return the selected area, m^2, on some facets (f, k)."""
        return self.of_facets(facets).area

    @cached_property
    def area(self) -> float:
        """Selected area on the mesh, m^2."""
        return self.area_with_depth(0.0)

    def area_with_depth(self, depth: float) -> float:
        """Return the selected area, m^2; with a `depth`, m, that of whole rings of a body of revolution."""
        found = np.zeros_like(self.points)
        self.add_load_forces(
            found, lambda A: np.linalg.norm(A, axis=-1)[..., None] * np.array([1.0, 0.0, 0.0]), False, depth
        )
        return float(found[:, 0].sum())

    @property
    def facets_with_weights(self) -> tuple[Ints, Floats | None]:
        """Return the selected facets (f, k), and their weights (f, q) at `moments.places`; None if all are whole."""
        if not len(self.nodes):
            return self.whole, None
        k = self.whole.shape[1]
        faces, which = np.unique(self.nodes, axis=0, return_inverse=True)
        weights = np.zeros((len(faces), len(moment_fitted_quadrature.point_positions(k))))
        np.add.at(weights, which.ravel(), self.w[:, None] * moment_fitted_quadrature.basis_polynomials(k, self.xi))
        whole = np.tile(moment_fitted_quadrature.full_facet_weights(k), (len(self.whole), 1))
        return np.concatenate([self.whole, faces]), np.concatenate([whole, weights])


def _slices_per_ring(r: Floats, depth: float) -> Floats:
    from softmark.solvers.energies.axisymmetric import circumference_in_slices  # only imported for such bodies

    return circumference_in_slices(r, depth)


def _add_facet_matrices(found: Floats, rows: Ints, blocks: Floats) -> None:
    """Add matrices `blocks` (f, k, k) of facets to the matrix `found`, at rows and columns `rows` (f, k)."""
    np.add.at(found, (rows[:, :, None], rows[:, None, :]), blocks)


def find_loaded_surface(shape: Shape, mesh: Mesh, condition: Condition) -> LoadedSurface:
    """Return the part of a mesh's surface that a condition selects; computed once.

    Conditions apply to the exact body: facets of a curved side are evaluated on that side, and those of a mesh file
    within their deviation from the smooth surface.
    """
    known: LoadedSurface | None = mesh.selections.get(condition)
    if known is None:
        known = mesh.selections[condition] = (_loaded_groups if condition.groups else _select_facets)(
            shape, mesh, condition
        )
    return known


def _loaded_groups(shape: Shape, mesh: Mesh, condition: Condition) -> LoadedSurface:
    """Return the selected part of a mesh's surface for a condition with named facet groups."""
    found = [
        _select_facets(shape, mesh, own).of_facets(mesh.facets[which])
        for own, which in split_by_groups(condition, facet_membership(mesh))
    ]  # fmt: skip
    return LoadedSurface(
        mesh.points,
        np.concatenate([part.whole for part in found]),
        np.concatenate([part.nodes for part in found]),
        np.concatenate([part.xi for part in found]),
        np.concatenate([part.w for part in found]),
        sum(part.remainder for part in found),
        sum(part.leaning for part in found),
    )


def settled_borders(shape: Shape, mesh: Mesh, condition: Condition) -> tuple[Mask, Floats]:
    """Return which borders do not cut each facet of a mesh, as a mask (f, b), and their levels there (f, b).

    See `ConditionOnPatches`.
    """
    asked = ConditionOnPatches.of(condition, Patches(mesh.points[mesh.facets], mesh.extent))
    if not shape.sides:
        crossed = asked.crossed_facets()
        if len(crossed):
            asked = settle_within_deviation(asked, crossed, deviations(mesh))
        return asked.settled, asked.settling
    _decide_borders_on_sides(shape, condition, asked)
    return asked.settled, asked.settling


def _decide_borders_on_sides(shape: Shape, condition: Condition, asked: ConditionOnPatches) -> None:
    """Mark borders that coincide with a curved side as not cutting the flat facets next to that side.

    The part of such a facet beyond the side is a sliver between an arc and its chord, and not part of the body.
    """
    corners = asked.patches.corners
    parts = list(split_by_sides(shape, corners))
    flat = parts[-1][0]
    X, extent = corners[flat], asked.patches.extent
    for own, out in parts[:-1]:
        if out is None or not own.any():
            continue
        there = out(tuple(corners[own].reshape(-1, 3).T))
        for b, border in enumerate(condition.borders):
            if border.plane is None and np.abs(border.at(*there)).max() <= SAME * extent**border.power:
                levels = np.broadcast_to(border.at(*np.moveaxis(X, 2, 0)), X.shape[:2])
                asked.settled[flat, b] = True
                asked.settling[flat, b] = levels[np.arange(len(X)), np.abs(levels).argmax(axis=1)]


def split_by_sides(shape: Shape, corners: Floats) -> Iterator[tuple[Mask, Out | None]]:
    """Yield a mask of the flat facets, and of the facets of each curved side with the projection onto that side."""
    flat = np.ones(len(corners), dtype=np.bool_)
    for side in shape.sides:
        own = flat & side.of(corners)
        flat &= ~own
        yield own, side.project_points
    yield flat, None


def _remove_slivers(found: LoadedSurface) -> LoadedSurface:
    """Return the selected surface of a slice of a plane body, without slivers on the cut faces.

    Slivers are selected wrongly if the border of a condition runs along their side. They are kept if their area is
    not small compared to the selected edge.
    """
    z = found.points[:, 2]
    faces = np.ptp(z[found.nodes], axis=1) <= SAME * np.ptp(z)
    if not faces.any():
        return found
    edge = replace(found, nodes=found.nodes[~faces], xi=found.xi[~faces], w=found.w[~faces])
    return edge if found.area - edge.area <= TOUCHED * edge.area else found


def _select_facets(shape: Shape, mesh: Mesh, condition: Condition) -> LoadedSurface:
    facets, corners = mesh.facets, mesh.points[mesh.facets]
    mask, values = settled_borders(shape, mesh, condition)
    found: list[tuple[Ints, Part]] = []
    for which, out in split_by_sides(shape, corners):
        if which.any():
            asked = ConditionOnPatches(condition, Patches(corners[which], mesh.extent, out), mask[which], values[which])
            found.append((facets[which], select_patches(asked)))
    leaning = np.flatnonzero(mask.any(axis=1)) if not shape.sides else ()
    whole = LoadedSurface(
        mesh.points,
        np.concatenate([own[p.whole] for own, p in found]),
        np.concatenate([own[p.f] for own, p in found]),
        np.concatenate([p.xi for _, p in found]),
        np.concatenate([p.w for _, p in found]),
        sum(p.remainder for _, p in found),
    )
    whole = _remove_slivers(whole) if shape.flat else whole
    return replace(whole, leaning=whole.over(facets[leaning])) if len(leaning) else whole
