"""Test whether points are inside a deformed body, from its surface only.

In space the test uses the solid angle of the closed surface seen from a point. In a plane it uses the winding number of
the section's outline, summed over the triangles of the section. A boundary that a point lies on is ignored: on a plane
of symmetry, or on the axis of revolution, half of the full angle remains.
"""

from __future__ import annotations

import numpy as np

from softmark.solvers.independent_forces.rigid_contact_forces import LEAST, Distance, Floats, solid_angle

SURROUNDED = 1.0  # relative to 4 pi, or 2 pi in the plane; 0 from outside, pi / 2 from a corner between symmetry planes
ON = 1e-9  # sine of the angle above a triangle or a side: a point that low is on it
EACH_WAY = 5  # number of sample points along each coordinate; their nearest points are on the surface
AROUND = 0.1  # margin of the sampling box, relative to the extent
ROUNDS = 8  # rounds of projection: next to a surface inclined to the plane, the nearest point is not in it
CLOSE = 1e-3  # relative to the extent: points left farther from the surface are not on it


def is_inside_volume(x: Floats, X: Floats) -> bool:
    """Return whether a point (3,), m, is inside a closed surface of triangles (t, 3, 3), or on it."""
    return bool(abs(solid_angle(x[None], X, ON)[0]) > SURROUNDED)


def is_inside_region(p: Floats, X: Floats) -> bool:
    """Return whether a point (2,), m, is inside a region of equally oriented triangles (t, 3, 2), or on its edge.

    Sides between two triangles cancel, so that only the sides of the outline contribute.
    """
    z = (X - p) @ np.array([1.0, 1.0j])
    ways = np.roll(z, -1, axis=1) * z.conj()
    seen = np.abs(ways.imag) > ON * np.maximum(np.abs(ways), LEAST)
    return bool(abs(float(np.where(seen, np.angle(ways), 0.0).sum())) > SURROUNDED)


def sample_surface(look: Distance, low: Floats, high: Floats, plane: bool) -> Floats:
    """Return points (k, 3), m, on the surface of a rigid body, between the corners `low` and `high` of a box, m.

    If `plane`, they lie on the section of the body at z = 0. They are the points of the body nearest to sample points
    around it and in its hollows, since distances are exact outside the body.
    """
    size = float(np.linalg.norm(high - low))
    each = [np.linspace(a - AROUND * size, b + AROUND * size, EACH_WAY) for a, b in zip(low, high, strict=True)]
    across = np.array([1.0, 1.0, 0.0 if plane else 1.0])
    x = np.unique(np.stack(np.meshgrid(*each), axis=-1).reshape(-1, 3) * across, axis=0)
    x = x[look(x)[0] > 0.0]
    for _ in range(ROUNDS if plane else 1):
        g, n = look(x)
        x = x - g[:, None] * n * across
    return x[np.abs(look(x)[0]) < CLOSE * size]
