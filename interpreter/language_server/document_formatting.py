"""Formatting of a document in the canonical form of `dsl fmt`: `textDocument/formatting`."""

from __future__ import annotations

from lsprotocol import types

from softmark.grammar.printer import CannotFormat, format_source
from softmark.interpreter.language.scene_sources import LARGEST
from softmark.interpreter.language_server.request_error import RequestRefused
from softmark.interpreter.language_server.text_document import Document


def format_document(document: Document, params: types.DocumentFormattingParams) -> list[types.TextEdit]:
    """Return one edit that replaces the lines from the first to the last that differ.

    Raises RequestRefused on a syntax error.
    """
    if document.is_too_large:
        raise RequestRefused(f"not formatted: the text is larger than {LARGEST // 1000000} MB")
    try:
        new = format_source(document.source)
    except CannotFormat as problem:
        raise RequestRefused(_reason_not_formatted(problem)) from None
    return [] if new == document.text else [_difference(document, new)]


def _reason_not_formatted(problem: CannotFormat) -> str:
    first = next(iter(problem.diagnostics), None)
    if first is None or first.span is None:
        return f"not formatted: {problem.reason}"
    return f"not formatted: line {first.span.line} cannot be read, {first.code}: {first.message}"


def _difference(document: Document, new: str) -> types.TextEdit:
    """Return the edit of the part that differs, so that the cursor stays where nothing changes."""
    old = document.text
    start = next((i for i, (a, b) in enumerate(zip(old, new, strict=False)) if a != b), min(len(old), len(new)))
    most = min(len(old), len(new)) - start
    behind = next((i for i in range(most) if old[-1 - i] != new[-1 - i]), most)
    at = types.Range(document.position(start), document.position(len(old) - behind))
    return types.TextEdit(at, new[start : len(new) - behind])
