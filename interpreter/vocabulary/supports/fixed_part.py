"""Support that fixes a part of a body."""

from __future__ import annotations

from typing import Annotated, Any

from softmark.interpreter.vocabulary.supports.support import UniformSupport
from softmark.records import dataclass


@dataclass(frozen=True)
class Fixed(UniformSupport):
    """Fixes the selected part of a body.

    `components` chooses the directions; by default all three are fixed. A beam model applies the support to its rigid
    cross-sections: a clamp over a whole section also fixes its rotation.
    """

    body: Annotated[str, "body", "body that is held"]
    where: Annotated[Any, "condition", "selected points, by undeformed coordinates"]
    components: Annotated[tuple[int, ...], "components", "directions that are fixed"] = (0, 1, 2)
