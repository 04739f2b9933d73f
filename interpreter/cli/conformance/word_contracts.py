"""Contracts of the classes of all words, whatever their kind."""

from __future__ import annotations

import dataclasses
import pickle
from collections.abc import Iterator
from typing import Any, get_type_hints

from softmark.interpreter.cli.conformance import Breach
from softmark.interpreter.help.word_pages import constructor_page
from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.language.field_schema import Constructor, Field, _fields_of_class

LONGEST = 120  # characters of the first line of a docstring, which `dsl list` shows


def word_breaches(cls: type[Any], kind: str, name: str) -> Iterator[Breach]:
    """Yield breaches of the class of a word: it must be documented, frozen, annotated and explained."""
    first = (cls.__doc__ or "").strip().split("\n")[0]
    if not 10 <= len(first) <= LONGEST or not first[0].isupper() or not first.endswith("."):
        yield Breach(f"the first line of its docstring is {first!r}", f"write a sentence of 10 to {LONGEST} "
                                                                      "characters, which `dsl list` shows")  # fmt: skip
    if not dataclasses.is_dataclass(cls) or not cls.__dataclass_params__.frozen:  # type: ignore[attr-defined]
        yield Breach("it is not a frozen dataclass", "write `@dataclass(frozen=True)` above it")
        return
    hints = get_type_hints(cls, include_extras=True)
    own = [f for f in dataclasses.fields(cls) if f.init]  # others follow from these
    for f in own:
        if not getattr(hints[f.name], "__metadata__", None):
            yield Breach(f"the field `{f.name}` has neither a unit nor a meaning",
                         'annotate it: `Annotated[float, "m in (0, inf)", "what it means"]`')  # fmt: skip
    word = Constructor(name, kind, cls, _fields_of_class(cls))
    for field in word.fields:
        yield from _field_breaches(field)
    page = constructor_page(word)
    if first not in page or not all(field.doc in page for field in word.fields):
        yield Breach(
            "`dsl explain` does not show all of it",
            "write a docstring, and give each field a meaning: they form the page",
        )


def _field_breaches(field: Field) -> Iterator[Breach]:
    if len(field.doc) <= 3 or field.doc.endswith("."):
        yield Breach(f"the meaning of `{field.name}` is {field.doc!r}", "write a phrase, not a sentence")
    number = isinstance(field.default, int | float) and not isinstance(field.default, bool)
    if field.interval is not None and number and field.default not in field.interval:
        yield Breach(
            f"the default of `{field.name}`, {field.default}, is outside its range", "give a default in the range"
        )
    chosen = field.form == "choice" and not field.required and field.default is not None
    if chosen and field.default not in field.options:
        yield Breach(f"the default of `{field.name}`, {field.default}, is not one of its options", "name one of them")


def repr_breaches(thing: Any) -> Iterator[Breach]:
    """Yield breaches of the repr of a declared object.

    The repr must depend only on the field values, because it is part of the key of saved results.
    """
    if " at 0x" in repr(thing):
        yield Breach(
            f"its text contains an address in memory: {repr(thing)[:80]}",
            "use fields with values that print themselves",
        )
    conditions = any(isinstance(getattr(thing, f.name), Condition) for f in dataclasses.fields(thing))
    try:
        if not conditions and pickle.loads(pickle.dumps(thing)) != thing:  # other processes read conditions anew
            yield Breach("it changes when it is pickled", "use fields with values that compare as equal")
    except Exception as error:
        yield Breach(f"it cannot be pickled ({error})", "define classes at the top level of the file")
    if hash(thing) != hash(dataclasses.replace(thing)):
        yield Breach("a copy of it has another hash", "use values that cannot be changed, tuples instead of lists")
