"""Values of loads, supports and materials in one state of a static analysis, or at one time of a quasistatic one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Self

from softmark.interpreter.results.state_results import TimeState
from softmark.interpreter.vocabulary.amplitude_words import AtOneTime, PerState


def in_state_of_value(thing: Any, value: float) -> Any:
    """Return a load, support or material as it is in the state with this value.

    Without `amplitude = per_state` it is unchanged. If `value` is a time of a quasistatic analysis, the result is
    scaled by the amplitude at that time, and its `amplitude` (`AtOneTime`) keeps the original at full size.
    """
    if isinstance(value, TimeState):
        full, amplitude = thing, thing.amplitude
        if amplitude is None or isinstance(amplitude, PerState):  # validation refuses `amplitude = per_state` here
            return thing
        return replace(thing.part(amplitude.at(value)), amplitude=AtOneTime(full))
    return replace(thing.part(value), amplitude=None) if isinstance(thing.amplitude, PerState) else thing


def scale_field(thing: Any, field: str, share: float) -> Any:
    """Return a copy of an object with one field, a number or a vector, multiplied by `share`."""
    full = getattr(thing, field)
    less = share * full if isinstance(full, float) else tuple(share * v for v in full)
    return replace(thing, **{field: less})


class HasMaterial:
    """Base class of bodies and regions with a material, whose active stress may follow an amplitude."""

    material: Any

    def in_state(self, number: int, value: float) -> Self:
        """Return the body or region in one state of a static analysis, which has this number and value."""
        if getattr(self.material, "amplitude", None) is None:
            return self
        made: Self = replace(self, material=in_state_of_value(self.material, value))  # type: ignore[type-var]  # all are dataclasses
        return made
