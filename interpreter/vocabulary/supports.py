"""Supports: where a body is held, or moved by a given amount."""

from __future__ import annotations

from typing import Annotated, Any

from softmark.records import dataclass

Vector3 = tuple[float, float, float]


@dataclass(frozen=True)
class Fixed:
    """Holds the selected part of a body where it is.

    `components` chooses what is held; without it all three are. A beam model turns the condition into its rigid
    cross-section: a clamp over a whole section holds its rotation as well.
    """

    body: Annotated[str, "body", "the body that is held"]
    where: Annotated[Any, "condition", "which of its points, by their coordinates before deformation"]
    components: Annotated[tuple[int, ...], "components", "directions in which they are held"] = (0, 1, 2)


@dataclass(frozen=True)
class Displaced:
    """Moves the selected part of a body by a given vector; components that are not named stay free."""

    body: Annotated[str, "body", "the body that is moved"]
    where: Annotated[Any, "condition", "which of its points, by their coordinates before deformation"]
    by: Annotated[Vector3, "m", "displacement at full load"]
    components: Annotated[tuple[int, ...], "components", "directions in which it is imposed"] = (0, 1, 2)
    course: Annotated[Any | None, "course", "how it moves in a dynamic analysis; at once without"] = None


@dataclass(frozen=True)
class Follows:
    """Moves the selected part of a body as tracked points moved in an experiment.

    Between the points their displacements are interpolated by thin plate splines (Duchon 1977) that pass through them,
    and beyond the outermost ones extrapolated. Points of one layer, a tenth as thick as wide or less, are taken to lie
    in its plane: what changes across the layer is not followed. Only points near the selected part count: those within
    `reach` of it. In a solid model every node of the selected part is moved.
    """

    body: Annotated[str, "body", "the body that is moved"]
    where: Annotated[Any, "condition", "which of its points, by their coordinates before deformation"]
    of: Annotated[str, "reference", "the measurement: a reference of tracked points"]
    reach: Annotated[float, "m in (0, inf)", "how far from the selected part a tracked point may lie"]
    components: Annotated[tuple[int, ...], "components", "directions in which it is imposed"] = (0, 1, 2)
