"""Part of a surface that a condition selects: whole facets, and quadrature points on partly selected facets."""

from __future__ import annotations

import numpy as np

from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.problem.surface_selection.curved_triangle_parts import (
    FacetQuadraturePoints,
    add_selected_parts,
)
from softmark.interpreter.problem.surface_selection.facet_patches import (
    ConditionOnPatches,
    Floats,
    Ints,
    Mask,
    Out,
    Patches,
)
from softmark.interpreter.problem.surface_selection.plane_clipping import cut_along_planes
from softmark.records import dataclass

__all__ = ["Part", "select_facets", "select_patches"]


@dataclass(frozen=True)
class Part:
    """Selected part of facets: whole facets (w,), and quadrature points on partly selected facets.

    The points have facets f (k,), local coordinates xi (k, 2) and weights w (k,). `remainder` is the area, m^2, of
    which it is not known whether it is selected.
    """

    whole: Ints
    f: Ints
    xi: Floats
    w: Floats
    remainder: float = 0.0

    @property
    def empty(self) -> bool:
        """True if the selected area is zero."""
        return not (len(self.whole) or np.any(self.w > 0.0))


def select_facets(condition: Condition, corners: Floats, extent: float, out: Out | None = None) -> Part:
    """Return the selected part of facets with nodes `corners` (f, k, 3), m; `out` moves their points onto the body."""
    return select_patches(ConditionOnPatches.of(condition, Patches(corners, extent, out)))


@np.errstate(all="ignore")  # divisions by zero give infinite bounds
def select_patches(asked: ConditionOnPatches) -> Part:
    """Return the selected part of the patches."""
    patches = asked.patches
    f, tri = patches.triangles
    if not len(f) or not asked.condition.borders:  # uniform condition
        there = bool(len(f) and asked.condition.holds_for_levels([], patches.extent))
        return Part(np.arange(len(patches.corners) if there else 0), f[:0], np.zeros((0, 2)), np.zeros(0))
    crossed: Mask = np.asarray(asked.look(f, tri).crossed.any(axis=0))
    if crossed.any():
        asked = asked.settle_constant_borders(np.unique(f[crossed]))
        crossed[crossed] = asked.look(f[crossed], tri[crossed]).crossed.any(axis=0)
    inside = asked.holds(f, patches.at(f, tri.mean(axis=1, keepdims=True))[:, 0])
    each = len(f) // len(patches.corners)
    plain = ~crossed.reshape(-1, each).any(axis=1)
    said = inside.reshape(-1, each)
    whole = plain & said.all(axis=1)
    open_ = np.repeat(~whole & ~(plain & ~said.any(axis=1)), each)
    return _select_from_triangles(asked, np.flatnonzero(whole), f[open_], tri[open_])


def _select_from_triangles(asked: ConditionOnPatches, whole: Ints, f: Ints, tri: Floats) -> Part:
    points, patches = FacetQuadraturePoints(), asked.patches
    flat: Mask = patches.affine[f] if patches.out is None else np.zeros(len(f), dtype=np.bool_)
    own, pieces = cut_along_planes(asked, f[flat], tri[flat])
    add_selected_parts(asked, np.concatenate([own, f[~flat]]), np.concatenate([pieces, tri[~flat]]), points)
    left = sum(float(np.linalg.norm(patches.area(g, at), axis=1) @ a) for g, at, a in points.left)
    if not points.f:
        return Part(whole, whole[:0], np.zeros((0, 2)), np.zeros(0), left)
    return Part(whole, np.concatenate(points.f), np.concatenate(points.xi), np.concatenate(points.w), left)
