"""Deviation of flat or quadratic facets from the smooth surface that they represent, and its effect on selections.

A mesh file gives points of a curved surface and nothing between them: facets of a sphere lie inside it, or bulge out of
it. A border along such a surface, as `r <= 10.001 mm` on a sphere of 10 mm, would cut facets whose nodes are all on one
side. Angles to the neighbours show how far a facet may deviate. A border that crosses a facet only within that
distance, and that runs parallel to the facet as far as its nodes show, does not cut it: the nodes decide. Borders
across the surface still cut facets. So do borders on flat faces, which have no angles to their neighbours.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.problem.surface_selection.facet_patches import ConditionOnPatches, Floats, Ints, Mask
from softmark.solvers.elements import moment_fitted_quadrature
from softmark.solvers.elements.boundary_facets import FACETS

if TYPE_CHECKING:
    from softmark.solvers.mesh.mesh import Mesh

EDGE = np.cos(np.deg2rad(50.0))  # facets that meet at a larger angle meet at an edge of the body
SAGITTA = (
    0.5  # relative to the size times the angle: at least what an arc rises above its chord, of facets of any shape
)
SLOPE = 1.0  # times the rise of the level within the deviation: by how much it may differ between nodes
REACH = 2.0  # times the deviation: how deep a border may seem to cut


def deviations(mesh: Mesh) -> Floats:
    """Return the possible distance of each boundary facet (f,) from the smooth surface, m; zero on flat parts."""
    facets = mesh.facets
    corners = facets[:, : mesh.element.facet.corners]
    size = np.ptp(mesh.points[corners], axis=1).max(axis=1)
    first, second, angle = _edge_angles(mesh)
    smooth = np.cos(angle) > EDGE
    found = np.zeros(len(facets))
    for own, other in ((first, second), (second, first)):
        np.maximum.at(found, own[smooth], SAGITTA * np.maximum(size[own], size[other])[smooth] * angle[smooth])
    found[found < 1e-9 * mesh.extent] = 0.0
    return found


def _edge_angles(mesh: Mesh) -> tuple[Ints, Ints, Floats]:
    """Return pairs of facets that share an edge, and the angle between their normals at its middle."""
    facet, n = mesh.element.facet, mesh.element.facet.corners
    places = np.array(facet.rim)
    middles = 0.5 * (places + np.roll(places, -1, axis=0))
    t = np.einsum("skj,fki->jfsi", facet.gradient(middles), mesh.points[mesh.facets])
    normals = np.cross(t[0], t[1])
    sizes = np.linalg.norm(normals, axis=2, keepdims=True)
    normals = np.divide(normals, sizes, out=normals, where=sizes > 0.0)  # a side of a triangle may be a corner
    ends = np.stack([mesh.facets[:, :n], np.roll(mesh.facets[:, :n], -1, axis=1)], axis=2).reshape(-1, 2)
    key = np.sort(ends, axis=1) @ np.array([len(mesh.points), 1])
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    one, two = order[same], order[same + 1]
    flat = normals.reshape(-1, 3)
    angle = np.arctan2(np.linalg.norm(np.cross(flat[one], flat[two]), axis=1), np.sum(flat[one] * flat[two], axis=1))
    return one // n, two // n, angle


def settle_within_deviation(asked: ConditionOnPatches, f: Ints, deviation: Floats) -> ConditionOnPatches:
    """Return the condition with additional borders settled: those that cut a facet only within its deviation.

    Their side is decided by the nodes of the facet. `f` are the numbers of the facets, and `deviation` (f,), m,
    their distances from the smooth surface.
    """
    some = f[deviation[f] > 0.0]
    mask, values = asked.settled.copy(), asked.settling.copy()
    for b, which, level in _parallel_borders(asked, some, deviation):
        mask[which, b] = True
        values[which, b] = level
    return replace(asked, settled=mask, settling=values)


def _parallel_borders(asked: ConditionOnPatches, f: Ints, deviation: Floats) -> Iterator[tuple[int, Ints, Floats]]:
    """Yield borders that run parallel to facets: number of the border, facets, and levels at their nodes."""
    patches = asked.patches
    if not len(f):
        return
    corners, centre = patches.corners[f], np.tile(np.array(FACETS[patches.nodes].centre), (len(f), 1))
    xi = moment_fitted_quadrature.point_positions(patches.nodes)
    X = patches.at(f, np.broadcast_to(xi, (len(f), *xi.shape)))
    n = patches.area(f, centre)
    off = deviation[f][:, None] * n / np.linalg.norm(n, axis=1, keepdims=True)
    middle = np.einsum("qk,fki->fqi", FACETS[patches.nodes].shape(centre[:1]), corners)[:, 0]
    for b in range(len(asked.condition.borders)):
        nodes, points = asked.level(b, corners), asked.level(b, X)
        rise = 0.5 * np.abs(asked.level(b, middle + off) - asked.level(b, middle - off))
        mean = nodes.mean(axis=1)
        parallel = np.ptp(nodes, axis=1) <= SLOPE * rise
        near = np.abs(points - mean[:, None]).max(axis=1) <= REACH * rise
        fit = parallel & near & _is_on_one_side(nodes, asked.slack[b])
        yield b, f[fit], mean[fit]


def _is_on_one_side(nodes: Floats, slack: float) -> Mask:
    """Return whether all nodes of a facet are on one side of a border, within the tolerance of conditions."""
    found: Mask = (nodes.min(axis=1) >= -slack) | (nodes.max(axis=1) <= slack)
    return found
