"""What to write where a message names what was meant: for editors, and for reports on changes to a text.

Who finds a mistake says how to mend it, and hands the change over with the words (`grammar/diagnostic.py:Remedy`).
"""

from __future__ import annotations

from softmark.grammar.diagnostic import Diagnostic
from softmark.grammar.tree import Span


def replacement(diagnostic: Diagnostic) -> tuple[Span, str] | None:
    """The stretch of the message's own source that is to be replaced, and with what; None where that is not known."""
    fix = diagnostic.fix
    at = fix.span or diagnostic.span if fix is not None else None
    return None if fix is None or at is None else (at, fix.text)


def mended(text: str, diagnostic: Diagnostic) -> str | None:
    """A text that the message is about as its replacement leaves it; None where there is none."""
    found = replacement(diagnostic)
    return None if found is None else text[: found[0].start] + found[1] + text[found[0].end :]
