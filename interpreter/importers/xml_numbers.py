"""Numbers and node sets in XML files of decks."""

from __future__ import annotations

import numpy as np

from softmark.interpreter.importers.imported_deck import Floats, Ints
from softmark.interpreter.models.imported_results.readers.result_frames import AGAIN
from softmark.interpreter.models.imported_results.readers.xml_trees import ElementT
from softmark.references.measured_data import Unreadable

LARGEST = 1 << 40  # largest number of a node


class NumberParser:
    """Parser of the numbers in one file; messages name the file."""

    def __init__(self, name: str) -> None:
        self.name = name

    def unreadable_error(self, reason: str) -> Unreadable:
        """Return the exception for an error in the file."""
        return Unreadable(self.name, reason, AGAIN)

    def floats(self, text: str | None, count: int | None = None) -> Floats:
        """Return finite numbers separated by commas or blanks, `count` of them if given. Raises Unreadable."""
        words = (text or "").replace(",", " ").split()
        try:
            if "_" in (text or ""):
                raise ValueError
            found: Floats = np.array(words, dtype=np.float64)
        except ValueError:
            raise self.unreadable_error(f"`{(text or '').strip()[:40]}` are not numbers") from None
        if not np.isfinite(found).all() or (count is not None and len(found) != count):
            raise self.unreadable_error(f"`{(text or '').strip()[:40]}` are not {count or 'finite'} numbers")
        return found

    def number(self, text: str | None) -> float:
        """Return one finite number. Raises Unreadable."""
        return float(self.floats(text, 1)[0])

    def wholes(self, text: str | None) -> Ints:
        """Return whole numbers >= 0. Raises Unreadable."""
        found = self.floats(text)
        if (found != np.floor(found)).any() or (np.abs(found) > LARGEST).any() or (found < 0).any():
            raise self.unreadable_error(f"`{(text or '').strip()[:40]}` are not whole numbers")
        return found.astype(np.int64)

    def whole(self, text: str | None) -> int:
        """Return one whole number >= 0. Raises Unreadable."""
        found = self.wholes(text)
        if len(found) != 1:
            raise self.unreadable_error(f"`{(text or '').strip()[:40]}` is not a whole number")
        return int(found[0])


def child_text(node: ElementT | None, tag: str) -> str | None:
    """Return the text of the first child element with a name."""
    own = None if node is None else node.find(tag)
    return None if own is None else (own.text or "")
