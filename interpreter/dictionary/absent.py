"""What is said of a name that the language does not have."""

from __future__ import annotations

import re

from softmark.grammar.suggest import distance, nearest
from softmark.interpreter.dictionary.plain import CALLS, PLAIN, RESERVED
from softmark.interpreter.front.catalogue import CATALOGUE
from softmark.interpreter.language import aliases, units

_SOLIDS = "bodies are elastic solids, computed as such, as springs or as beams"
_APART = "a `contact` keeps bodies apart: `between(RIGID, BODY)`, `itself(BODY)`"
ABSENT = {  # what people look for and is not here, under this name or any other
    "collision": _APART,
    "roller": "`fixed(body, where = ..., components = z)` lets a part slide",
    "viscosity": "`damping_mass` and `damping_stiffness` of `dynamic` damp a motion", "fluid": _SOLIDS,
    "shell": _SOLIDS, "plate": _SOLIDS, "membrane": _SOLIDS, "cable": _SOLIDS, "rope": _SOLIDS, "heat": _SOLIDS,
    "temperature": _SOLIDS, "diameter": "`radius` is half of it", "held": "`fixed` holds a part of a body",
    "totalmass": "`density` is mass divided by volume", "total_mass": "`density` is mass divided by volume",
}  # fmt: skip


def hint(name: str) -> str:
    """What is to be done about a name that there is no page of: the word that is meant, or where words are listed."""
    close = _slip(name)
    said = ABSENT.get(name.lower()) or (f"did you mean `{close}`?" if close else _meant_unit(name))
    return said or "`dsl list` shows what there is"


def _slip(name: str) -> str | None:
    """The word that a slip of the finger made this of: of another word of the language, or of another, it may be far.

    Short words are all near one another, and words that begin otherwise are mostly other words.
    """
    close = nearest(name, _names())
    if close is None or len(name) < 4:
        return close if close is not None and close.lower() == name.lower() else None
    slips = distance(name.lower(), close.lower())
    alike = name[:1].lower() == close[:1].lower()
    return close if slips <= (1 if len(name) < 10 else 2) and (alike or len(name) > 6) else None


def _names() -> list[str]:
    kinds = CATALOGUE
    words = [*kinds, *(n for table in kinds.values() for n in table), *CATALOGUE.words(), *aliases.WORDS]
    return [*words, *RESERVED, *CALLS, *PLAIN]


def _meant_unit(name: str) -> str:
    """The unit that is written in another way here: `did you mean `MPa`?`."""
    try:
        units.parse(name)
    except units.UnitError as error:
        meant = re.search(r"write (`\S+`)", error.remedy)
        return f"did you mean {meant[1]}?" if meant else ""
    return ""
