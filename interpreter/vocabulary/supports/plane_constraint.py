"""Support that a plane body adds itself."""

from __future__ import annotations

from typing import Any

from softmark.interpreter.vocabulary.supports.support import DisplacementSupport
from softmark.records import dataclass


@dataclass(frozen=True)
class PlaneConstraint(DisplacementSupport):
    """Support that keeps all points of a plane body in their planes, or those on an axis of revolution on that axis."""

    implied = True

    body: str
    where: Any
    components: tuple[int, ...]
