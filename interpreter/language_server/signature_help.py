"""Signature help: the fields of the call that is being written, `textDocument/signatureHelp`."""

from __future__ import annotations

from lsprotocol import types

from softmark.interpreter.help.reserved_words import CALLS
from softmark.interpreter.help.word_pages import field_facts
from softmark.interpreter.language.field_schema import Constructor
from softmark.interpreter.language_server import hover_markdown
from softmark.interpreter.language_server.cursor_context import OpenBracket, find_cursor_context
from softmark.interpreter.language_server.text_document import Document


def signature(document: Document, params: types.SignatureHelpParams) -> types.SignatureHelp | None:
    """Return the innermost call around a position and its current field; None outside calls."""
    here = find_cursor_context(document, document.offset(params.position))
    frame = here.call if here is not None else None
    if frame is None:
        return None
    if frame.constructor is None:
        return _function(frame)
    field = frame.field
    active = frame.constructor.fields.index(field) if field is not None else None
    return types.SignatureHelp([_constructor_signature(frame.constructor)], 0, active)


def _constructor_signature(c: Constructor) -> types.SignatureInformation:
    """Return a signature such as `fem(element, strain, size)`, with optional fields in square brackets."""
    label, fields = f"{c.name}(", []
    for place, f in enumerate(c.fields):
        label += ", " if place else ""
        start = len(label)
        label += f.name if f.required else f"[{f.name}]"
        fields.append(types.ParameterInformation((start, len(label)), _markdown_content(f.doc + field_facts(f))))
    return types.SignatureInformation(f"{label})", _markdown_content(c.summary), fields)


def _function(frame: OpenBracket) -> types.SignatureHelp | None:
    if frame.function not in CALLS:
        return None
    form, doc = CALLS[frame.function]
    named = form[form.index("(") + 1 : -1].split(", ")
    fields = [types.ParameterInformation(name) for name in named]
    return types.SignatureHelp(
        [types.SignatureInformation(form, _markdown_content(doc), fields)], 0, min(frame.place, len(named) - 1)
    )


def _markdown_content(text: str) -> types.MarkupContent:
    return types.MarkupContent(types.MarkupKind.Markdown, hover_markdown.prose(text))
