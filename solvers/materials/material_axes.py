"""Material directions of fibres and sheets, uniform or one per point."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array
else:
    from softmark.solvers.runtime.lazy_modules import np

PARALLEL = 1e-6  # sine of the angle between fibres and sheets below which they are one direction


class InvalidDirection(ValueError):
    """Error of an invalid direction: zero, NaN, or a sheet direction along the fibres; `place` is the point, m."""

    def __init__(self, reason: str, place: tuple[float, float, float] | None = None) -> None:
        super().__init__(reason)
        self.reason, self.place = reason, place


@dataclass(frozen=True)
class MaterialFrame:
    """Undeformed unit vectors: `f` along the fibres and `s` (sheets) across them; the third is n = f x s.

    Components are numbers, or arrays (m, q), one for each of the q points of m cells.
    """

    fx: Any
    fy: Any
    fz: Any
    sx: Any
    sy: Any
    sz: Any

    @classmethod
    def of(cls, fibres: tuple[float, float, float], sheets: tuple[float, float, float] | None = None) -> MaterialFrame:
        """Return the frame of a fibre and a sheet direction, without importing numpy.

        `sheets` is made perpendicular to `fibres`; by default it is any perpendicular direction. Raises
        InvalidDirection.
        """
        f = _unit_vector(fibres)
        s = _perpendicular(f) if sheets is None else _unit_vector(sheets)
        along = sum(a * b for a, b in zip(f, s, strict=True))
        s = tuple(b - along * a for a, b in zip(f, s, strict=True))
        if math.hypot(*s) < PARALLEL:
            raise InvalidDirection("the sheets are along the fibres")
        return cls(*f, *_unit_vector(s))

    @classmethod
    def at(cls, fibres: Array, sheets: Array | None, shape: tuple[int, ...]) -> MaterialFrame:
        """Return the frames of vectors (n, 3) of any length at n points, as arrays of shape `shape`.

        Raises InvalidDirection.
        """
        f = _unit_vectors(fibres)
        if sheets is None:
            least = np.eye(3)[np.argmin(np.abs(f), axis=1)]
            s = np.cross(f, least)
        else:
            s = _unit_vectors(sheets)
            s = s - np.einsum("ni,ni->n", f, s)[:, None] * f
            if np.any(np.linalg.norm(s, axis=1) < PARALLEL):
                raise InvalidDirection("the sheets are along the fibres")
        return cls(*(c.reshape(shape) for c in (*f.T, *_unit_vectors(s).T)))

    @property
    def sampled(self) -> bool:
        """True if there is one frame per point."""
        return bool(getattr(self.fx, "shape", ()))

    def axes(self, kind: Any) -> Array:
        """Return f, s and n = f x s (3, 3, m), with components in the second axis; (3, 3, 1) for a single frame."""
        rows = [np.asarray(c, dtype=kind).reshape(-1) for c in (self.fx, self.fy, self.fz, self.sx, self.sy, self.sz)]
        f, s = np.array(rows[:3]), np.array(rows[3:])
        n = np.array([f[1] * s[2] - f[2] * s[1], f[2] * s[0] - f[0] * s[2], f[0] * s[1] - f[1] * s[0]])
        return np.stack([f, s, n])


def _unit_vector(v: Any) -> Any:
    size = math.hypot(*v)
    if not (math.isfinite(size) and size > 0.0):
        raise InvalidDirection(f"{tuple(v)} is not a valid direction")
    return tuple(c / size for c in v)


def _unit_vectors(v: Array) -> Array:
    size = np.linalg.norm(v, axis=1, keepdims=True)
    if not (np.all(np.isfinite(size)) and np.all(size > 0.0)):
        raise InvalidDirection("a direction with zero length")
    found: Array = v / size
    return found


def _perpendicular(f: Any) -> Any:
    """Return a direction perpendicular to f: the coordinate axis farthest from f, without its part along f."""
    least = min(range(3), key=lambda i: abs(f[i]))
    return tuple(float(i == least) for i in range(3))
