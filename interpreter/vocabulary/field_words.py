"""Spatial fields of numbers that are read from a file. To add one: a class here and a line in FIELDS."""

from __future__ import annotations

from typing import Annotated, Any

from softmark.interpreter.language.expression_evaluation import Quantity
from softmark.records import dataclass

Vector3 = tuple[float, float, float]


@dataclass(frozen=True)
class Field:
    """Values in space from a file, for material constants: `young = field("ct.nrrd", unit = 1 kPa)`.

    Images (NRRD, NIfTI) hold one number for each voxel, at its centre. Between centres values are interpolated linearly
    along each axis of the grid; in the outer half of the outermost voxels they are constant. Size, position and
    directions of the grid come from the header of the file: `space directions` and `space origin` of NRRD, the affine
    matrix of NIfTI. The names of anatomical axes are ignored. `x`, `z` and `origin` place the grid in the scene. Meshes
    (VTU, VTK) hold named arrays: values at nodes are interpolated by the shape functions of the cells, and values of
    cells are constant in each cell. Points outside take the value of the nearest point that has one; the report states
    the fraction of the body affected and the values used. A field may be part of an expression, with coordinates too:
    `young = 2 kPa + 3 * field(...)`. Images need the extra `imaging`.
    """

    path: Annotated[str, "file", "the file: .nrrd, .nhdr, .nii, .nii.gz, .vtu or .vtk"]
    unit: Annotated[Quantity, "amount in (0, inf)", "value of a 1 in the file, such as `1 kPa`"]
    array: Annotated[str, "name of the array, if a mesh has several"] = ""
    length: Annotated[float | None, "m in (0, inf)", "unit of length of the file, if the file does not give it"] = None
    x: Annotated[Vector3, "direction", "direction in the file that is the scene's x axis"] = (1.0, 0.0, 0.0)
    z: Annotated[Vector3, "direction", "direction in the file that is the scene's z axis"] = (0.0, 0.0, 1.0)
    origin: Annotated[Vector3, "m", "position of the file's origin in the scene"] = (0.0, 0.0, 0.0)


FIELDS: dict[str, type[Any]] = {"field": Field}
