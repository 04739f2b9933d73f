"""Bodies: a shape made of a material."""

from __future__ import annotations

from typing import Annotated, Any

from softmark.records import dataclass


@dataclass(frozen=True)
class Solid:
    """A body of one material that fills a shape, undeformed and free of stress where it is declared."""

    shape: Annotated[Any, "shape", "its geometry before deformation"]
    material: Annotated[Any, "material", "what it is made of"]
