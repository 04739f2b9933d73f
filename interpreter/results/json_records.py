"""Records as JSON: the one way in and the one way out, so that what lies between has its fields by name."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields
from typing import Any, ClassVar, Self

Json = Mapping[str, Any]  # an object as it stands in a file


def clean(value: Any) -> Any:
    """Plain JSON of records, of numpy's values, and of whatever holds some; None for a number that is not finite."""
    if isinstance(value, Mapping):
        return {str(k): clean(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [clean(v) for v in value]
    if isinstance(value, Plain):
        return value.to_json()
    if hasattr(value, "tolist"):  # of numpy, which is not imported for it
        return clean(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value


def several(read: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Reads a list of what one reader reads."""
    return lambda values: tuple(map(read, values))


def by_name(read: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Reads an object of what one reader reads."""
    return lambda values: {name: read(value) for name, value in values.items()}


class Plain:
    """A dataclass whose fields are the entries of a JSON object, in their order.

    `READ` has what makes more of an entry than JSON has, `NAMED` the entries that are called otherwise than their
    field, and `SELDOM` the fields that are left out where they are None, False or (). What is written otherwise has
    `entries` of its own.
    """

    READ: ClassVar[Mapping[str, Callable[[Any], Any]]] = {}
    NAMED: ClassVar[Mapping[str, str]] = {}
    SELDOM: ClassVar[tuple[str, ...]] = ()

    def entries(self) -> Mapping[str, object]:
        """What is written, by name."""
        own = {f.name: getattr(self, f.name) for f in fields(self)}  # type: ignore[arg-type]
        said = {n: v for n, v in own.items() if n not in self.SELDOM or not (v is None or v is False or v == ())}
        return {self.NAMED.get(n, n): v for n, v in said.items()}

    def to_json(self) -> dict[str, Any]:
        """Its entries as plain values."""
        return {name: clean(value) for name, value in self.entries().items()}

    @classmethod
    def from_json(cls, values: Json) -> Self:
        """From its entries: one that is missing or null is as usual, one that is not known is passed over."""
        found = {}
        for f in fields(cls):  # type: ignore[arg-type]
            value = values.get(cls.NAMED.get(f.name, f.name))
            if value is not None:
                found[f.name] = cls.READ[f.name](value) if f.name in cls.READ else value
            elif f.default is MISSING and f.default_factory is MISSING:
                found[f.name] = None
        return cls(**found)
