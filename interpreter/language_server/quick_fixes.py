"""Quick fixes that apply the replacements of messages: `textDocument/codeAction`."""

from __future__ import annotations

from collections.abc import Iterator

from lsprotocol import types

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.help.suggested_fixes import replacement
from softmark.interpreter.language_server.published_diagnostics import diagnostic
from softmark.interpreter.language_server.text_document import Document

KINDS = [types.CodeActionKind.QuickFix, types.CodeActionKind.SourceFixAll]


def actions(document: Document, params: types.CodeActionParams) -> list[types.CodeAction]:
    """Return an action for each message in a range that has a replacement, and one that applies all in the text."""
    uri, only = params.text_document.uri, params.context.only or KINDS
    found = [
        fix
        for fix in _replaceable_diagnostics(document)
        if _is_overlapping(fix[2].range, params.range) or _is_overlapping(fix[1], params.range)
    ]
    if not any(_is_requested(types.CodeActionKind.QuickFix, one) for one in only):
        found = []
    quick = [_action(document, uri, *fix) for fix in found]
    everything = any(_is_requested(types.CodeActionKind.SourceFixAll, one) for one in only)
    return [*quick, *(_fix_all_actions(document, uri) if everything else ())]


def _replaceable_diagnostics(document: Document) -> Iterator[tuple[Diagnostic, types.Range, types.Diagnostic]]:
    """Yield each message about the text with a replacement, the replaced range, and the message in the protocol."""
    for found in document.available_diagnostics:
        new = replacement(found)
        if new is not None and found.source is not None and found.source.text == document.text:
            yield found, document.range(new[0]), diagnostic(document, found)


def _action(
    document: Document, uri: str, found: Diagnostic, at: types.Range, shown: types.Diagnostic
) -> types.CodeAction:
    edit = _edit(document, found)
    return types.CodeAction(
        _title(document, found), types.CodeActionKind.QuickFix, [shown], is_preferred=True,
        edit=types.WorkspaceEdit(changes={uri: [edit]}),
    )  # fmt: skip


def _fix_all_actions(document: Document, uri: str) -> Iterator[types.CodeAction]:
    """Yield one action that applies all fixes that do not overlap, if there are any."""
    edits: list[types.TextEdit] = []
    for found, at, _ in _replaceable_diagnostics(document):
        if not any(_is_overlapping(at, edit.range) for edit in edits):
            edits.append(_edit(document, found))
    if edits:
        kind, change = types.CodeActionKind.SourceFixAll, types.WorkspaceEdit(changes={uri: edits})
        yield types.CodeAction("apply the fixes of the messages", kind, edit=change)


def _edit(document: Document, found: Diagnostic) -> types.TextEdit:
    new = replacement(found)
    if new is None:
        raise ValueError("the message has no replacement text")
    return types.TextEdit(document.range(new[0]), new[1])


def _title(document: Document, found: Diagnostic) -> str:
    """Return the title of a fix: ``write `kPa` for `kpa` ``, ``add `,` ``, ``remove `;` ``."""
    span, new = replacement(found) or (None, "")
    old = document.text[span.start : span.end] if span else ""
    if not new.strip():
        return f"remove `{old}`" if old else "start a new line"
    return f"write `{new.strip()}` for `{old}`" if old else f"add `{new.strip()}`"


def _is_requested(kind: str, only: str) -> bool:
    """Return whether a kind of action is requested; `source` includes `source.fixAll`."""
    return kind == only or kind.startswith(f"{only}.")


def _is_overlapping(one: types.Range, other: types.Range) -> bool:
    """Return whether two ranges overlap or touch."""
    return not (_is_before(one.end, other.start) or _is_before(other.end, one.start))


def _is_before(one: types.Position, other: types.Position) -> bool:
    return (one.line, one.character) < (other.line, other.character)
