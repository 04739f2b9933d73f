"""Diagnostics: errors and warnings about a text, with place and remedy, and their display in a terminal.

A diagnostic is a value. Code that finds a problem appends a diagnostic to a list and continues, so that one pass
reports everything. Codes are stable: E1xx syntax, E2xx names, kinds and units, E3xx physics, E4xx files, E5xx limits of
models and references, E6xx running. W codes are grouped like E codes, for valid but questionable input.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, Literal
from unicodedata import category, east_asian_width

from softmark.grammar.tree import Span


@dataclass(frozen=True, slots=True)
class Source:
    """Text with its name in messages: a path, `<stdin>`, or `-p L=12` for an override."""

    name: str
    text: str


@dataclass(frozen=True, slots=True)
class SecondaryPlace:
    """Secondary place of a message, such as that of a parameter whose value is out of range."""

    source: Source
    span: Span
    label: str


@dataclass(frozen=True, slots=True)
class Fix:
    """Change to a text: `text` replaces the content of `span`, by default the span of the message."""

    text: str
    span: Span | None = None


@dataclass(frozen=True, slots=True)
class Remedy:
    """Correction of an error: an explanation, and the change to the text if the explanation names one."""

    help: str
    fix: Fix | None = None


def did_you_mean(name: str, text: str = "", more: str = "") -> Remedy:
    """Return ``did you mean `name`?`` with a fix that inserts the name, or the given text, at the message's span."""
    return Remedy(f"did you mean `{name}`?{more}", Fix(text or name))


def suggest_text(text: str, more: str = "") -> Remedy:
    """Return ``write `text` `` with a fix that inserts the text at the message's span."""
    return Remedy(f"write `{text}`{more}", Fix(text))


def as_remedy(help: str | Remedy) -> Remedy:
    """Return a remedy; plain text becomes a remedy without a change to the text."""
    return help if isinstance(help, Remedy) else Remedy(help)


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """Error or warning: `message` is the problem, `label` describes the span, `help` is the remedy.

    `fix` is the change to the text that `help` names, if it names one.
    """

    code: str
    message: str
    source: Source | None
    span: Span | None
    label: str = ""
    help: str = ""
    notes: tuple[str, ...] = ()
    also: tuple[SecondaryPlace, ...] = ()
    fix: Fix | None = None

    @property
    def severity(self) -> Literal["error", "warning"]:
        """`error` for codes that start with E, `warning` for W."""
        return "error" if self.code.startswith("E") else "warning"


def to_json(diagnostic: Diagnostic) -> dict[str, Any]:
    """Return the diagnostic as a dictionary for other programs; line and column are null without a place."""
    span, source = diagnostic.span, diagnostic.source
    own: dict[str, Any] = {
        "code": diagnostic.code,
        "severity": diagnostic.severity,
        "message": make_encodable(diagnostic.message),
        "file": make_encodable(source.name) if source else None,
        "line": span.line if span else None,
        "column": span.column if span else None,
        "end_line": span.end_line if span else None,
        "end_column": span.end_column if span else None,
        "help": make_encodable(diagnostic.help) or None,
        "label": make_encodable(diagnostic.label) or None,
        "notes": [make_encodable(note) for note in diagnostic.notes],
    }
    if diagnostic.also:
        own["related"] = [
            {"file": make_encodable(s.source.name), "line": s.span.line, "column": s.span.column,
             "message": make_encodable(s.label)}
            for s in diagnostic.also
        ]  # fmt: skip
    return own


def make_encodable(text: str) -> str:
    """Return text without surrogates, which represent non-UTF-8 bytes of a file name or an argument."""
    return re.sub("[\ud800-\udfff]", "\ufffd", text)


def summary(diagnostics: Iterable[Diagnostic]) -> str:
    """Return a summary such as `2 errors, 1 warning`."""
    severities = [diagnostic.severity for diagnostic in diagnostics]
    counts = [(severities.count(severity), severity) for severity in ("error", "warning")]
    return ", ".join(f"{n} {severity}{'s' * (n > 1)}" for n, severity in counts if n) or "no errors"


def render(diagnostics: Iterable[Diagnostic], colour: bool = False) -> str:
    """Return the diagnostics as text for a terminal, sorted by file and place and separated by blank lines.

    There is no line feed at the end.
    """
    paint = _paint if colour else _strip_style
    return "\n\n".join(_draw_diagnostic(diagnostic, paint) for diagnostic in sorted(diagnostics, key=_sort_key))


def _sort_key(diagnostic: Diagnostic) -> tuple[str, int]:
    name = diagnostic.source.name if diagnostic.source else ""
    return name, diagnostic.span.start if diagnostic.span else -1


# ------------------------------------------------------------------------- drawing

WIDTH = 100  # columns of a source line that are shown
SIDE = 4 * WIDTH  # characters considered on either side: a line may be as long as a file
LONGEST = 600  # characters of a line of a message
TAB = 4
STYLES = {"error": "1;31", "warning": "1;33", "gutter": "1;34", "bold": "1"}
Paint = Callable[[str, str], str]


def _strip_style(text: str, style: str) -> str:
    return text


def _paint(text: str, style: str) -> str:
    return f"\x1b[{STYLES[style]}m{text}\x1b[0m"


