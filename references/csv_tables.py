"""Tables of numbers in CSV files, by named columns; errors give line, column and remedy.

The header is the first line that names all requested columns; lines before it are titles and are not read. Columns are
separated by commas, semicolons or tabs. A row of units below the header, `(s),(N)`, without numbers, is recognised and
reported. Every other field must be a number: no field is skipped, guessed or filled in. The module does not import
numpy, since tables are read when a scene is checked.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path

from softmark.records import dataclass
from softmark.references.measured_data import Unreadable
from softmark.safe_files import read_regular

SEPARATORS = (",", ";", "\t")
BEFORE = 1000  # lines searched for the header
SHOWN = 12  # columns that a message lists
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")  # float() reads more: 1_000, nan, infinity
COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?")  # a number with a decimal comma
LARGEST = 1e30  # as for quantities of a scene
_PART = r"(?:[^\W\d_]|[%°])+\.?(?:(?:\^|\*\*)?-?\d)?"
_UNIT = rf"(?:1/)?{_PART}(?:[*/·. ]{_PART})*"  # `kN/m^2`, `°C`, `Sekunden`
UNIT = re.compile(rf"{_UNIT}|\( ?(?:{_UNIT}|[-1]) ?\)|\[ ?(?:{_UNIT}|[-1]) ?\]")
NO_UNIT = ("", "-", "\N{EN DASH}")  # unit entries of a column of plain numbers
MISSING = frozenset((  # words for missing numbers
    "na", "n/a", "n.a", "n.a.", "nd", "n.d", "n.d.", "nan", "inf", "infinity", "nil", "none", "null", "missing",
    "empty", "void", "no", "x", "keine", "fehlt",
))  # fmt: skip

Row = tuple[int, list[str]]  # the number of its line, and its fields


@dataclass(frozen=True)
class Columns:
    """Requested columns of a table: their numbers by name, and the line number of each row."""

    name: str  # of the file
    numbers: dict[str, tuple[float, ...]]
    lines: tuple[int, ...]
    notes: tuple[str, ...] = ()  # what was read as units


def read_columns(file: Path, asked: Sequence[str]) -> Columns:
    """Return the requested columns of a file. Raises Unreadable with line and column of the error."""
    text = _read_text(file)
    separator, header, rows = _find_table(file.name, text, list(dict.fromkeys(asked)))
    places = {name: _column_index(file.name, header, name) for name in asked}
    filled = [row for row in rows if any(row[1])]
    notes: tuple[str, ...] = ()
    if filled and _has_units([_field_or_empty(filled[0], i) for i in places.values()], filled[0][1]):
        (line, fields), filled = filled[0], filled[1:]
        units = ", ".join(f"`{_field_or_empty((line, fields), i)}`" for i in places.values())
        notes = (f"line {line}, {units}, is not a row of numbers and is read as units",)
    if not filled:
        raise Unreadable(file.name, "it has no rows of numbers below the header", "give one row for each point")
    for row in filled:
        _check_field_count(file.name, row, header, separator)
    numbers = {name: tuple(_parse_number(file.name, row, name, i) for row in filled) for name, i in places.items()}
    return Columns(file.name, numbers, tuple(line for line, _ in filled), notes)


def read_header(file: Path) -> tuple[str, ...]:
    """Return the likely column names of a file. Raises Unreadable if there are none."""
    text = "".join(_read_text(file).splitlines(keepends=True)[:BEFORE])
    likely = max((_find_header(_split_rows(file.name, text, separator)) for separator in SEPARATORS), key=len)
    if likely and all(map(COMMA.fullmatch, likely)):
        remedy = f"use a decimal point: `{likely[0].replace(',', '.')}`"
        raise Unreadable(file.name, f"its numbers have decimal commas: `{likely[0]}`", remedy)
    if not likely:
        raise Unreadable(file.name, "it has no column names", "the line above its numbers must name the columns")
    return tuple(likely)


def _read_text(file: Path) -> str:
    try:
        text = read_regular(file).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise Unreadable(file.name, "it is not UTF-8 text", "save it as CSV in UTF-8") from None
    except OSError as error:
        raise Unreadable(file.name, f"it cannot be read ({error.strerror})", "give a CSV file in UTF-8") from None
    if "\0" in text:
        raise Unreadable(file.name, "it is not a text file", "save it as CSV in UTF-8")
    return text


def _find_table(name: str, text: str, asked: list[str]) -> tuple[str, list[str], list[Row]]:
    """Return the separator of a table, its header and the rows below the header."""
    likely: list[str] = []
    for separator in SEPARATORS:
        rows = _split_rows(name, text, separator, BEFORE)
        at = next((i for i, (_, fields) in enumerate(rows) if set(asked) <= set(fields)), None)
        if at is not None:
            return separator, rows[at][1], _split_rows(name, text, separator)[at + 1 :]
        likely = max(likely, _find_header(rows), key=len)
    lacking = next((column for column in asked if column not in likely), asked[0])
    listed = ", ".join(f"`{c}`" for c in likely[:SHOWN]) + (" and others" if len(likely) > SHOWN else "")
    help = f"its columns are {listed}" if likely else "the line above its numbers must name the columns"
    raise Unreadable(name, f"it has no column `{lacking}`", help)


def _split_rows(name: str, text: str, separator: str, most: int | None = None) -> list[Row]:
    """Return the non-empty rows of a text: all, or the first `most`."""
    import csv

    reader = csv.reader(text.splitlines(keepends=True), delimiter=separator)
    try:
        begins, rows = 1, []
        for fields in reader:
            if most is not None and reader.line_num > most:
                break
            if any(fields):
                rows.append((begins, [field.strip() for field in fields]))
            begins = reader.line_num + 1  # an unclosed quote joins several lines
        return rows
    except csv.Error as error:
        raise Unreadable(name, f"line {reader.line_num} is not a CSV row ({error})", "save it as CSV") from None


def _find_header(rows: list[Row]) -> list[str]:
    """Return the likely header: the last row of several words above the first row of several numbers."""
    known: list[str] = []
    for _, fields in rows:
        filled = [field for field in fields if field]
        if sum(bool(NUMBER.fullmatch(field)) for field in filled) > 1:
            break
        known = filled if len(filled) > 1 else known
    return known


def _has_units(asked: list[str], row: list[str]) -> bool:
    """Return whether a row contains units: below the requested columns or, if these are empty, below other columns."""
    fields = next((known for known in (asked, row) if any(f not in NO_UNIT for f in known)), [])
    given = [field for field in fields if field not in NO_UNIT]
    return bool(given) and all(UNIT.fullmatch(f) and f.strip("()[] ").lower() not in MISSING for f in given)


def _column_index(name: str, header: list[str], column: str) -> int:
    if header.count(column) > 1:
        numbers = ", ".join(str(i + 1) for i, text in enumerate(header) if text == column)
        raise Unreadable(
            name, f"several columns are called `{column}`: number {numbers}", "give each column its own name"
        )
    return header.index(column)


def _field_or_empty(row: Row, i: int) -> str:
    return row[1][i] if i < len(row[1]) else ""


def _check_field_count(name: str, row: Row, header: list[str], separator: str) -> None:
    """Raise Unreadable for a row with more fields than the header, which decimal commas cause."""
    line, fields = row
    if any(fields[len(header) :]):
        count = f"line {line} has {len(fields)} fields, but its header has {len(header)}"
        comma = "; use a decimal point" if separator == "," else ""
        raise Unreadable(name, count, f"give each row as many fields as the header{comma}")


def _parse_number(name: str, row: Row, column: str, i: int) -> float:
    """Return field i of a row as a number. Raises Unreadable."""
    line, text = row[0], _field_or_empty(row, i)
    at = f"line {line}, column `{column}`"
    if not text:
        raise Unreadable(name, f"{at}: the number is missing", "give a number, or remove the row")
    if not NUMBER.fullmatch(text):
        comma = COMMA.fullmatch(text)
        apart = re.fullmatch(r"[+-]?\d{1,3}(,\d{3})+\.\d*([eE][+-]?\d+)?", text)
        help = f"use a decimal point: `{text.replace(',', '.')}`" if comma else "remove the row"
        help = f"write no thousands separator: `{text.replace(',', '')}`" if apart else help
        raise Unreadable(name, f"{at}: `{text[:40]}` is not a number", help)
    value = float(text)
    if not math.isfinite(value) or abs(value) > LARGEST:
        raise Unreadable(name, f"{at}: `{text[:40]}` is too large", f"numbers in a table must be below {LARGEST:g}")
    return value
