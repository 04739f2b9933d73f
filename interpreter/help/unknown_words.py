"""Hints about names that do not exist in the language."""

from __future__ import annotations

import re

from softmark.interpreter.help.reserved_words import CALLS, PLAIN, RESERVED
from softmark.interpreter.language import foreign_aliases, units
from softmark.interpreter.language.foreign_words import explain_foreign_word, find_misspelling
from softmark.interpreter.validation.constructor_registry import CATALOGUE


def hint(name: str) -> str:
    """Return advice about an unknown name: the word probably meant, or the command that lists words."""
    if name in foreign_aliases.MODULI:
        return f"laws take `young` and `poisson`: {foreign_aliases.MODULI[name]}"
    if said := explain_foreign_word(name) or _unit_hint(name):
        return said
    close = find_misspelling(name, _known_names()) if len(name) > 1 else None
    return f"did you mean `{close}`?" if close else "`dsl list` shows all words"


def _known_names() -> list[str]:
    kinds = CATALOGUE
    made = [c for kind, table in kinds.items() for n in table if (c := kinds.constructor(kind, n))]
    words = [*kinds, *(c.name for c in made), *(f.name for c in made for f in c.fields), *kinds.words()]
    return [*words, *RESERVED, *CALLS, *PLAIN]


def _unit_hint(name: str) -> str:
    """Return a hint to the correct spelling of a unit, such as `did you mean `MPa`?`."""
    try:
        units.parse_unit(name)
    except units.UnitError as error:
        meant = re.search(r"write (`\S+`)", error.remedy)
        return f"did you mean {meant[1]}?" if meant else ""
    return ""
