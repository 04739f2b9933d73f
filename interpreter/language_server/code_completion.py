"""Code completion at a position: `textDocument/completion`."""

from __future__ import annotations

import re
from collections.abc import Iterator

from lsprotocol import types

from softmark.interpreter.language_server.completion_items import CompletionOffer, offers
from softmark.interpreter.language_server.cursor_context import CursorContext, find_cursor_context
from softmark.interpreter.language_server.file_completion import complete_file_names
from softmark.interpreter.language_server.text_document import Document
from softmark.interpreter.language_server.unit_completion import follows_number, units_at


def complete(document: Document, params: types.CompletionParams) -> types.CompletionList:
    """Return the completions at a position, the likeliest first; they replace the word at the position."""
    here = find_cursor_context(document, document.offset(params.position))
    found = _fitting_items(here) if here is not None else ()
    items = [] if here is None else [_item(here, offer, place) for place, offer in enumerate(dict.fromkeys(found))]
    return types.CompletionList(is_incomplete=False, items=items)


def _fitting_items(here: CursorContext) -> Iterator[CompletionOffer]:
    if here.text is not None:
        return complete_file_names(here)
    return units_at(here) if follows_number(here) else offers(here)


def _item(here: CursorContext, offer: CompletionOffer, place: int) -> types.CompletionItem:
    at = types.Range(here.document.position(here.start), here.document.position(here.offset))
    snippets = here.document.snippets and offer.snippet
    written = offer.snippet if snippets else remove_placeholders(offer.snippet) if offer.snippet else offer.label
    return types.CompletionItem(
        label=offer.label.strip(),
        kind=offer.kind,
        detail=offer.detail or None,
        documentation=types.MarkupContent(types.MarkupKind.Markdown, offer.doc) if offer.doc else None,
        sort_text=f"{place:04}",
        filter_text=offer.label,
        insert_text_format=types.InsertTextFormat.Snippet if snippets else types.InsertTextFormat.PlainText,
        text_edit=types.TextEdit(at, written),
    )


def remove_placeholders(snippet: str) -> str:
    """Return a snippet as plain text for an editor without snippets, keeping the proposed values."""
    return re.sub(r"\\([\\$}])", r"\1", re.sub(r"\$\{\d+:((?:[^}\\]|\\.)*)\}|\$\d", r"\1", snippet))
