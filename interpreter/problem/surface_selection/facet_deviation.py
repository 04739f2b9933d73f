"""By how much flat or quadratic facets miss the smooth surface that they stand for, and what that decides.

A mesh of a file gives points of a curved surface and nothing between them: facets of a sphere lie inside it, or bulge
out of it. A border that runs along such a surface, as `r <= 10.001 mm` does on a sphere of 10 mm, then seems to cut
facets whose nodes are all on one side. Neighbours tell how far a facet may be off: where they meet at an angle, the
surface between them turns. A border that crosses a facet within that distance alone, and to which the facet runs
parallel as far as its nodes tell, does not cut it: its nodes decide. A border that runs across the surface is never
moved, nor is one on flat faces, where there is no angle.
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
SAGITTA = 0.5  # of the size times the angle: at least what an arc rises above its chord, of facets of any shape
SLOPE = 1.0  # times the rise of the level within the deviation: by how much it may differ between nodes
REACH = 2.0  # times the deviation: how deep a border may seem to cut


def deviations(mesh: Mesh) -> Floats:
    """How far each boundary facet (f,) may lie off the smooth surface, m: zero where its neighbours go on as it."""
    facets = mesh.facets
    corners = facets[:, : mesh.element.facet.corners]
    size = np.ptp(mesh.points[corners], axis=1).max(axis=1)
    first, second, angle = _turns(mesh)
    smooth = np.cos(angle) > EDGE
    found = np.zeros(len(facets))
    for own, other in ((first, second), (second, first)):
        np.maximum.at(found, own[smooth], SAGITTA * np.maximum(size[own], size[other])[smooth] * angle[smooth])
    found[found < 1e-9 * mesh.extent] = 0.0
    return found


def _turns(mesh: Mesh) -> tuple[Ints, Ints, Floats]:
    """Pairs of facets that share an edge, and the angle between their normals in its middle."""
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


def settled(asked: ConditionOnPatches, f: Ints, deviation: Floats) -> ConditionOnPatches:
    """The same, where borders that cut facets f within their deviation (f,) only are decided by the nodes."""
    some = f[deviation[f] > 0.0]
    mask, values = asked.settled.copy(), asked.settling.copy()
    for b, which, level in _along(asked, some, deviation):
        mask[which, b] = True
        values[which, b] = level
    return replace(asked, settled=mask, settling=values)


def _along(asked: ConditionOnPatches, f: Ints, deviation: Floats) -> Iterator[tuple[int, Ints, Floats]]:
    """Borders that run along facets as far as these tell: the border, the facets, and the level at their nodes."""
    patches = asked.patches
    if not len(f):
        return
    corners, centre = patches.corners[f], np.tile(np.array(FACETS[patches.nodes].centre), (len(f), 1))
    xi = moment_fitted_quadrature.places(patches.nodes)
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
        fit = parallel & near & _agreed(nodes, asked.slack[b])
        yield b, f[fit], mean[fit]


def _agreed(nodes: Floats, slack: float) -> Mask:
    """Whether all nodes of a facet are on one side of a border, give or take the tolerance of conditions."""
    found: Mask = (nodes.min(axis=1) >= -slack) | (nodes.max(axis=1) <= slack)
    return found
