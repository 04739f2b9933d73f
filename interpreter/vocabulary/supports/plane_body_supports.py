"""Supports that plane bodies add themselves."""

from __future__ import annotations

from typing import Any

from softmark.interpreter.vocabulary.supports.support import DisplacementSupport
from softmark.records import dataclass


@dataclass(frozen=True)
class InPlane(DisplacementSupport):
    """Support that keeps all points of a plane body in their planes.

    Plane bodies add it themselves; scenes do not declare it.
    """

    implied = True

    body: str
    where: Any
    components = (2,)


@dataclass(frozen=True)
class OnAxis(InPlane):
    """Support that keeps the points on the axis of a body of revolution on that axis."""

    components = (0,)
