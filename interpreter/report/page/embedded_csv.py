"""CSV data embedded in an HTML page as a download link."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from urllib.parse import quote

from softmark.interpreter.report.page.html_markup import tag, text

Cell = str | int | float | None


def csv_text(header: Sequence[str], rows: Iterable[Sequence[Cell]]) -> str:
    """Return CSV text according to RFC 4180, with all digits of floats and an empty field for a missing value."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerow([_field(cell) for cell in header])
    writer.writerows([_field(cell) for cell in row] for row in rows)
    return out.getvalue()


def _field(cell: Cell) -> str:
    if cell is None:
        return ""
    if isinstance(cell, str):
        # a spreadsheet would run a text that starts like a formula
        return "'" + cell if cell[:1] in ("=", "+", "-", "@") else cell
    return repr(cell)


def csv_link(name: str, header: Sequence[str], rows: Iterable[Sequence[Cell]], label: str = "CSV") -> str:
    """Return an HTML link that saves the rows as the file `name`.csv."""
    body = csv_text(header, rows).encode("utf-8", "replace")
    address = "data:text/csv;charset=utf-8," + quote(body, safe=",;!*()?@$'+=")
    return tag("a", text(label), class_="save", href=address, download=f"{name}.csv")


def round_for_drawing(value: float) -> float:
    """Return a float rounded to nine digits, which are enough for drawing; report.json has all digits."""
    return float(f"{value:.9g}")
