"""Words of mechanics, of medicine, of pictures and of other programs that are no words here, and what is nearest.

They are whole words, and no slips of the finger: `reaction` is never taken for `traction`, nor `cable` for `table`.
`foreign_words.txt` has what is said, and indented below it the words that it is said of. A word that means exactly what
one of ours does is in `aliases`. To add one: the word, below its line. Case, underscores and a plural's s do not count.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from pathlib import Path

from softmark.grammar.name_suggestions import nearest

TABLE = Path(__file__).with_name("foreign_words.txt")


def meaning(word: str) -> str | None:
    """What is nearest in meaning to a word of elsewhere, as a clause; None of any other word."""
    name = key(word)
    return meanings().get(name) or (meanings().get(name[:-1]) if name.endswith("s") else None)


def slip(word: str, candidates: Iterable[str]) -> str | None:
    """The one of several words of the language that a slip of the finger made this of; None of a word of elsewhere.

    Words of three letters are all near one another: of these two letters are swapped, or large.
    """
    close = nearest(word, candidates)
    if close is None or key(word) == key(close):
        return close
    short = len(word) < 4 and sorted(word.lower()) != sorted(close.lower())
    return None if short or meaning(word) else close


@cache
def meanings() -> dict[str, str]:
    """What is said of each word, by its `key`."""
    found, said = {}, ""
    for line in TABLE.read_text(encoding="utf-8").splitlines():
        if not line.startswith(" "):
            said = line
        else:
            found.update({key(word): said for word in line.split()})
    return found


def key(word: str) -> str:
    """A word as it is looked up: case and underscores do not count."""
    return word.lower().replace("_", "").replace("-", "")
