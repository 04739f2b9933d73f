"""Builder of diagnostics at a location of a scene."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import Diagnostic, Fix, Remedy, as_remedy
from softmark.grammar.tree import Span

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Location

LEAVE_OUT = "leave it out"  # start of a help that asks to remove the argument at the place
_BEFORE = re.compile(r"(?:(,[ \t]*)|(\())([A-Za-z_]\w*[ \t]*=[ \t]*)\Z")
_AFTER = re.compile(r"[ \t]*,[ \t]*")
FAR = 200  # maximum distance in characters between a value and its name


def diagnostic(
    code: str, at: Location, message: str, label: str = "", help: str | Remedy = "", notes: tuple[str, ...] = ()
) -> Diagnostic:
    """Build a diagnostic at a location: `label` is printed below the text, `help` is the remedy, `notes` add facts."""
    remedy = as_remedy(help)
    fix = remedy.fix or (remove_argument(at) if remedy.help.startswith(LEAVE_OUT) else None)
    return Diagnostic(code, message, at.source, at.span, label, remedy.help, notes, fix=fix)


def remove_argument(at: Location) -> Fix | None:
    """Return the fix that removes the named argument with its value at a location; None for an unnamed argument.

    The comma of the argument is removed as well.
    """
    text, span = at.source.text, at.span
    named = _BEFORE.search(text[max(0, span.start - FAR) : span.start])
    if named is None:
        return None
    behind = _AFTER.match(text, span.end) if named[2] else None  # the first argument is removed with the comma after it
    width, more = len(named[0]) - len(named[2] or ""), len(behind[0]) if behind else 0
    whole = Span(span.start - width, span.end + more, span.line, span.column - width,
                 span.end_line, span.end_column + more)  # fmt: skip
    return Fix("", whole)