def _draw_diagnostic(diagnostic: Diagnostic, paint: Paint) -> str:
    severity = diagnostic.severity
    head = paint(f"{severity}[{diagnostic.code}]", severity) + paint(f": {_shorten(diagnostic.message)}", "bold")
    lines, margin = [head], "   "
    if diagnostic.source and diagnostic.span:
        margin = " " * (max(len(str(s.line)) for s in (diagnostic.span, *(s.span for s in diagnostic.also))) + 2)
        first = SecondaryPlace(diagnostic.source, diagnostic.span, diagnostic.label)
        lines += _snippet(first, margin, paint, severity)
        for second in diagnostic.also:
            lines += _snippet(second, margin, paint)
    remarks = [("help", diagnostic.help), *(("note", note) for note in diagnostic.notes)]
    for kind, text in remarks:
        if text:
            indent = "\n" + " " * (len(margin) + len(f"= {kind}: "))
            body = indent.join(_shorten(line) for line in text.split("\n"))
            lines.append(f"{margin}{paint('=', 'gutter')} {paint(kind, 'bold')}: {body}")
    return "\n".join(lines)


def _snippet(place: SecondaryPlace, margin: str, paint: Paint, severity: str = "") -> list[str]:
    """Return the lines that show a place: its position, the source line, and carets under the span with the label.

    A secondary place has dashes instead of carets.
    """
    source, span = place.source, place.span
    line, first, last = _source_line_of_span(source.text, span)
    shown, before, carets = _clip(_displayed_characters(line), first, last)
    label = f" {_shorten(place.label)}" if place.label else ""
    bar, arrow = paint("|", "gutter"), paint("-->" if severity else ":::", "gutter")
    number = f"{span.line:>{len(margin) - 2}}"
    return [
        f"{margin[1:]}{arrow} {_shorten(source.name)}:{span.line}:{span.column}",
        f"{margin}{bar}",
        f" {paint(number, 'gutter')} {bar} {shown}".rstrip(),
        f"{margin}{bar} {' ' * before}{paint(('^' if severity else '-') * carets + label, severity or 'gutter')}",
    ]


def _source_line_of_span(text: str, span: Span) -> tuple[str, int, int]:
    """Return the source line around the start of a span, and the span's first and last character in it.

    A very long line is cut off far from the span.
    """
    start = min(span.start, len(text))
    near = max(0, start - SIDE)
    first = max(text.rfind("\n", near, start) + 1, text.rfind("\r", near, start) + 1, near)
    if first == 0 and text.startswith("\ufeff"):
        first = 1
    line = re.split(r"[\r\n]", text[first : max(first, start) + SIDE], maxsplit=1)[0]
    return line, max(start - first, 0), min(max(span.end - first, 0), len(line))


def _displayed_characters(line: str) -> list[str]:
    """Return the displayed text of each character: blanks for a tab, a visible symbol for an invisible character."""
    cells: list[str] = []
    column = 0
    for character in line:
        cell = " " * (TAB - column % TAB) if character == "\t" else make_visible(character)
        column += _width(cell)
        cells.append(cell)
    return cells


def _clip(cells: Sequence[str], first: int, last: int) -> tuple[str, int, int]:
    """Return the part of a line around `cells[first:last]`, the columns before the carets, and their number."""
    low, room = _fitting_count(cells, first, -1, WIDTH // 3)
    high, room = _fitting_count(cells, first, 1, room + WIDTH - WIDTH // 3)
    low, _ = _fitting_count(cells, low, -1, room)
    head, tail = "…" if low else "", "…" if high < len(cells) else ""
    before = _width(head + "".join(cells[low:first]))
    carets = _width("".join(cells[first : min(last, high)]))
    return head + "".join(cells[low:high]) + tail, before, max(carets, 1)


def _fitting_count(cells: Sequence[str], place: int, step: Literal[-1, 1], room: int) -> tuple[int, int]:
    """Return how many cells fit into `room` columns from `place` on, and the remaining columns.

    `step` is -1 for cells to the left and 1 for cells to the right.
    """
    while 0 < place + (step > 0) <= len(cells):
        width = _width(cells[place - (step < 0)])
        if width > room:
            break
        place, room = place + step, room - width
    return place, room


def _width(text: str) -> int:
    """Return the number of terminal columns that a text needs."""
    return len(text) if text.isascii() else sum(_character_width(character) for character in text)


def _character_width(character: str) -> int:
    if category(character) in ("Mn", "Me"):
        return 0
    return 2 if east_asian_width(character) in "WF" else 1


def _shorten(text: str) -> str:
    """Return a line of a message, with its middle omitted if quoted text makes it too long."""
    return make_visible(text if len(text) <= LONGEST else f"{text[: LONGEST // 2]} … {text[-LONGEST // 4 :]}")


def make_visible(text: str) -> str:
    """Return a line with control, invisible and unencodable characters replaced by symbols."""
    return text if text.isprintable() else "".join(map(_replacement_symbol, text))


def make_all_visible(value: Any) -> Any:
    """Return a value with `make_visible` applied to all strings in it, line feeds kept; other values are unchanged.

    It is for terminal output: titles, messages and names come from scenes and files of other people.
    """
    if isinstance(value, str):
        return value if value.isprintable() else "\n".join(map(make_visible, value.split("\n")))
    if isinstance(value, Mapping):
        return {k: make_all_visible(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(map(make_all_visible, value))
    if is_dataclass(value) and not isinstance(value, type):
        return replace(value, **{f.name: make_all_visible(getattr(value, f.name)) for f in fields(value)})
    return value


def _replacement_symbol(character: str) -> str:
    """Return the symbol that is displayed for a character."""
    if ord(character) < 0x20:
        return chr(0x2400 + ord(character))
    return "\ufffd" if category(character) in ("Cc", "Cf", "Cs", "Zl", "Zp") else character
