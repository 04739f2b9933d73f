"""Whether supports hold a body: rigid motions that constrained degrees of freedom leave free, in words."""

from __future__ import annotations

import numpy as np

from softmark.interpreter.language import units
from softmark.solvers.energies.energy import Floats

AXES = "xyz"
ALIGNED = 1e-6  # of a direction that is named by an axis
LEVEL = 1e-9  # of the largest singular value: less is nothing


def point_rows(points: Floats, components: tuple[int, ...]) -> Floats:
    """What the six rigid motions do to `components` of `points` (n, 3), as rows (n len(components), 6)."""
    rows = np.zeros((len(points), 3, 6))
    rows[:, :, :3] = np.eye(3)
    x, y, z = points.T
    rows[:, 0, 4], rows[:, 0, 5] = z, -y  # omega x r
    rows[:, 1, 3], rows[:, 1, 5] = -z, x
    rows[:, 2, 3], rows[:, 2, 4] = y, -x
    return rows[:, list(components)].reshape(-1, 6)


def free_motions(rows: Floats, centre: Floats, extent: float) -> list[str]:
    """The rigid motions that no row resists, in words; empty where the body is held.

    Rows (n, 6) are about `centre` (3,), with turns in units of 1 / extent. A free motion is a slide, or a turn about an
    axis: that of the free motion v + w x r lies at w x v / w.w (Mozzi 1763), after all free slides are taken from v.
    """
    null = _null(rows)
    if len(null) == 6:
        return ["move and turn as a whole"]
    slides = _slides(null) if len(null) else np.zeros((0, 3))
    named = [f"slide along {_direction(d)}" for d in slides]
    for motion in _turns(null, slides):
        axis = motion[3:] / np.linalg.norm(motion[3:])
        through = centre + extent * np.cross(motion[3:], motion[:3]) / float(motion[3:] @ motion[3:])
        through = np.where(np.abs(through) < 1e-9 * extent, 0.0, through)
        pitch = float(motion[:3] @ motion[3:]) / float(motion[3:] @ motion[3:])
        turn = "turn" if abs(pitch) < ALIGNED else "screw"
        place = units.format_vector(through.tolist(), units.LENGTH) if np.any(through) else "(0, 0, 0) mm"
        named.append(f"{turn} about the axis through {place} along {_direction(axis)}")
    return named


def _null(rows: Floats) -> Floats:
    """The motions (k, 6) that no row resists."""
    if len(rows) == 0:
        return np.eye(6)
    _, s, vt = np.linalg.svd(rows, full_matrices=len(rows) < 6)  # of many rows the left side would be (n, n)
    rank = int(np.sum(s > LEVEL * s[0])) if s[0] > 0 else 0
    null: Floats = vt[rank:]
    return null


def _slides(null: Floats) -> Floats:
    """Directions (t, 3) of the free motions that do not turn."""
    _, s, vt = np.linalg.svd(null[:, 3:].T, full_matrices=True)  # which combinations have no turn
    rank = int(np.sum(s > 1e-7))
    return _basis(vt[rank:] @ null[:, :3])


def _turns(null: Floats, slides: Floats) -> Floats:
    """Free motions (r, 6) that turn, one for each direction of axis, without any free slide in them."""
    if not len(null):
        return null
    axes = _basis(null[:, 3:])
    found = np.array([np.linalg.lstsq(null[:, 3:].T, axis, rcond=1e-7)[0] @ null for axis in axes]).reshape(-1, 6)
    found[:, :3] -= found[:, :3] @ slides.T @ slides
    return found


def _basis(vectors: Floats) -> Floats:
    """An orthonormal basis (r, 3) of what vectors (n, 3) span: axes of coordinates where these lie in it."""
    vectors = vectors.reshape(-1, 3)
    _, s, vt = np.linalg.svd(vectors, full_matrices=False) if len(vectors) else (None, np.zeros(0), vectors)
    span = vt[s > 1e-7]
    axes = np.eye(3)[[i for i in range(3) if np.linalg.norm(span @ np.eye(3)[i]) > 1 - ALIGNED]].reshape(-1, 3)
    rest = span - span @ axes.T @ axes
    _, s, vt = np.linalg.svd(rest, full_matrices=False) if len(rest) else (None, np.zeros(0), rest)
    found: Floats = np.concatenate([axes, vt[s > 1e-6]])
    return found


def _direction(d: Floats) -> str:
    """A direction in words: an axis, or its components."""
    for name, part in zip(AXES, d.tolist(), strict=True):
        if abs(part) > 1 - ALIGNED:
            return name
    d = d * np.sign(d[np.argmax(np.abs(d))])
    return f"({', '.join(f'{0.0 if abs(c) < ALIGNED else c:.3g}' for c in d)})"
