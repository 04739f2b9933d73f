"""A stand-in for manifold3d, for where it is not installed: it knows of a body that holds all of another, no more."""

from __future__ import annotations

from enum import Enum
from typing import Any

import numpy as np


class Error(Enum):
    """What may be wrong with a surface."""

    NoError = 0
    NotManifold = 2


class Mesh64:
    """Points and triangles."""

    def __init__(self, points: Any, triangles: Any) -> None:
        self.vert_properties, self.tri_verts = points, triangles


class Manifold:
    """A body; the sum with what it holds is itself, and of what holds it nothing is left."""

    sound = True

    def __init__(self, mesh: Mesh64 | None = None) -> None:
        self.mesh = mesh

    def status(self) -> Error:
        """Sound, unless a test says otherwise."""
        return Error.NoError if Manifold.sound else Error.NotManifold

    def __add__(self, other: Manifold) -> Manifold:
        return self

    def __sub__(self, other: Manifold) -> Manifold:
        return Manifold()

    def is_empty(self) -> bool:
        """Whether nothing is left."""
        return self.mesh is None

    def volume(self) -> float:
        """Enclosed."""
        assert self.mesh is not None
        a, b, c = (self.mesh.vert_properties[self.mesh.tri_verts[:, i]] for i in range(3))
        return float(np.einsum("ti,ti->", a, np.cross(b, c)) / 6.0)

    def to_mesh64(self) -> Mesh64:
        """Its surface."""
        assert self.mesh is not None
        return self.mesh
