"""Keyword files of Abaqus and CalculiX: cards, with those of *INCLUDE in their place.

A card is a line `*KEYWORD, OPTION=VALUE` and the lines of data below it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from softmark.interpreter.models.results.readers.trees import within
from softmark.references.measured import Unreadable

DEEP = 10  # files that include each other
_WHOLE = re.compile(r"[+-]?[0-9]{1,12}")
AGAIN = "write the deck again: it may be cut off"


@dataclass(frozen=True)
class Card:
    """A keyword in upper case, its options, the words of the lines below it, and its place."""

    keyword: str
    options: dict[str, str]
    rows: list[list[str]]
    line: int
    file: str


def cards(path: Path) -> Iterator[Card]:
    """Those of a file. Raises Unreadable."""
    yield from _cards(path, path.parent.resolve(), (path.resolve(),))


def _cards(path: Path, home: Path, above: tuple[Path, ...]) -> Iterator[Card]:
    for card in _of_text(path.read_bytes(), path.name):
        if card.keyword != "INCLUDE":
            yield card
            continue
        told = card.options.get("INPUT", "")
        inner = within(f"{card.file}:{card.line}", home, told)
        if inner in above or len(above) >= DEEP:
            why = "it includes itself" if inner in above else f"its files include each other more than {DEEP} deep"
            raise Unreadable(f"{card.file}:{card.line}", why, "write one file")
        yield from _cards(inner, home, (*above, inner))


def _of_text(data: bytes, name: str) -> Iterator[Card]:
    if b"\0" in data:
        raise Unreadable(name, "it is no text", AGAIN)
    card: Card | None = None
    open_line = False  # a line of a keyword that ends with a comma goes on below
    for number, line in enumerate(data.decode("utf-8-sig", errors="replace").splitlines(), start=1):
        words = [w.strip() for w in line.split(",")]
        if line.startswith("**") or not line.strip():
            continue
        if line.startswith("*") or (open_line and card is not None):
            if line.startswith("*"):
                if card is not None:
                    yield card
                card = Card(" ".join(words[0][1:].upper().split()), {}, [], number, name)
                words = words[1:]
            card.options.update(map(_option, filter(None, words)))  # type: ignore[union-attr]
            open_line = line.rstrip().endswith(",")
        elif card is None:
            raise Unreadable(f"{name}:{number}", "numbers stand before the first keyword, which begins with `*`", AGAIN)
        else:
            card.rows.append(words)
    if card is not None:
        yield card


def _option(word: str) -> tuple[str, str]:
    name, _, value = word.partition("=")
    return " ".join(name.upper().split()), value.strip().strip('"')


def whole(word: str, card: Card) -> int:
    """A whole number. Raises Unreadable."""
    if _WHOLE.fullmatch(word) is None:
        raise Unreadable(f"{card.file}:{card.line}", f"`{word[:40]}` is no whole number", AGAIN)
    return int(word)


def number(word: str, card: Card) -> float:
    """A finite number, with an exponent of Fortran's if it has one. Raises Unreadable."""
    try:
        value = float(word.upper().replace("D", "E")) if "_" not in word else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise Unreadable(f"{card.file}:{card.line}", f"`{word[:40]}` is no finite number", AGAIN)
    return value
