"""Fraction of a body's cross-section that a condition selects."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.problem.surface_selection.facet_patches import ConditionOnPatches, Floats, Out, Patches
from softmark.interpreter.problem.surface_selection.selected_facets import select_patches
from softmark.solvers.mesh.cross_sections import Disc, Rectangle
from softmark.solvers.mesh.shape import Swept
from softmark.solvers.mesh.tubes import Annulus

WEDGES = 6  # of a disc
RINGS = (1.0, 0.5, 0.25, 1 / 16, 1 / 64, 1 / 512)  # of its radius; within the last it is a flat polygon


def selected_share(condition: Condition, shape: Swept, station: float) -> float:
    """Return the selected area fraction, 0 to 1, of the cross-section at `station` (m from the root along the axis)."""
    centre, frame = np.array(shape.centre(station)), np.array(shape.frame(station)[1:])
    extent, section = shape.diagonal, shape.section_at(station)
    if isinstance(section, Disc):
        return _disc_fraction(condition, centre, frame, section.radius, extent)
    if isinstance(section, Annulus):
        radii = section.radius, section.inner
        whole, hole = (math.pi * r**2 * _disc_fraction(condition, centre, frame, r, extent) for r in radii)
        return (whole - hole) / section.area
    if not isinstance(section, Rectangle):
        raise TypeError(f"no area is known of a part of a {type(section).__name__}")
    half = 0.5 * np.array([section.width, section.height])
    corners = centre + np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half @ frame
    return _flat_fraction(condition, corners[None], extent)


def _flat_fraction(condition: Condition, corners: Floats, extent: float, out: Out | None = None) -> float:
    """Return the selected fraction of facets `corners` (f, k, 3), m, of equal size."""
    found = select_patches(ConditionOnPatches.of(condition, Patches(corners, extent, out)))
    local = 4.0 if corners.shape[1] == 4 else 0.5
    return (len(found.whole) + float(found.w.sum()) / local) / len(corners)


def _disc_fraction(condition: Condition, centre: Floats, frame: Floats, radius: float, extent: float) -> float:
    """Return the selected fraction of a disc: its core as a polygon, and rings of wedges with arcs for chords."""
    turns = 2.0 * math.pi * np.arange(WEDGES + 1) / WEDGES
    rim = radius * np.stack([np.cos(turns), np.sin(turns)], axis=1) @ frame
    core = centre + RINGS[-1] * np.stack([np.zeros_like(rim[1:]), rim[:-1], rim[1:]], axis=1)
    found = RINGS[-1] ** 2 * _flat_fraction(condition, core, extent)
    for a, b in pairwise(rim):
        found += _wedge_fraction(condition, a, b, centre, frame, extent) / WEDGES
    return min(1.0, found)


def _wedge_fraction(condition: Condition, a: Floats, b: Floats, centre: Floats, frame: Floats, extent: float) -> float:
    """Return the selected fraction of a disc's wedge between two radii a and b (3,), m, without its core.

    Areas at the moved positions are cos^2 phi times those between chords, divided by that factor at the ends of the
    chords; phi is the angle from the wedge's middle.
    """
    far, near = np.array(RINGS[:-1]), np.array(RINGS[1:])
    corners = np.stack([np.outer(near, a), np.outer(far, a), np.outer(far, b), np.outer(near, b)], axis=1)
    patches = Patches(centre + corners, extent, _move_to_arc(centre, frame, a + b))
    found = select_patches(ConditionOnPatches.of(condition, patches))
    X = patches.at(found.f, found.xi[:, None])[:, 0] - centre
    cosine = X @ (a + b) / (np.linalg.norm(X, axis=1) * np.linalg.norm(a + b))
    sizes = found.w * np.linalg.norm(patches.area(found.f, found.xi), axis=1) * cosine**2
    half = math.pi / WEDGES
    cut = float(sizes.sum()) / float(a @ a * half * math.cos(half) ** 2)
    return float((far**2 - near**2)[found.whole].sum()) + cut


def _move_to_arc(centre: Floats, frame: Floats, middle: Floats) -> Out:
    """Return the map that moves points of a wedge radially outward, so that its chords become arcs."""
    (first, second), m = frame.tolist(), (frame @ middle / np.linalg.norm(middle) / math.cos(math.pi / WEDGES)).tolist()

    def out(place: Any) -> Any:
        off = [p - o for p, o in zip(place, centre.tolist(), strict=True)]
        u, v = (sum(p * e for p, e in zip(off, way, strict=True) if e) for way in (first, second))
        k = (u * m[0] + v * m[1]) * (u**2 + v**2) ** -0.5
        return tuple(o + u * k * i + v * k * j for o, i, j in zip(centre.tolist(), first, second, strict=True))

    return out
