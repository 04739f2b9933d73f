"""CSV that travels inside the page, as a link that saves it."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from urllib.parse import quote

from softmark.interpreter.report.page.html_markup import tag, text

Cell = str | int | float | None


def csv_text(header: Sequence[str], rows: Iterable[Sequence[Cell]]) -> str:
    """RFC 4180; floats in full, an empty field where there is no value."""
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
    """A link that saves the rows as `name`.csv."""
    body = csv_text(header, rows).encode("utf-8", "replace")
    address = "data:text/csv;charset=utf-8," + quote(body, safe=",;!*()?@$'+=")
    return tag("a", text(label), class_="save", href=address, download=f"{name}.csv")


def short(value: float) -> float:
    """A float with nine digits: enough to draw with; report.json has them all."""
    return float(f"{value:.9g}")
