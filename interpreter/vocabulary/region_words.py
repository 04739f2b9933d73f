"""Regions: parts of a body, optionally with a material of their own.

To add one: a class derived from Region with a condition as its `where`, and a line in REGIONS. The name of a region can
be used wherever a condition is expected.
"""

from __future__ import annotations

from functools import cache
from typing import Annotated, Any

from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.vocabulary.values_in_states import HasMaterial
from softmark.records import dataclass


class Region(HasMaterial):
    """Base class of regions: named parts of a body, which can have a material of their own."""

    body: str
    where: Any
    over: tuple[str, ...]

    @property
    def group(self) -> str | None:
        """Name of the mesh file group that defines the region; None for other regions."""
        return None


@dataclass(frozen=True)
class BodyPart(Region):
    """The part of a body where a condition holds, with a material of its own or that of the body.

    Its name can be used wherever a condition is expected: `where = lump`, `where = lump and x > 0 mm`. Only full finite
    element models support parts with other materials. Every cell of a mesh has one material, the one with the largest
    share of the cell. Meshes of shapes have nodes on the border of a part if it lies at a coordinate of the shape
    (planes across a box, planes and circles of a cylinder). For other borders the report gives the fraction of the part
    that its cells cover, and the stated error includes the effect. Parts of different materials must not overlap,
    unless one is declared `over` the other.
    """

    body: Annotated[str, "body", "body that contains the region"]
    where: Annotated[Any, "condition", "points of the region, by undeformed coordinates"]
    material: Annotated[Any | None, "material", "material of the region; default: that of the body"] = None
    over: Annotated[
        tuple[str, ...], "regions", "overlapping regions that it takes precedence over, as in `over = [wall]`"
    ] = ()


@dataclass(frozen=True)
class BodyGroup(Region):
    """A named group of the body's mesh file: cells, or faces of its surface.

    Groups are physical groups (Gmsh 2 and 4.1; by number if they have no name), ELSET, NSET and SURFACE (Abaqus,
    CalculiX), and integer arrays on cells (VTU, VTK, Medit): `ARRAY=VALUE`, or `ARRAY` if its values are only 0 and 1.
    In an Abaqus assembly names are `INSTANCE.NAME`. A node set selects the faces all of whose corners are in the set;
    if there are none, it is a group of nodes, which only supports can use. If a name has both cells and faces, the
    faces are `NAME:faces`. No geometry is involved: a group is exactly its facets or cells, and a load on a group of
    cells acts on those of their faces that are on the surface of the body. The region can be used wherever a condition
    is expected, also combined: `where = tip and z > 0 mm`. Only groups of cells can have a material.
    """

    body: Annotated[str, "body", "body with a mesh from a file"]
    name: Annotated[str, "name of the group in the file"]
    material: Annotated[Any | None, "material", "material of the region; default: that of the body"] = None
    over: Annotated[
        tuple[str, ...], "regions", "overlapping regions that it takes precedence over, as in `over = [wall]`"
    ] = ()

    @property
    def group(self) -> str:
        """Name of the group in the mesh file."""
        return self.name

    @property
    def where(self) -> Condition:
        """Condition that selects the cells, facets and nodes of the group."""
        return _group_condition(self.name)


@cache
def _group_condition(name: str) -> Condition:
    """Return the condition that selects the mesh group `name`.

    For each name it is one object, because selections are cached by this object.
    """
    return Condition.group(name)
