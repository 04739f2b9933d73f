"""Renaming of a name everywhere: `textDocument/prepareRename` and `rename`."""

from __future__ import annotations

import re
from collections.abc import Iterator

from lsprotocol import types

from softmark.grammar.diagnostic import Source
from softmark.grammar.parse_table import reserved_words
from softmark.interpreter.language.expression_evaluation import PREDEFINED
from softmark.interpreter.language.field_schema import article
from softmark.interpreter.language_server.go_to_definition import find_all_uses
from softmark.interpreter.language_server.name_index import Occurrence, Target, name_at
from softmark.interpreter.language_server.open_documents import OpenDocuments
from softmark.interpreter.language_server.request_error import RequestRefused
from softmark.interpreter.language_server.text_document import Document
from softmark.interpreter.validation.constructor_registry import compile_source
from softmark.scenes import ROOT

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def prepare_rename(document: Document, params: types.PrepareRenameParams) -> types.PrepareRenamePlaceholder:
    """Return the name at a position if it can be renamed. Raises RequestRefused."""
    found = _name_to_rename(document, params.position)
    return types.PrepareRenamePlaceholder(document.range(found.span), found.target.name)


def rename(opened: OpenDocuments, params: types.RenameParams) -> types.WorkspaceEdit:
    """Return the edits that replace a name in all scenes found to use it. Raises RequestRefused."""
    uri, new = params.text_document.uri, params.new_name
    document = opened.documents[uri]
    target = _name_to_rename(document, params.position).target
    for problem in _find_objections(document, target, new):
        raise RequestRefused(problem)
    changes: dict[str, list[types.TextEdit]] = {}
    for place, span in find_all_uses(opened, uri, target):
        changes.setdefault(place, []).append(types.TextEdit(span, new))
    if target.module is document.table.modules[0]:  # other files are read from disk, where they are unchanged
        _refuse_new_errors(document, changes.get(uri, []), new)
    return types.WorkspaceEdit(changes=changes)


def _name_to_rename(document: Document, position: types.Position) -> Occurrence:
    """Return the name at a position, if it may be renamed. Raises RequestRefused."""
    found = name_at(document, document.offset(position))
    if found is None:
        raise RequestRefused("words of the language and fields cannot be renamed: only names of the scene can")
    if any(d.code.startswith("E1") for d in document.compiled[1]):
        raise RequestRefused(
            "correct the syntax errors first: names in the lines that cannot be read would not be renamed"
        )
    target = found.target
    if target.module.file is not None and target.module.file.resolve().is_relative_to(ROOT.resolve()):
        raise RequestRefused(f"`{target.name}` is declared in the standard library, which cannot be changed")
    return found


def _find_objections(document: Document, target: Target, new: str) -> Iterator[str]:
    """Yield reasons why a declaration cannot be renamed to `new`."""
    if not NAME.fullmatch(new):
        yield f"`{new}` is not a name: use the letters A to Z, a to z, digits and `_`"
    if new in reserved_words():
        yield f"`{new}` is a reserved word"
    if new in PREDEFINED:
        yield f"`{new}` is a predefined name and cannot be declared"
    full, table = target.module.prefix + new, document.table
    if new != target.name and (full in table.symbols or full in table.aliases):
        known = table.symbols.get(full)
        kind = getattr(known.node, "kind", "param") if known else "use"
        yield f"`{new}` is already {article(kind)} {kind} of {target.module.source.name}"


def _refuse_new_errors(document: Document, edits: list[types.TextEdit], new: str) -> None:
    """Refuse a new name that causes a new error, such as a word of the language. Raises RequestRefused."""
    text = document.text
    for edit in sorted(edits, key=lambda e: (e.range.start.line, e.range.start.character), reverse=True):
        start, end = document.offset(edit.range.start), document.offset(edit.range.end)
        text = text[:start] + edit.new_text + text[end:]
    before = {d.code for d in document.compiled[1]}
    for found in compile_source(Source(document.source.name, text), document.folder, document.file)[1]:
        if found.severity == "error" and found.code not in before:
            raise RequestRefused(f"`{new}` would cause an error, {found.code}: {found.message}")
