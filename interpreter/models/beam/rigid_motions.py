"""Rigid motions that held degrees of freedom leave free, and their description in words."""

from __future__ import annotations

import numpy as np

from softmark.interpreter.language import units
from softmark.interpreter.vocabulary.supports.spring_support import rigid_motions_along
from softmark.solvers.energies.energy import Floats

AXES = "xyz"
ALIGNED = 1e-6  # tolerance of a direction that is described by an axis name
LEVEL = 1e-9  # of the largest singular value: smaller ones count as zero


def rigid_motion_rows(points: Floats, components: tuple[int, ...]) -> Floats:
    """Return the displacement `components` of `points` (n, 3) in six unit rigid motions (n len(components), 6).

    The columns are three translations followed by three rotations.
    """
    axes = np.eye(3)[list(components)]
    return rigid_motions_along(points, np.broadcast_to(axes, (len(points), *axes.shape))).reshape(-1, 6)


def free_motions(rows: Floats, centre: Floats, extent: float) -> list[str]:
    """Return descriptions of the rigid motions that no constraint row resists; empty if the body is held.

    Rows (n, 6) are about `centre` (3,), m, with rotations in units of 1 / extent. A free motion is a translation or
    a rotation about an axis. The axis of a free motion v + w x r passes through w x v / w.w (Mozzi 1763), after all
    free translations are removed from v.
    """
    null = _null_space_of_rows(rows)
    if len(null) == 6:
        return ["move and turn as a whole"]
    slides = _free_translations(null) if len(null) else np.zeros((0, 3))
    named = [f"slide along {_describe_direction(d)}" for d in slides]
    for motion in _free_rotations(null, slides):
        axis = motion[3:] / np.linalg.norm(motion[3:])
        through = centre + extent * np.cross(motion[3:], motion[:3]) / float(motion[3:] @ motion[3:])
        through = np.where(np.abs(through) < 1e-9 * extent, 0.0, through)
        pitch = float(motion[:3] @ motion[3:]) / float(motion[3:] @ motion[3:])
        turn = "turn" if abs(pitch) < ALIGNED else "screw"
        place = units.format_vector(through.tolist(), units.LENGTH) if np.any(through) else "(0, 0, 0) mm"
        named.append(f"{turn} about the axis through {place} along {_describe_direction(axis)}")
    return named


def _null_space_of_rows(rows: Floats) -> Floats:
    """Return a basis of the rigid motions (k, 6) that no row resists."""
    if len(rows) == 0:
        return np.eye(6)
    _, s, vt = np.linalg.svd(rows, full_matrices=len(rows) < 6)  # of many rows the left side would be (n, n)
    rank = int(np.sum(s > LEVEL * s[0])) if s[0] > 0 else 0
    null: Floats = vt[rank:]
    return null


def _free_translations(null: Floats) -> Floats:
    """Return the directions (t, 3) of free translations."""
    _, s, vt = np.linalg.svd(null[:, 3:].T, full_matrices=True)  # combinations without rotation
    rank = int(np.sum(s > 1e-7))
    return _basis(vt[rank:] @ null[:, :3])


def _free_rotations(null: Floats, slides: Floats) -> Floats:
    """Return free motions (r, 6) with rotation, one for each direction of the axis, without any free translation."""
    if not len(null):
        return null
    axes = _basis(null[:, 3:])
    found = np.array([np.linalg.lstsq(null[:, 3:].T, axis, rcond=1e-7)[0] @ null for axis in axes]).reshape(-1, 6)
    found[:, :3] -= found[:, :3] @ slides.T @ slides
    return found


def _basis(vectors: Floats) -> Floats:
    """Return an orthonormal basis (r, 3) of the span of vectors (n, 3); coordinate axes are preferred."""
    vectors = vectors.reshape(-1, 3)
    _, s, vt = np.linalg.svd(vectors, full_matrices=False) if len(vectors) else (None, np.zeros(0), vectors)
    span = vt[s > 1e-7]
    axes = np.eye(3)[[i for i in range(3) if np.linalg.norm(span @ np.eye(3)[i]) > 1 - ALIGNED]].reshape(-1, 3)
    rest = span - span @ axes.T @ axes
    _, s, vt = np.linalg.svd(rest, full_matrices=False) if len(rest) else (None, np.zeros(0), rest)
    found: Floats = np.concatenate([axes, vt[s > 1e-6]])
    return found


def _describe_direction(d: Floats) -> str:
    """Return a description of a direction: the name of an axis, or its components."""
    for name, part in zip(AXES, d.tolist(), strict=True):
        if abs(part) > 1 - ALIGNED:
            return name
    d = d * np.sign(d[np.argmax(np.abs(d))])
    return f"({', '.join(f'{0.0 if abs(c) < ALIGNED else c:.3g}' for c in d)})"
