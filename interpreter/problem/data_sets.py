"""Public data sets that a scene names: they are downloaded when it is run, never when it is checked."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, TypeVar

from softmark.interpreter.language.compiled_scene import Location
from softmark.interpreter.problem.body_case import fault
from softmark.solvers.mesh.boolean_shapes import BooleanShape
from softmark.solvers.mesh.shape import Shape
from softmark.solvers.mesh.shapes import MeshFile
from softmark.solvers.mesh.surface_bodies import Tetrahedralized

AnyShape = TypeVar("AnyShape", bound=Shape)


def download_shape(shape: AnyShape, at: Location) -> AnyShape:
    """Return the shape with its data set downloaded. Raises Fault if that fails."""
    path = shape.file
    if isinstance(shape, BooleanShape) and not shape.fault:
        one, other = (download_shape(own, at) for own in shape.pair)
        combined: AnyShape = replace(shape, one=one, other=other)
        return combined
    if shape.flat and shape.prebuilt:
        return _download_data_of_region(shape, at)
    if not isinstance(shape, MeshFile | Tetrahedralized) or not path.startswith("data:"):
        return shape
    from softmark.references.data_download import Unavailable, find_file

    try:
        here: AnyShape = replace(shape, path=str(find_file(path)))
        return here
    except Unavailable as failure:
        raise fault(
            "E406", at, f"the data set `{path}` is not available: {failure.reason}", help=failure.remedy
        ) from failure


def _download_data_of_region(shape: AnyShape, at: Location) -> AnyShape:
    """Return a plane region with its data set downloaded. Raises Fault if that fails."""
    from softmark.solvers.mesh.plane_region_files import FileSlice  # of no other scene

    if not isinstance(shape, FileSlice):
        return shape
    region: Any = shape.region
    here: AnyShape = replace(shape, region=download_shape(region, at))
    return here
