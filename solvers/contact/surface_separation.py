"""Least distance between parts of a surface that face each other, such as the walls of a closing fold."""

from __future__ import annotations

import numpy as np

from softmark.solvers.contact.closest_face_points import vectors_from_closest_points
from softmark.solvers.energies.energy import Floats, Ints

FACING = (
    0.86  # cosine of 30 degrees, largest angle between outward normals and the line across; corners have larger ones
)
PAIRS = 200_000_000  # of corners and faces: a few seconds; surfaces with more pairs are not searched
CHUNK = 2_000_000  # pairs that are compared at a time, 50 MB


def least_facing_distance(V: Floats, faces: Ints, normals: Floats) -> float | None:
    """Return the least distance, m, from a corner of V (n, d), m, to a face (f, d) that faces it on the same surface.

    `normals` (f, d) are outward unit normals. Faces that contain the corner are left out. The result is infinite if no
    parts face each other, and None if the surface has too many faces for this search.
    """
    corners = np.unique(faces)
    if len(corners) * len(faces) > PAIRS:
        return None
    own = np.zeros_like(V)
    for column in faces.T:
        np.add.at(own, column, normals)
    own /= np.maximum(np.linalg.norm(own, axis=1, keepdims=True), 1e-300)
    around = _faces_around_corners(faces, len(V))
    middles = V[faces].mean(axis=1)
    radii = np.linalg.norm(V[faces] - middles[:, None], axis=2).max(axis=1)
    best, rows = np.inf, max(1, CHUNK // len(faces))
    for some in np.array_split(corners, range(rows, len(corners), rows)):
        far = np.linalg.norm(middles - V[some, None], axis=2)
        p, f = np.nonzero(far - radii < min(best, float((far + radii).max(initial=0.0))))
        way = middles[f] - V[some[p]]
        size = far[p, f] + radii[f]
        against = (np.einsum("ci,ci->c", way, normals[f]) < radii[f]) & (size > 0.0)
        p, f = p[against], f[against]
        p, f = _sort_pairs_by_distance(some, p, f, far, radii)
        for cut in np.array_split(np.arange(len(p)), range(CHUNK // 20, len(p), CHUNK // 20)):
            best = min(best, _least_distance_of_pairs(V, faces, (normals, own, around), some[p[cut]], f[cut]))
            if not len(cut) or best <= float((far[p[cut], f[cut]] - radii[f[cut]]).max()):
                break  # all later pairs are farther
    return best


def _sort_pairs_by_distance(some: Ints, p: Ints, f: Ints, far: Floats, radii: Floats) -> tuple[Ints, Ints]:
    """Return pairs of corners p and faces f, sorted by a lower bound of their distance.

    `far` (corners, faces), m, are distances to the centres of the faces, and `radii` (f,), m, the sizes of the faces.
    """
    order = np.argsort(far[p, f] - radii[f], kind="stable")
    return p[order], f[order]


def _faces_around_corners(faces: Ints, count: int) -> tuple[Ints, Ints]:
    """Return the faces at each of `count` corners, as one array, and the index in it where each corner starts.

    The shapes are (f k,) and (count + 1,), for `faces` (f, k).
    """
    order = np.argsort(faces.ravel(), kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(faces.ravel(), minlength=count))])
    return order // faces.shape[1], starts.astype(np.int64)


def _least_distance_of_pairs(
    V: Floats, faces: Ints, directions: tuple[Floats, Floats, tuple[Ints, Ints]], corner: Ints, face: Ints
) -> float:
    """Return the least distance, m, over pairs (c,) of a corner and a face that face each other, or infinity.

    A corner and a face face each other if the normal of the face points to the corner, and a normal at the corner
    points to the face. The normals at the corner are those of its faces and their mean. `directions` are the face
    normals (f, d), the mean normals at corners (n, d), and the faces around corners (`_faces_around_corners`).
    """
    normals, own, (at, starts) = directions
    apart = ~(faces[face] == corner[:, None]).any(axis=1)
    corner, face = corner[apart], face[apart]
    way = -vectors_from_closest_points(V[corner], V[faces[face]])  # from the corner to the face
    far = np.linalg.norm(way, axis=1)
    across = (np.einsum("ci,ci->c", way, normals[face]) <= -FACING * far) & (far > 0.0)
    corner, way, far = corner[across], way[across], far[across]
    many = starts[corner + 1] - starts[corner]
    which = np.repeat(np.arange(len(corner)), many)
    place = np.arange(len(which)) - np.repeat(np.cumsum(many) - many, many) + np.repeat(starts[corner], many)
    ahead = np.einsum("ci,ci->c", way, own[corner])
    np.maximum.at(ahead, which, np.einsum("ci,ci->c", way[which], normals[at[place]]))
    return float(far[ahead >= FACING * far].min(initial=np.inf))
