"""Fields: numbers in space that are read from a file. To add one: a class here, a line in FIELDS."""

from __future__ import annotations

from typing import Annotated, Any

from softmark.interpreter.language.expression_evaluation import Quantity
from softmark.records import dataclass

Vector3 = tuple[float, float, float]


@dataclass(frozen=True)
class Field:
    """Numbers in space from a file, for constants of materials: `young = field("ct.nrrd", unit = 1 kPa)`.

    Images (NRRD, NIfTI) hold a number for each voxel, which stands for its centre: between centres it is interpolated
    linearly along each axis of the grid, and in the outer half of the outermost voxels it is theirs. Size, place and
    directions of the grid are those of the file's header: `space directions` and `space origin` of NRRD, the affine of
    NIfTI, as they stand there, whatever patients' axes they are named after; `x`, `z` and `origin` say how these lie in
    the scene. Meshes (VTU, VTK) hold an `array` by its name: on nodes, interpolated by the shape functions of the
    cells, or on cells, where each has its own. Places outside take the value of the nearest place that has one: what
    share of the body that is, and what it got, is said. A field may stand in arithmetic, with coordinates too:
    `young = 2 kPa + 3 * field(...)`. Images need the extra `imaging`.
    """

    path: Annotated[str, "file", "the file: .nrrd, .nhdr, .nii, .nii.gz, .vtu or .vtk"]
    unit: Annotated[Quantity, "amount in (0, inf)", "what a 1 in the file stands for, such as `1 kPa`"]
    array: Annotated[str, "the array, in a mesh with several"] = ""
    length: Annotated[float | None, "m in (0, inf)", "one unit of the file's lengths, where it does not say it"] = None
    x: Annotated[Vector3, "direction", "which direction of the file is the scene's x axis"] = (1.0, 0.0, 0.0)
    z: Annotated[Vector3, "direction", "which direction of the file is the scene's z axis"] = (0.0, 0.0, 1.0)
    origin: Annotated[Vector3, "m", "where the file's origin lies in the scene"] = (0.0, 0.0, 0.0)


FIELDS: dict[str, type[Any]] = {"field": Field}
