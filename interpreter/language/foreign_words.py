"""Words of mechanics, medicine, imaging and other programs that the language lacks, with an explanation of each.

Whole words are looked up before spelling is corrected: `reaction` is never read as `traction`, nor `cable` as `table`.
`foreign_words.txt` has each explanation with its words indented below it. A word that means exactly the same as a word
of the language belongs in `foreign_aliases`. To add a word, write it below its explanation. Case, underscores and a
plural s do not count.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from pathlib import Path

from softmark.grammar.name_suggestions import nearest

TABLE = Path(__file__).with_name("foreign_words.txt")


def explain_foreign_word(word: str) -> str | None:
    """Return the explanation of a foreign word as a clause, or None for any other word."""
    name = normalize_word(word)
    return load_foreign_words().get(name) or (load_foreign_words().get(name[:-1]) if name.endswith("s") else None)


def find_misspelling(word: str, candidates: Iterable[str]) -> str | None:
    """Return the candidate of which a word is a misspelling, or None; foreign words do not count as misspellings.

    Words of three letters are all similar, so only a swap of two letters or a change of case counts for them.
    """
    close = nearest(word, candidates)
    if close is None or normalize_word(word) == normalize_word(close):
        return close
    short = len(word) < 4 and sorted(word.lower()) != sorted(close.lower())
    return None if short or explain_foreign_word(word) else close


@cache
def load_foreign_words() -> dict[str, str]:
    """Return the explanation of each foreign word, by its normalized form."""
    found, said = {}, ""
    for line in TABLE.read_text(encoding="utf-8").splitlines():
        if not line.startswith(" "):
            said = line
        else:
            found.update({normalize_word(word): said for word in line.split()})
    return found


def normalize_word(word: str) -> str:
    """Return a word in the form used for look-up: case and underscores do not count."""
    return word.lower().replace("_", "").replace("-", "")
