"""Conversion of records (dataclasses) to plain JSON values and back."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields
from typing import Any, ClassVar, Self

Json = Mapping[str, Any]  # JSON object as read from a file


def to_plain_json(value: Any) -> Any:
    """Return records, numpy values and their containers as plain JSON values; non-finite numbers become None."""
    if isinstance(value, Mapping):
        return {str(k): to_plain_json(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [to_plain_json(v) for v in value]
    if isinstance(value, JsonRecord):
        return value.to_json()
    if hasattr(value, "tolist"):  # of numpy, which is not imported for it
        return to_plain_json(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value


def list_reader(read: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return a function that reads a JSON list, given the function that reads its items."""
    return lambda values: tuple(map(read, values))


def mapping_reader(read: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return a function that reads a JSON object, given the function that reads its values."""
    return lambda values: {name: read(value) for name, value in values.items()}


class JsonRecord:
    """Dataclass whose fields are the entries of a JSON object, in their order.

    `READ` has readers for entries that need conversion, `NAMED` the JSON names that differ from field names, and
    `SELDOM` the fields that are left out if they are None, False or (). A class with another form overrides `entries`.
    """

    READ: ClassVar[Mapping[str, Callable[[Any], Any]]] = {}
    NAMED: ClassVar[Mapping[str, str]] = {}
    SELDOM: ClassVar[tuple[str, ...]] = ()

    def entries(self) -> Mapping[str, object]:
        """Return the values to write, by JSON name."""
        own = {f.name: getattr(self, f.name) for f in fields(self)}  # type: ignore[arg-type]
        said = {n: v for n, v in own.items() if n not in self.SELDOM or not (v is None or v is False or v == ())}
        return {self.NAMED.get(n, n): v for n, v in said.items()}

    def to_json(self) -> dict[str, Any]:
        """Return the entries as plain JSON values."""
        return {name: to_plain_json(value) for name, value in self.entries().items()}

    @classmethod
    def from_json(cls, values: Json) -> Self:
        """Return the record with these JSON entries.

        A missing or null entry gets its default; an unknown entry is ignored.
        """
        found = {}
        for f in fields(cls):  # type: ignore[arg-type]
            value = values.get(cls.NAMED.get(f.name, f.name))
            if value is not None:
                found[f.name] = cls.READ[f.name](value) if f.name in cls.READ else value
            elif f.default is MISSING and f.default_factory is MISSING:
                found[f.name] = None
        return cls(**found)
