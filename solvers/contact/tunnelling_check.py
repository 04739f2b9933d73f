"""Tunnelling check: finds whether a rigid body passed through a surface between two states.

Every state is solved separately. A body that passed completely through the surface in one step touches nothing, and one
that passed half-way pushes nodes out on its rear side. Motion between states is taken to be straight. The check uses
the depth of contact points in the rigid body. It also uses the facets that passed over the centroid of the body,
because nothing keeps the body out between contact points.
"""

from __future__ import annotations

import numpy as np

from softmark.records import dataclass
from softmark.solvers.contact.rigid_contact import RigidContact
from softmark.solvers.contact.rigid_transform import MovedGap, RigidMotion, gap_as_declared
from softmark.solvers.contact.signed_distance.distance_function import Gap, depth_of_centroid
from softmark.solvers.elements.boundary_facets import FACETS
from softmark.solvers.energies.energy import Floats, Ints

STEPS, MOST = (
    32,
    1024,
)  # least number of positions between two states (else two per depth of the centroid), and the largest
APART = 0.25  # allowed depth without contact at the end, of the travel and of the depth of the centroid
DEEP, WIDE = 0.75, 0.4  # the same with contact: sliding around an edge follows a curve
ACROSS = 0.5  # the same, of the depth, for points that end on another side of the body
BESIDE = 1e-3  # of a triangle: tolerance for motion through one of its sides


@dataclass(frozen=True)
class SurfaceTriangles:
    """Triangles of the whole surface of a body, or of the border of a slice.

    Their nodes are `of` (t, 3), at rest at X (t, 3, 3), m.
    """

    of: Ints
    X: Floats

    def at(self, x: Floats, pose: RigidMotion) -> Floats:
        """Return the corners (t, 3, 3), m, of the triangles in a state x (dofs,), in the frame of a rigid body.

        `pose` is the motion of the rigid body.
        """
        now = self.X + np.asarray(x, dtype=np.float64)[3 * self.of[..., None] + np.arange(3)]
        return pose.back(now.reshape(-1, 3)).reshape(now.shape)


def surface_triangles(points: Floats, facets: Ints) -> SurfaceTriangles:
    """Return the triangles of mesh facets (f, a) with nodes at rest at points (n, 3), m."""
    triangles = facets[:, np.array(FACETS[facets.shape[1]].triangles)].reshape(-1, 3)
    return SurfaceTriangles(triangles, points[triangles])


def tunnelling_depth(contact: RigidContact, before: Floats, x: Floats) -> float:
    """Return the greatest depth, m, that a point had in a rigid body between the states `before` and x (dofs,).

    It is 0 if no depth exceeds the allowed one. The points are those in contact at the end, or all contact points if
    there are none.
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
    deep = _greatest_depths_on_path(own, (start, end), (first, last), inner)
    allowed = np.full(len(deep), max(DEEP * inner, WIDE * travel) if pressed else APART * min(inner, travel))
    if pressed and inner > 0.0:
        n0, n1 = (own.look(pose.back(X))[1] for pose, X in ((start, first), (end, last)))
        allowed[np.einsum("ni,ni->n", n0, n1) < 0.0] = ACROSS * inner
    deepest = float(deep[deep > allowed].max(initial=0.0))
    if contact.skin is not None and 0.0 < inner < np.inf:
        middle = np.array(own.centroid) * ((1.0, 1.0, 0.0) if contact.flat else 1.0)
        if _has_passed_centroid(contact.skin.at(before, start) - middle, contact.skin.at(x, end) - middle):
            return max(deepest, inner)
    return deepest


def _greatest_depths_on_path(
    own: Gap, poses: tuple[RigidMotion, RigidMotion], ends: tuple[Floats, Floats], inner: float
) -> Floats:
    """Return the greatest depth (n,), m, of each point on its straight way between two positions.

    `ends` are both positions (n, 3), m, of the points, and `poses` the motions of the rigid body with the signed
    distance `own`. `inner`, m, is the depth of its centroid.
    """
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
    """Return whether surface facets swept over the centroid of a rigid body between two states.

    The states are `before` and x (dofs,). Facets that sweep over it penetrate the body by at least half of its
    thickness. Use this check only for steps that are short compared with that thickness.
    """
    now = contact.at(1.0)
    start, end = (body.pose if isinstance(body, MovedGap) else RigidMotion() for body in (contact.earlier, now.body))
    own = gap_as_declared(now.body)
    if contact.skin is None or not 0.0 < depth_of_centroid(own) < np.inf:
        return False
    middle = np.array(own.centroid) * ((1.0, 1.0, 0.0) if contact.flat else 1.0)
    return len(_swept_triangle_normals(contact.skin.at(before, start) - middle, contact.skin.at(x, end) - middle)) > 0


def _has_passed_centroid(A: Floats, B: Floats) -> bool:
    """Return whether triangles that move straight from A to B (t, 3, 3), m, have passed through a centroid at 0.

    The centroid then enters the body through some triangles and leaves it through others that face the other way.
    Motion around a corner does not count.
    """
    n = _swept_triangle_normals(A, B)
    return bool((n @ n.T < 0.0).any())


def _swept_triangle_normals(A: Floats, B: Floats) -> Floats:
    """Return normals (k, 3), m^2, of the triangles that sweep over the origin on their way from A to B (t, 3, 3), m."""
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
