"""Support that moves a part of a body by one vector."""

from __future__ import annotations

from typing import Annotated, Any

from softmark.interpreter.vocabulary.supports.support import UniformSupport, Vector3, VectorMotion
from softmark.records import dataclass


@dataclass(frozen=True)
class Displaced(VectorMotion, UniformSupport):
    """Moves the selected part of a body by a given vector; directions not listed in `components` stay free."""

    moves = True

    body: Annotated[str, "body", "body that is moved"]
    where: Annotated[Any, "condition", "selected points, by undeformed coordinates"]
    by: Annotated[Vector3, "m", "displacement at full load"]
    components: Annotated[tuple[int, ...], "components", "directions in which displacements are imposed"] = (0, 1, 2)
    amplitude: Annotated[
        Any | None,
        "amplitude",
        "amplitude over time or from state to state; default: full motion from the start",
    ] = None
