"""The nearest of several names, for `did you mean`."""

from __future__ import annotations

from collections.abc import Iterable


def nearest(word: str, candidates: Iterable[str]) -> str | None:
    """The candidate that a slip of the finger makes of `word`, or None; case counts little."""
    limit = max(1, min(3, len(word) // 3 + 1))
    scored = [(distance(word.lower(), c.lower()), c != word, c) for c in candidates if abs(len(c) - len(word)) <= limit]
    best = min(scored, default=None)
    return best[2] if best is not None and best[0] <= limit else None


def distance(a: str, b: str) -> int:
    """Insertions, deletions, replacements and swaps of neighbours from `a` to `b` (Damerau 1964)."""
    before: list[int] = []
    row = list(range(len(b) + 1))
    for i, p in enumerate(a, 1):
        older, before, row = before, row, [i]
        for j, q in enumerate(b, 1):
            best = min(before[j] + 1, row[j - 1] + 1, before[j - 1] + (p != q))
            if i > 1 and j > 1 and p == b[j - 2] and a[i - 2] == q:
                best = min(best, older[j - 2] + 1)
            row.append(best)
    return row[-1]
