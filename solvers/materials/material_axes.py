"""Directions in a material: of its fibres, and of the sheets that they lie in, the same everywhere or of each point."""

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


class NoDirection(ValueError):
    """A direction that is none: zero, not a number, or along the fibres where it is to lie across them; `place`, m."""

    def __init__(self, reason: str, place: tuple[float, float, float] | None = None) -> None:
        super().__init__(reason)
        self.reason, self.place = reason, place


@dataclass(frozen=True)
class Frame:
    """Unit vectors before deformation: `f` along the fibres, and `s` across them; the third is f x s.

    Components are numbers, or arrays (m, q), one for each of the q points of m cells.
    """

    fx: Any
    fy: Any
    fz: Any
    sx: Any
    sy: Any
    sz: Any

    @classmethod
    def of(cls, fibres: tuple[float, float, float], sheets: tuple[float, float, float] | None = None) -> Frame:
        """Of two directions, without numpy: `sheets` less what of it lies along the fibres; any across without one.

        Raises NoDirection.
        """
        f = _unit(fibres)
        s = _across(f) if sheets is None else _unit(sheets)
        along = sum(a * b for a, b in zip(f, s, strict=True))
        s = tuple(b - along * a for a, b in zip(f, s, strict=True))
        if math.hypot(*s) < PARALLEL:
            raise NoDirection("the sheets are along the fibres")
        return cls(*f, *_unit(s))

    @classmethod
    def at(cls, fibres: Array, sheets: Array | None, shape: tuple[int, ...]) -> Frame:
        """Of vectors (n, 3) of any length at n points, which make arrays of a shape. Raises NoDirection."""
        f = _units(fibres)
        if sheets is None:
            least = np.eye(3)[np.argmin(np.abs(f), axis=1)]
            s = np.cross(f, least)
        else:
            s = _units(sheets)
            s = s - np.einsum("ni,ni->n", f, s)[:, None] * f
            if np.any(np.linalg.norm(s, axis=1) < PARALLEL):
                raise NoDirection("the sheets are along the fibres")
        return cls(*(c.reshape(shape) for c in (*f.T, *_units(s).T)))

    @property
    def sampled(self) -> bool:
        """Whether it is of several points."""
        return bool(getattr(self.fx, "shape", ()))

    def axes(self, kind: Any) -> Array:
        """f, s and n = f x s (3, 3, m), the components second; (3, 3, 1) of one frame for all."""
        rows = [np.asarray(c, dtype=kind).reshape(-1) for c in (self.fx, self.fy, self.fz, self.sx, self.sy, self.sz)]
        f, s = np.array(rows[:3]), np.array(rows[3:])
        n = np.array([f[1] * s[2] - f[2] * s[1], f[2] * s[0] - f[0] * s[2], f[0] * s[1] - f[1] * s[0]])
        return np.stack([f, s, n])


def _unit(v: Any) -> Any:
    size = math.hypot(*v)
    if not (math.isfinite(size) and size > 0.0):
        raise NoDirection(f"{tuple(v)} is no direction")
    return tuple(c / size for c in v)


def _units(v: Array) -> Array:
    size = np.linalg.norm(v, axis=1, keepdims=True)
    if not (np.all(np.isfinite(size)) and np.all(size > 0.0)):
        raise NoDirection("a direction of no length")
    found: Array = v / size
    return found


def _across(f: Any) -> Any:
    """A direction across another: the coordinate axis that is farthest from it, less what lies along it."""
    least = min(range(3), key=lambda i: abs(f[i]))
    return tuple(float(i == least) for i in range(3))
