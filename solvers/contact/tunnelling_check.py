"""Tunnelling check: finds whether a rigid body passed through a surface between two states.

Every state is solved separately: a body that passed through in one step touches nothing, and one that passed half-way
pushes nodes out behind it. Motion between states is taken to be straight. The check uses the depth of contact points
in the rigid body, and the facets that its centroid passed through: between contact points nothing stops it.
"""

from __future__ import annotations

import numpy as np

from softmark.records import dataclass
from softmark.solvers.contact.rigid_contact import RigidContact
from softmark.solvers.contact.rigid_transform import MovedGap, RigidMotion, gap_as_declared
from softmark.solvers.contact.signed_distance.distance_function import Gap, depth_of_centroid
from softmark.solvers.elements.boundary_facets import FACETS
from softmark.solvers.energies.energy import Floats, Ints

STEPS, MOST = 32, 1024  # from one state to the next, or two to a depth; no more
APART = 0.25  # of the way of a rigid body, and of how deep its middle is, where nothing is pressed in the end
DEEP, WIDE = 0.75, 0.4  # of that depth, and of the way, where something is: what slides around an edge goes on a curve
ACROSS = 0.5  # of that depth, of what is pressed on the other side of it than the one that it was on
BESIDE = 1e-3  # of a triangle: what is as near to a side of it goes through it too


@dataclass(frozen=True)
class SurfaceTriangles:
    """Whole surface of a body, or border of a slice: triangles of nodes `of` (t, 3), at rest X (t, 3, 3), m."""

    of: Ints
    X: Floats

    def at(self, x: Floats, pose: RigidMotion) -> Floats:
        """Return the triangles in a state (dofs,), in the frame of a rigid body that has moved (t, 3, 3), m."""
        now = self.X + np.asarray(x, dtype=np.float64)[3 * self.of[..., None] + np.arange(3)]
        return pose.back(now.reshape(-1, 3)).reshape(now.shape)


def surface_triangles(points: Floats, facets: Ints) -> SurfaceTriangles:
    """Return the triangles of facets (f, a) of a mesh, at rest at points (n, 3), m."""
    triangles = facets[:, np.array(FACETS[facets.shape[1]].triangles)].reshape(-1, 3)
    return SurfaceTriangles(triangles, points[triangles])


def tunnelling_depth(contact: RigidContact, before: Floats, x: Floats) -> float:
    """Return the greatest depth, m, of points in a rigid body on the way from state `before` (dofs,) to x; 0 if
    allowed.

    It considers the points in contact at the end, or all points if there are none.
    """
    now = contact.at(1.0)
    start, end = (body.pose if isinstance(body, MovedGap) else RigidMotion() for body in (contact.earlier, now.body))
    own = gap_as_declared(now.body)
    on = now.pressures(x) > 0.0
    pressed = bool(on.any())
    on = on if pressed else np.ones_like(on)
    first, last = (now.places(y)[on] for y in (before, x))
    travel = float(np.linalg.norm(end.moved(first) - start.moved(first), axis=1).max(initial=0.0))
    if travel == 0.0:
        return 0.0
    inner = depth_of_centroid(own)
    deep = _greatest_depths(own, (start, end), (first, last), inner)
    allowed = np.full(len(deep), max(DEEP * inner, WIDE * travel) if pressed else APART * min(inner, travel))
    if pressed and inner > 0.0:
        n0, n1 = (own.look(pose.back(X))[1] for pose, X in ((start, first), (end, last)))
        allowed[np.einsum("ni,ni->n", n0, n1) < 0.0] = ACROSS * inner
    deepest = float(deep[deep > allowed].max(initial=0.0))
    if contact.skin is not None and 0.0 < inner < np.inf:
        middle = np.array(own.centroid) * ((1.0, 1.0, 0.0) if contact.flat else 1.0)
        if _passes_centroid(contact.skin.at(before, start) - middle, contact.skin.at(x, end) - middle):
            return max(deepest, inner)
    return deepest


def _greatest_depths(
    own: Gap, poses: tuple[RigidMotion, RigidMotion], ends: tuple[Floats, Floats], inner: float
) -> Floats:
    """Return the greatest depths of points that move between two `ends` (n, 3), m, as the rigid body moves."""
    (start, end), (first, last) = poses, ends
    far = float(np.linalg.norm(end.back(last) - start.back(first), axis=1).max(initial=0.0))
    steps = int(np.clip(2.0 * far / inner, STEPS, MOST)) if inner > 0.0 else STEPS
    deep = np.zeros(len(first))
    for share in np.arange(1, steps) / steps:
        shift, rotation = ((1.0 - share) * np.array(a) + share * np.array(b)
                           for a, b in ((start.shift, end.shift), (start.rotation, end.rotation)))  # fmt: skip
        pose = RigidMotion(tuple(shift.tolist()), tuple(rotation.tolist()), end.about)
        deep = np.maximum(deep, -MovedGap(own, pose).gap((1.0 - share) * first + share * last))
    return deep


def sweeps_centroid(contact: RigidContact, before: Floats, x: Floats) -> bool:
    """Return whether facets of the surface swept over the centroid of a rigid body between two states (dofs,), m.

    They then penetrate the body by at least half of its thickness. Use it only for steps that are short relative to
    that thickness.
    """
    now = contact.at(1.0)
    start, end = (body.pose if isinstance(body, MovedGap) else RigidMotion() for body in (contact.earlier, now.body))
    own = gap_as_declared(now.body)
    if contact.skin is None or not 0.0 < depth_of_centroid(own) < np.inf:
        return False
    middle = np.array(own.centroid) * ((1.0, 1.0, 0.0) if contact.flat else 1.0)
    return len(_swept_triangle_normals(contact.skin.at(before, start) - middle, contact.skin.at(x, end) - middle)) > 0


def _passes_centroid(A: Floats, B: Floats) -> bool:
    """Return whether triangles that move straight from A to B (t, 3, 3), m, have passed the centroid of a body at 0.

    It enters through some and leaves through others that face the other way; motion around a corner does not count.
    """
    n = _swept_triangle_normals(A, B)
    return bool((n @ n.T < 0.0).any())


def _swept_triangle_normals(A: Floats, B: Floats) -> Floats:
    """Return normals (k, 3), m^2, of triangles that sweep over the origin, straight from A to B (t, 3, 3), m."""
    both = np.concatenate([A, B], axis=1)
    near = ((both.min(axis=1) <= 0.0) & (both.max(axis=1) >= 0.0)).all(axis=1)
    A, B = A[near], B[near]
    share = np.linspace(0.0, 1.0, STEPS + 1)[:, None, None, None]
    volume = np.linalg.det((1.0 - share) * A + share * B)
    at, which = np.nonzero(volume[:-1] * volume[1:] < 0.0)
    v, w = volume[at, which], volume[at + 1, which]
    s = ((at + v / (v - w)) / STEPS)[:, None, None]
    T = (1.0 - s) * A[which] + s * B[which]
    n = np.cross(T[:, 1] - T[:, 0], T[:, 2] - T[:, 0])
    parts = np.stack([np.einsum("ti,ti->t", np.cross(T[:, i], T[:, i - 2]), n) for i in range(3)])
    found: Floats = n[parts.min(axis=0) >= -BESIDE * np.einsum("ti,ti->t", n, n)]
    return found
