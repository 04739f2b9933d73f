"""Measurements after reading: a surface or tracked points, in metres and in the scene's coordinate system.

    Unreadable       error of a measurement that cannot be read, with a remedy
    FileFrame        axes, unit and origin of a file in the scene
    Residual         distances left after a registration
    MeasuredSurface  triangles over points
    MeasuredPoints   points that were tracked from one state to another

Every measurement has an uncertainty; differences below it are not significant.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar

from softmark.records import dataclass
from softmark.safe_files import open_regular

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Ints = NDArray[np.int64]
else:
    from softmark.references.lazy_imports import np

Vector = tuple[float, float, float]

SQUARE = 1e-6
"""How far from a right angle the two axes of a frame may be, as a cosine: what typing six digits does."""


class Unreadable(Exception):
    """Error when a measurement cannot be used: `name` is its file, `reason` the cause, `remedy` an instruction."""

    def __init__(self, name: str, reason: str, remedy: str) -> None:
        super().__init__(f"{name}: {reason}; {remedy}")
        self.name = name
        self.reason = reason
        self.remedy = remedy


UNPACK = "unpack it, and give the path of the unpacked file"


def require_uncompressed(file: Path) -> None:
    """Raise Unreadable if a file is compressed (gzip, RFC 1952), and OSError if it is missing."""
    with open_regular(file) as opened:
        if opened.read(2) == b"\x1f\x8b":
            raise Unreadable(file.name, "it is a compressed file", UNPACK)


@dataclass(frozen=True)
class FileFrame:
    """Coordinate system of a file in the scene: x_scene = unit A x_file + origin, with A a rotation.

    `x` and `z` are the directions of the scene's axes in the file; the scene's y axis is z cross x, so no frame mirrors
    a body.
    """

    unit: float  # m
    x: Vector = (1.0, 0.0, 0.0)
    z: Vector = (0.0, 0.0, 1.0)
    origin: Vector = (0.0, 0.0, 0.0)  # m, where the origin of the file lies in the scene

    def rotation(self, name: str) -> Array:
        """Return the rotation A (3, 3), whose rows are the scene's axes in the file.

        Raises Unreadable unless x and z are perpendicular.
        """
        along = sum(a * b for a, b in zip(self.x, self.z, strict=True))
        if abs(along) > SQUARE:
            angle = math.degrees(math.acos(max(-1.0, min(1.0, along))))
            reason = f"`x` and `z` of its frame meet at {angle:.4g} degrees"
            remedy = "give two directions of the file that are perpendicular, such as `x = z, z = y`"
            raise Unreadable(name, reason, remedy)
        x = np.asarray(self.x, dtype=float)
        y = np.cross(np.asarray(self.z, dtype=float), x)
        y /= np.linalg.norm(y)
        return np.array([x, y, np.cross(x, y)])

    def points(self, P: Array, name: str) -> Array:
        """Return points P (n, 3) of the file, in its units, as points of the scene, m."""
        return np.asarray(self.unit * P @ self.rotation(name).T + np.asarray(self.origin))

    def vectors(self, V: Array, name: str) -> Array:
        """Return displacements V (n, 3) of the file, in its units, as displacements in the scene, m."""
        return self.unit * V @ self.rotation(name).T


@dataclass(frozen=True)
class Residual:
    """Statistics of the distances left after a registration, m."""

    mean: float
    rms: float
    max: float
    points: int

    @classmethod
    def of(cls, distances: Array) -> Residual:
        """Return the statistics of distances (n,), m, n >= 1."""
        d = np.abs(distances)
        return cls(float(d.mean()), float(np.sqrt((d * d).mean())), float(d.max()), len(d))

    @property
    def words(self) -> str:
        """Description as text: `residual mean 0.12 mm, rms 0.15 mm, max 0.60 mm over 300 points`."""
        mean, rms, most = (f"{1e3 * v:.3g} mm" for v in (self.mean, self.rms, self.max))
        return f"residual mean {mean}, rms {rms}, max {most} over {self.points} points"


@dataclass(frozen=True)
class MeasuredSurface:
    """Measured surface in the scene's coordinates; its triangles are counter-clockwise seen from outside."""

    points: Array  # (n, 3), m
    triangles: Ints  # (t, 3)
    uncertainty: float  # m, of the place of any of its points
    source: str  # authors, or the file only
    residual: Residual | None = None  # registration residual; None without registration
    notes: tuple[str, ...] = ()  # notes on the reading

    @property
    def resolution(self) -> float:
        """Smallest significant difference, m: uncertainty and registration residual, in quadrature."""
        return math.hypot(self.uncertainty, self.residual.rms if self.residual else 0.0)


@dataclass(frozen=True)
class MeasuredPoints:
    """Tracked points: undeformed positions X and displacements u, (n, 3) each, m."""

    X: Array  # (n, 3), m
    u: Array  # (n, 3), m
    uncertainty: float  # m, of a displacement
    source: str
    names: tuple[str, ...]  # of the points
    grid: Ints | None = None  # (n, 3): indices i, j, k of points that lie on a grid
    notes: tuple[str, ...] = ()
    residual: ClassVar[None] = None  # nothing is registered

    @property
    def resolution(self) -> float:
        """Smallest significant difference, m."""
        return self.uncertainty

    @property
    def x(self) -> Array:
        """Deformed positions (n, 3), m."""
        return self.X + self.u

    def displacement(self, X: Array) -> Array:
        """Return the displacements (k, 3), m, of tracked points given by their undeformed positions X (k, 3), m."""
        nearest = [int(((self.X - x) ** 2).sum(axis=1).argmin()) for x in X]
        return self.u[nearest]


Measured = MeasuredSurface | MeasuredPoints
