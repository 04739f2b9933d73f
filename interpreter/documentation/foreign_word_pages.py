"""Words of other programs: what they are called here, or what is nearest in meaning where the thing is not here."""

from __future__ import annotations

from softmark.interpreter.documentation.docstring_markdown import escaped
from softmark.interpreter.documentation.word_reference import linked
from softmark.interpreter.language import foreign_aliases
from softmark.interpreter.language.foreign_words import TABLE
from softmark.interpreter.validation.constructor_registry import CATALOGUE

SAME = "## Called otherwise"
ELSE = "## Not here\n\nWhat is nearest in meaning is said of each, as messages say it too."


def page() -> str:
    """The page: ours with the words of others for it, then words for what is not here."""
    parts = ["# Words of other programs", SAME, ":::{container} words", *_called_otherwise(), ":::", ELSE, *_not_here()]
    return "\n\n".join(parts) + "\n"


def _called_otherwise() -> list[str]:
    found: dict[str, list[str]] = {}
    for table in (foreign_aliases.WORDS, foreign_aliases.SYNONYMS, foreign_aliases.CHOICES):
        for other, ours in table.items():
            found.setdefault(ours, []).append(other)
    return [f"{_ours(word)}\n: {_listed(dict.fromkeys(others))}" for word, others in sorted(found.items())]


def _ours(word: str) -> str:
    element = word in CATALOGUE.words()
    return linked(word) or (f"{{word}}`{word}`" if element else f"`{word}`")


def _listed(others: dict[str, None]) -> str:
    return ", ".join(f"`{other}`" for other in others)


def _not_here() -> list[str]:
    """The blocks of the table: what is said, and the words that it is said of."""
    said: list[tuple[str, list[str]]] = []
    for line in TABLE.read_text(encoding="utf-8").splitlines():
        if line.startswith(" ") and said:
            said[-1][1].extend(line.split())
        elif line.strip():
            said.append((line, []))
    return [f"{escaped(_sentence(text), linked)}\n: {_listed(dict.fromkeys(words))}" for text, words in said if words]


def _sentence(clause: str) -> str:
    return clause[:1].upper() + clause[1:] + "."
