"""`Written`: what an analysis finds is a value, and JSON at the door alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from softmark.interpreter.results.plain import Plain, clean
from softmark.records import dataclass

Json = Mapping[str, Any]  # an object as it stands in a file


@dataclass(frozen=True)
class Written(Plain):
    """What is written as JSON: its fields by name in their order, or what a class gives as its `entries` instead."""

    def entries(self) -> Mapping[str, object]:
        """What is written, by name; `from_` is written as `from`."""
        return {f.name.rstrip("_"): getattr(self, f.name) for f in fields(self)}

    def to_json(self) -> dict[str, Any]:
        """As plain values."""
        return {name: clean(value) for name, value in self.entries().items()}
