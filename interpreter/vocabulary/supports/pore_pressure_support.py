"""Support that prescribes the pore pressure on a part of the surface."""

from __future__ import annotations

from typing import Annotated, Any, Self

from softmark.interpreter.vocabulary.supports.drained_surface import Drain
from softmark.interpreter.vocabulary.values_in_states import scale_field
from softmark.records import dataclass


@dataclass(frozen=True)
class PorePressure(Drain):
    """Prescribes the pore pressure on a part of the surface of a `biphasic` body, as a bath, pump or column does.

    The pressure is relative to the surrounding air; fluid enters or leaves as needed. It acts only on the fluid: the
    pressure of a bath on the solid is a load, `pressure(...)` of the same size. `outflow(NAME)` is the fluid volume
    that has left through it.
    """

    moves = True

    body: Annotated[str, "body", "biphasic body"]
    where: Annotated[Any, "condition", "part of its surface, by undeformed coordinates"]
    value: Annotated[float, "Pa", "pore pressure at full size"]
    amplitude: Annotated[Any | None, "amplitude", "amplitude over time; default: full pressure from the start"] = None

    @property
    def pressure(self) -> float:
        """Prescribed pore pressure at full size, Pa."""
        return self.value

    def part(self, share: float) -> Self:
        """Return the support with its pressure scaled to the fraction `share`."""
        less: Self = scale_field(self, "value", share)
        return less
