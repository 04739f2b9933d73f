"""Documentation page of words from other programs, with their name in this language or the closest alternative."""

from __future__ import annotations

from softmark.interpreter.documentation.docstring_markdown import escape_markup
from softmark.interpreter.documentation.word_reference import link_to_word
from softmark.interpreter.language import foreign_aliases, renamed_words
from softmark.interpreter.language.foreign_words import TABLE
from softmark.interpreter.validation.constructor_registry import CATALOGUE

SAME = "## Other names"
EARLIER = "## Earlier names\n\nSome words had other names before. `dsl fmt --upgrade FILE...` rewrites scenes."
ELSE = "## Not available\n\nEach entry gives the closest alternative, as messages do."


def page() -> str:
    """Return the page as Markdown: words with their names in other programs, then words without counterpart."""
    parts = [
        "# Words of other programs",
        SAME,
        ":::{container} words",
        *_synonym_rows(),
        ":::",
        EARLIER,
        *_renamed_word_rows(),
        ELSE,
        *_unavailable_rows(),
    ]
    return "\n\n".join(parts) + "\n"


def _synonym_rows() -> list[str]:
    found: dict[str, list[str]] = {}
    for table in (foreign_aliases.WORDS, foreign_aliases.SYNONYMS, foreign_aliases.CHOICES):
        for other, ours in table.items():
            found.setdefault(ours, []).append(other)
    return [
        f"{_own_word(word)}\n: {_join_words_as_code(dict.fromkeys(others))}" for word, others in sorted(found.items())
    ]


def _renamed_word_rows() -> list[str]:
    pairs = sorted(renamed_words.present_names().items(), key=lambda pair: pair[1])
    return [f"{_own_word(new)}\n: `{old}`" for old, new in pairs]


def _own_word(word: str) -> str:
    element = word in CATALOGUE.words()
    return link_to_word(word) or (f"{{word}}`{word}`" if element else f"`{word}`")


def _join_words_as_code(others: dict[str, None]) -> str:
    return ", ".join(f"`{other}`" for other in others)


def _unavailable_rows() -> list[str]:
    """Return the table rows of features that the language lacks: the advice, and the foreign words it applies to."""
    said: list[tuple[str, list[str]]] = []
    for line in TABLE.read_text(encoding="utf-8").splitlines():
        if line.startswith(" ") and said:
            said[-1][1].extend(line.split())
        elif line.strip():
            said.append((line, []))
    return [
        f"{escape_markup(_sentence(text), link_to_word)}\n: {_join_words_as_code(dict.fromkeys(words))}"
        for text, words in said
        if words
    ]


def _sentence(clause: str) -> str:
    return clause[:1].upper() + clause[1:] + "."
