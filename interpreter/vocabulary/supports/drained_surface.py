"""Supports of the pore fluid of a `biphasic` body: their base class, and free drainage."""

from __future__ import annotations

from typing import Annotated, Any

from softmark.interpreter.vocabulary.supports.support import OFF_NODES, Support
from softmark.records import dataclass


class Drain(Support):
    """Support that prescribes the pore pressure on a part of the surface of a porous body; its points move freely."""

    role = "drain"
    export_fault = OFF_NODES
    components = ()
    body: str
    where: Any

    @property
    def pressure(self) -> float:
        """Prescribed pore pressure at full size, Pa."""
        return 0.0


@dataclass(frozen=True)
class Drained(Drain):
    """Free drainage of a `biphasic` body: fluid crosses the selected surface freely, with pore pressure 0.

    Surfaces without such a support are sealed. It does not hold the solid in place: a porous plate that carries a load
    needs that load declared as well. `outflow(NAME)` is the fluid volume that has left through it. An edge that two of
    these supports share belongs to the first.
    """

    body: Annotated[str, "body", "biphasic body"]
    where: Annotated[Any, "condition", "part of its surface, by undeformed coordinates"]
