"""Regions: parts of a body, each with a material of its own if it has one.

To add one: a class derived from Region with a condition as its `where`, a line in REGIONS. Whatever takes a condition
takes the name of a region in its place.
"""

from __future__ import annotations

from typing import Annotated, Any

from softmark.records import dataclass


class Region:
    """What every region says."""

    body: str
    where: Any
    material: Any
    over: tuple[str, ...]


@dataclass(frozen=True)
class BodyPart(Region):
    """The part of a body where a condition holds, of a material of its own or of that of the body.

    Its name stands wherever a condition does: `where = lump`, `where = lump and x > 0 mm`. Finite elements in full take
    parts of other materials. Every cell of a mesh is of one material, that of which it holds the most. Meshes of shapes
    have nodes where a part ends at a coordinate of the shape (planes across a box, planes and circles of a cylinder);
    elsewhere the report says what share of the part its cells have, and the stated error contains what that makes.
    Parts of different materials do not overlap unless one says that it lies `over` the other.
    """

    body: Annotated[str, "body", "the body that it is a part of"]
    where: Annotated[Any, "condition", "which of its points, by their coordinates before deformation"]
    material: Annotated[Any | None, "material", "what it is made of; the material of the body without"] = None
    over: Annotated[tuple[str, ...], "regions", "regions whose material it displaces, as in `over = [wall]`"] = ()
