"""Error estimates that models state for their own results."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import ClassVar

from softmark.interpreter.results.json_records import JsonRecord
from softmark.records import dataclass


@dataclass(frozen=True)
class StatedError(JsonRecord):
    """Error that a model states for one quantity: the sum of its parts, or None with the reason.

    `doubts` are the codes of warnings that the result may be inaccurate.
    """

    SELDOM: ClassVar[tuple[str, ...]] = ("unit",)
    READ: ClassVar = {"doubts": tuple}

    value: float | None = None
    unit: str | None = None  # None: that of the metric, or 1
    parts: Mapping[str, float | None] = field(default_factory=dict)
    reason: str | None = None
    doubts: tuple[str, ...] = ()
