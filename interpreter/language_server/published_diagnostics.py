"""Conversion of the diagnostics of `dsl check` to the form of the protocol."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from lsprotocol import types

from softmark.grammar.diagnostic import Diagnostic, SecondaryPlace, make_encodable
from softmark.interpreter.help import codes as known_codes
from softmark.interpreter.language_server.text_document import Document
from softmark.scenes import ROOT

SEVERITY = {"error": types.DiagnosticSeverity.Error, "warning": types.DiagnosticSeverity.Warning}
PAGES = Path(known_codes.__file__).resolve().parent
START = types.Range(types.Position(0, 0), types.Position(0, 0))
UNUSED = frozenset({"W309"})  # codes of unused names, which editors show faded


def diagnostics(document: Document, found: list[Diagnostic] | None = None) -> list[types.Diagnostic]:
    """Return the messages about a text and the texts that it uses; by default all messages of `dsl check`."""
    return [diagnostic(document, one) for one in (document.check_result[1] if found is None else found)]


def diagnostic(document: Document, found: Diagnostic) -> types.Diagnostic:
    """Convert one message; a message about another text is placed at the start of this one, with a link."""
    here = _is_own_source(document, found.source)
    remarks = [found.message, *([f"help: {found.help}"] if found.help else []), *(f"note: {n}" for n in found.notes)]
    also = list(found.also)
    if not here and found.source is not None and found.span is not None:
        also.insert(0, SecondaryPlace(found.source, found.span, found.label or found.message))
    return types.Diagnostic(
        document.range(found.span) if here and found.span else START,
        make_encodable("\n".join(remarks)),
        SEVERITY[found.severity],
        found.code,
        _documentation_link(found.code),
        "softmark",
        tags=[types.DiagnosticTag.Unnecessary] if found.code in UNUSED else None,
        related_information=[_related(document, second) for second in also] or None,
        data={"label": make_encodable(found.label)} if found.label else None,
    )


def _documentation_link(code: str) -> types.CodeDescription | None:
    """Return a link to the documentation page of a message code, as a file; None if it has no page."""
    return types.CodeDescription((PAGES / f"{code}.md").as_uri()) if code in documented_codes() else None


@cache
def documented_codes() -> frozenset[str]:
    """Return the message codes that have a documentation page."""
    return frozenset(file.stem for file in PAGES.glob("*.md"))


def _is_own_source(document: Document, source: object) -> bool:
    return source is None or source is document.source or source == document.source


def _related(document: Document, second: SecondaryPlace) -> types.DiagnosticRelatedInformation:
    """Return a secondary place of a diagnostic in the form of the protocol."""
    if _is_own_source(document, second.source):
        uri, at = document.uri, document.range(second.span)
    else:
        uri = _file_of(document, second.source.name).absolute().as_uri()
        at = Document(second.source.text, document.folder).range(second.span)
    return types.DiagnosticRelatedInformation(
        types.Location(uri, at), make_encodable(second.label or second.source.name)
    )


def _file_of(document: Document, name: str) -> Path:
    """Return the file of a used text, given its name in messages."""
    return ROOT / name[4:] if name.startswith("std/") else Path(name)
