"""Regions: parts of a body, each with a material of its own if it has one.

To add one: a class derived from Region with a condition as its `where`, a line in REGIONS. Whatever takes a condition
takes the name of a region in its place.
"""

from __future__ import annotations

from functools import cache
from typing import Annotated, Any

from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.vocabulary.load_words import MadeOf
from softmark.records import dataclass


class Region(MadeOf):
    """What every region says."""

    body: str
    where: Any
    over: tuple[str, ...]

    @property
    def group(self) -> str | None:
        """The named part of a mesh file that it is."""
        return None


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


@dataclass(frozen=True)
class BodyGroup(Region):
    """A named part of the body's mesh file: cells, or faces of its surface.

    Names are those of physical groups (Gmsh 2 and 4.1; by number where they have no name), of ELSET, NSET and SURFACE
    (Abaqus, CalculiX), and `ARRAY=VALUE` of whole numbers on cells (VTU, VTK, Medit), or `ARRAY` where these are ones
    and zeros. Names of an assembly's instances are `INSTANCE.NAME`. A set of nodes stands for the faces all of whose
    corners it has; where it has nodes of no such face it is a group of nodes, which supports hold. Where a name has
    cells and faces, the faces are `NAME:faces`. No geometry is involved: a group of faces is its facets, one of cells
    its cells, and a load on a group of cells acts on those of their faces that are the body's surface. The region
    stands wherever a condition does, with others too: `where = tip and z > 0 mm`. Only cells have a material.
    """

    body: Annotated[str, "body", "the body that it is a part of; its mesh is a file"]
    name: Annotated[str, "the group, as the file has it"]
    material: Annotated[Any | None, "material", "what it is made of; the material of the body without"] = None
    over: Annotated[tuple[str, ...], "regions", "regions whose material it displaces, as in `over = [wall]`"] = ()

    @property
    def group(self) -> str:
        """The named part of a mesh file that it is."""
        return self.name

    @property
    def where(self) -> Condition:
        """Which of its cells, facets and nodes."""
        return _member(self.name)


@cache
def _member(name: str) -> Condition:
    """One condition for each name, by which selections are remembered."""
    return Condition.group(name)
