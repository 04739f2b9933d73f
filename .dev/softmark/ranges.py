"""Ranges of numbers in the annotations of fields, such as `Pa in (0, inf)`; a round bracket excludes its end."""

from __future__ import annotations

import re

from softmark.records import dataclass

TYPE_CHECKING = False  # as in `typing`, which every start of `dsl` would otherwise import
if TYPE_CHECKING:
    from typing import Self

_WRITTEN = re.compile(r"in ([(\[])(\S+), (\S+)([)\]])$")


@dataclass(frozen=True)
class Range:
    """Range from low to high, with open or closed ends."""

    low: float
    high: float
    low_open: bool
    high_open: bool

    @classmethod
    def read(cls, text: str) -> Self | None:
        """Return the range at the end of an annotation; None if the annotation has no range."""
        found = _WRITTEN.search(text)
        if found is None:
            return None
        return cls(float(found[2]), float(found[3]), found[1] == "(", found[4] == ")")

    def __contains__(self, value: float) -> bool:
        above = value > self.low if self.low_open else value >= self.low
        return above and (value < self.high if self.high_open else value <= self.high)


class InvalidCombination(ValueError):
    """Error for values that are each in range, but invalid together; it names the field to change and the remedy."""

    def __init__(self, field: str, problem: str, short: str, remedy: str) -> None:
        super().__init__(f"{problem}: {remedy}")
        self.field, self.problem, self.short, self.remedy = field, problem, short, remedy
