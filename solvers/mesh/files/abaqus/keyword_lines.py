"""Keyword cards of a deck, with their options and data lines; *INCLUDE files are inserted where they are named.

A card is a line `*KEYWORD, OPTION=VALUE` and the data lines below it. Case and blanks of keywords do not matter.
Source: Abaqus Analysis User's Guide, "Input syntax rules"; Dhondt, "CalculiX CrunchiX User's Manual", version 2.20.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import field
from pathlib import Path
from typing import Any

from softmark.records import dataclass
from softmark.safe_files import path_within, read_regular
from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh

DEPTH = 10  # largest depth of nested included files
REPEATED = 1 << 24  # largest number of bytes in files that are included again
FROM_FILES = frozenset({"NODE", "ELEMENT", "NSET", "ELSET"})  # their data lines may be in the file that INPUT names
SHORTEST = 3  # least number of letters of an abbreviated option
_WHOLE = re.compile(r"[+-]?[0-9]{1,12}")
_WORD = re.compile(r'(?:[^,"]|"[^"]*"?)+|(?<=,)(?=,)|^(?=,)|(?<=,)$')
AGAIN = "export the deck again: it may be incomplete"


class DeckError(UnreadableMesh):
    """Raised if a deck cannot be read; has the `place` (file and line), the `reason` and a `remedy`."""

    def __init__(self, place: str, reason: str, remedy: str) -> None:
        super().__init__(f"{place}: {reason}", remedy=remedy)
        self.place, self.reason = place, reason


class UnsupportedDeck(DeckError):
    """Raised for a valid deck that defines its mesh in a way that is not supported."""


@dataclass(frozen=True)
class Card:
    """One keyword card: a keyword with its options and data lines.

    `keyword` and the names of options are in upper case without blanks. `title` is the keyword as shown in messages.
    """

    keyword: str
    title: str
    file: str
    line: int
    options: dict[str, str] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)
    scope: Any = None  # the part, instance or assembly (deck_scopes.py) that contains it, if known

    @property
    def place(self) -> str:
        """File and line of the keyword, as text for messages."""
        return f"{self.file}:{self.line}"

    def each_row(self) -> Iterator[list[str]]:
        """Yield the words of each data line, without empty words at the end of the line."""
        for line in self.lines:
            yield _drop_trailing_blanks(split_words(line))

    @property
    def rows(self) -> list[list[str]]:
        """The words of all data lines."""
        return list(self.each_row())

    def unknown_options(self, known: frozenset[str]) -> list[str]:
        """Return the options of the card that are not in `known`."""
        return [name for name in self.options if name not in known]

    def error(self, reason: str, remedy: str = AGAIN) -> DeckError:
        """Return an error that names the file and line of this card."""
        return DeckError(self.place, reason, remedy)


def read_cards(path: Path) -> Iterator[Card]:
    """Yield the cards of a deck. Raises DeckError."""
    home = path.parent.resolve()
    source = _Source(home)
    card: Card | None = None
    open_line = False  # a keyword line that ends with a comma goes on below
    for text, number, file in source.lines_of(path):
        if text.startswith("*") or (open_line and card is not None):
            words = split_words(text)
            if text.startswith("*"):
                if card is not None:
                    yield _with_input_lines(card, source)
                title = " ".join(words[0][1:].upper().split())
                card = Card("".join(title.split()), f"*{title}", file, number)
                words = words[1:]
            assert card is not None
            card.options.update(_parse_option(word) for word in words if word)
            open_line = text.endswith(",")
        elif card is not None:
            card.lines.append(text)
        elif text[0].isdigit():  # other words before the first keyword are comments to CalculiX
            raise DeckError(f"{file}:{number}", "there is data before the first keyword, which begins with "
                                                "`*`",
                            "name an Abaqus or CalculiX deck")  # fmt: skip
    if card is None:
        raise DeckError(path.name, "it has no keyword, a line that begins with `*`",
                        "name an Abaqus or CalculiX deck")  # fmt: skip
    yield _with_input_lines(card, source)


def _with_input_lines(card: Card, source: _Source) -> Card:
    """Return the card with the data lines of the file that its option INPUT names, if it has this option.

    The card is changed in place.
    """
    if card.keyword in FROM_FILES and "INPUT" in card.options:
        place = card.place
        inner = resolve_included(place, source.home, card.options.pop("INPUT"))
        card.lines.extend(text for text, _, _ in source.lines_of(inner, place))
    return card


def resolve_included(place: str, folder: Path, told: str) -> Path:
    """Return the path of a file that a deck includes. Raises DeckError.

    It must be a regular file in the folder of the deck or below. `told` is its name in the deck.
    """
    shown = told if len(told) < 80 else f"{told[:80]}..."
    remedy = "put the included file into the deck's folder, and write its path relative to that folder"
    if not told:
        raise DeckError(place, "it includes no file", remedy)
    try:
        return path_within(folder, told)
    except OSError as error:
        raise DeckError(place, f"it includes `{shown}`: {error.strerror or error}", remedy) from None


class _Source:
    """Reader of the lines of a deck and of the files that it includes."""

    def __init__(self, home: Path) -> None:
        self.home = home
        self.seen: set[Path] = set()
        self.repeated = 0

    def lines_of(self, path: Path, place: str = "", above: tuple[Path, ...] = ()) -> Iterator[tuple[str, int, str]]:
        """Yield each line of a deck and its included files as text, line number and file name. Raises DeckError.

        Comments and blank lines are left out. `place` is the line that includes the file, and `above` the including
        files.
        """
        file = path.resolve()
        if file in above or len(above) >= DEPTH:
            why = "it includes itself" if file in above else f"its files are nested more than {DEPTH} deep"
            raise DeckError(place, why, "write all into one file")
        self._limit_repeated_files(file, place)
        data = read_regular(file)
        if b"\0" in data:
            raise DeckError(path.name, "it is not a text file", "name an Abaqus or CalculiX deck")
        lines = data.decode("utf-8-sig", errors="replace").splitlines()
        del data
        for number, raw in enumerate(lines, start=1):
            text = raw.strip()
            if not text or text.startswith("**"):
                continue
            if text.startswith("*") and "".join(text[1:9].split()).upper().startswith("INCLUDE"):
                here = f"{path.name}:{number}"
                told = dict(_parse_option(word) for word in split_words(text)[1:] if word).get("INPUT", "")
                yield from self.lines_of(resolve_included(here, self.home, told), here, (*above, file))
            else:
                yield text, number, path.name

    def _limit_repeated_files(self, file: Path, place: str) -> None:
        """Count the bytes of files that are included again; raise DeckError if they are too many."""
        if file in self.seen:
            self.repeated += file.stat().st_size + 1024
            if self.repeated > REPEATED:
                raise DeckError(place, "it includes too many files", "write all into one file")
        self.seen.add(file)


def split_words(text: str) -> list[str]:
    """Return the comma-separated words of a line; quoted words may contain commas."""
    if '"' not in text:
        return [word.strip() for word in text.split(",")]
    return [word.strip().replace('"', "") for word in _WORD.findall(text)]


def _drop_trailing_blanks(words: list[str]) -> list[str]:
    while words and not words[-1]:
        words.pop()
    return words


def _parse_option(word: str) -> tuple[str, str]:
    name, _, value = word.partition("=")
    return "".join(name.upper().split()), value.strip()


def read_integer(word: str, card: Card) -> int:
    """Return a word as an integer. Raises DeckError."""
    if _WHOLE.fullmatch(word) is None:
        raise card.error(f"`{word[:40]}` in the data of {card.title} is not a whole number")
    return int(word)


def read_number(word: str, card: Card) -> float:
    """Return a word as a finite number; exponents may be Fortran's (1.5D3). Raises DeckError."""
    try:
        value = float(word.upper().replace("D", "E")) if "_" not in word else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise card.error(f"`{word[:40]}` in the data of {card.title} is not a finite number")
    return value
