"""What a model states of its own answer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import ClassVar

from softmark.interpreter.results.json_records import Plain
from softmark.records import dataclass


@dataclass(frozen=True)
class StatedError(Plain):
    """The error that a model states of one thing: the sum of its parts, or None with the reason why there is none.

    `doubts` are codes of warnings by which it says that its answer may be off.
    """

    SELDOM: ClassVar[tuple[str, ...]] = ("unit",)
    READ: ClassVar = {"doubts": tuple}

    value: float | None = None
    unit: str | None = None  # None: that of the metric, or 1
    parts: Mapping[str, float | None] = field(default_factory=dict)
    reason: str | None = None
    doubts: tuple[str, ...] = ()
