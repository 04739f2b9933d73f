"""Text replacements that diagnostics suggest, for quick fixes in editors and in pull requests.

The check that finds a mistake also provides the replacement (`Remedy` in grammar/diagnostic.py).
"""

from __future__ import annotations

from softmark.grammar.diagnostic import Diagnostic
from softmark.grammar.tree import Span


def replacement(diagnostic: Diagnostic) -> tuple[Span, str] | None:
    """Return the source span to replace and the new text; None if the diagnostic has no suggestion."""
    fix = diagnostic.fix
    at = fix.span or diagnostic.span if fix is not None else None
    return None if fix is None or at is None else (at, fix.text)


def apply_fix(text: str, diagnostic: Diagnostic) -> str | None:
    """Return the text with the replacement that the diagnostic suggests; None if it has no suggestion."""
    found = replacement(diagnostic)
    return None if found is None else text[: found[0].start] + found[1] + text[found[0].end :]
