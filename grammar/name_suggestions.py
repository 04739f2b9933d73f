"""Search for the name most similar to a misspelt one, for the hint `did you mean`."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from itertools import islice

MOST = 3000  # largest number of candidates compared: a text may declare any number of names


def nearest(word: str, candidates: Iterable[str]) -> str | None:
    """Return the candidate that differs from `word` by a typing error, or None; case is ignored.

    One error is allowed from three letters, two from six, three from eleven, because short names are all similar. If
    there are two errors, or the word is short, both must begin alike: `cable` is not `table`, `reaction` not
    `traction`. Among equally similar candidates, one that starts like `word` wins, then the alphabetically first.
    """
    limit = sum(len(word) >= letters for letters in (3, 6, 11))
    near = islice((name for name in candidates if abs(len(name) - len(word)) <= limit), MOST)
    scored = [(distance(word.lower(), name.lower(), limit), name[:1] != word[:1], name) for name in near]
    sure = [one for one in scored if one[0] <= (1 if len(word) > 6 else 0) or _begins_alike(word, one[2])]
    slips, _, name = min(sure, default=(limit + 1, True, ""))
    return name if slips <= limit else None


def _begins_alike(word: str, name: str) -> bool:
    """Return whether both words have the same first letter, or the same first two letters swapped."""
    a, b = word[:2].lower(), name[:2].lower()
    return a[:1] == b[:1] or (len(a) == 2 and a == b[::-1])


def distance(a: str, b: str, most: int = sys.maxsize) -> int:
    """Return the number of insertions, deletions, replacements and swaps from `a` to `b`.

    Counting stops above `most`; the result is then some number above it.
    Source: Damerau 1964.
    """
    before: list[int] = []
    row = list(range(len(b) + 1))
    for i, p in enumerate(a, 1):
        older, before, row = before, row, [i]
        for j, q in enumerate(b, 1):
            best = min(before[j] + 1, row[j - 1] + 1, before[j - 1] + (p != q))
            if i > 1 and j > 1 and p == b[j - 2] and a[i - 2] == q:
                best = min(best, older[j - 2] + 1)
            row.append(best)
        if min(row) > most and min(before) > most:  # no later row can be lower than the two before it
            return most + 1
    return row[-1]
