"""Markdown of pull-request comments: tables of untrusted texts within the size limit of a comment."""

from __future__ import annotations

import re
from collections.abc import Sequence

from softmark.grammar.diagnostic import make_encodable, make_visible
from softmark.records import dataclass

LIMIT = 65_536  # characters of a comment at GitHub; counted here as bytes of UTF-8, which are no fewer
LONGEST = 300  # characters of one text in a cell
Row = Sequence[str]


@dataclass(frozen=True)
class MarkdownTable:
    """Table of a Markdown comment, with the most important rows first.

    Each cell is text from `strip_markup` or `code`. `noun` is the plural noun for rows in the sentence that reports how
    many were left out, for example `3 more points are not shown`.
    """

    noun: str
    columns: Row
    rows: Sequence[Row]


def document(head: str, tables: Sequence[MarkdownTable], tail: str = "", limit: int = LIMIT) -> str:
    """Return head, non-empty tables and tail as Markdown of at most `limit` characters.

    If rows do not fit, their number is given at the end of their table.
    """
    blocks = [head]
    room = limit - _byte_count(head) - _byte_count(tail) - 8
    for table in (t for t in tables if t.rows):
        lines = [_line(table.columns), _line(["---"] * len(table.columns))]
        more = f"\n\n{len(table.rows)} more {table.noun} are not shown."
        room -= sum(map(_byte_count, lines)) + _byte_count(more) + 2 * len(lines)
        shown = 0
        for line in map(_line, table.rows):
            room -= _byte_count(line) + 1
            if room < 0:
                break
            lines.append(line)
            shown += 1
        left = len(table.rows) - shown
        if shown:
            blocks.append("\n".join(lines) + (f"\n\n{left} more {table.noun} are not shown." if left else ""))
    return "\n\n".join([*blocks, *([tail] if tail else [])]) + "\n"


def strip_markup(text: str) -> str:
    """Return a text without Markdown, table separators or mentions of people."""
    escaped = re.sub(r"([\\`*_~\[\]])", r"\\\1", _shorten(text).replace("&", "&amp;"))
    escaped = escaped.replace("<", "&lt;").replace(">", "&gt;").replace("|", "&#124;")
    return re.sub(r"[@#](?=\w)", lambda sign: f"{sign[0]}\u200b", escaped)


def code(text: str) -> str:
    """Return a text as Markdown code, which is shown verbatim inside or outside a table."""
    told = _shorten(text)
    if not told or "|" in told:  # `|` ends a cell, in code too
        return told and f"<code>{strip_markup(told)}</code>"
    fence = "`" * (max(map(len, re.findall("`+", told)), default=0) + 1)
    pad = " " if told[0] == "`" or told[-1] == "`" else ""
    return f"{fence}{pad}{told}{pad}{fence}"


def _shorten(text: str) -> str:
    """Return a text on one line, with its middle omitted if it is long."""
    line = " ".join(make_visible(make_encodable(word)) for word in text.split())
    return line if len(line) <= LONGEST else f"{line[: LONGEST // 2]} … {line[-LONGEST // 3 :]}"


def _line(cells: Row) -> str:
    return f"| {' | '.join(cells)} |"


def _byte_count(text: str) -> int:
    return len(text.encode(errors="replace"))
