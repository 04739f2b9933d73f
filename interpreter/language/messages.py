"""What is said of a place in a scene: the one builder of messages for all that have found what they speak of."""

from __future__ import annotations

from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import Diagnostic, Remedy, remedied

if TYPE_CHECKING:
    from softmark.interpreter.language.scene import Location


def diagnostic(
    code: str, at: Location, message: str, label: str = "", help: str | Remedy = "", notes: tuple[str, ...] = ()
) -> Diagnostic:
    """A message at a place: `label` stands under it, `help` says what to do, `notes` what else there is to know."""
    remedy = remedied(help)
    return Diagnostic(code, message, at.source, at.span, label, remedy.help, notes, fix=remedy.fix)
