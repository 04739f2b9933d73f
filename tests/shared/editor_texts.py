"""Texts as an editor has them, and what is answered at the place that `|` marks; no server, no client."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from lsprotocol import types

from softmark.interpreter.language_server import code_completion, hover_text, inlay_hints, signature_help
from softmark.interpreter.language_server.published_diagnostics import diagnostics
from softmark.interpreter.language_server.text_document import Document

SCENE = """\
param L = 178 mm in 10 mm .. 1 m
material gel = neo_hookean(young = 60 kPa, poisson = 0.4, density = 1000 kg/m^3)
body beam = solid(box(size = (L, 10 mm, 10 mm)), gel)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2)
model rod = beam6dof(segments = 8)
probe end = point(beam, at = (L, 5 mm, 5 mm))
metric drop = displacement(end, along = -z)
"""
LINES = SCENE.count("\n")


def marked(text: str, folder: Path = Path()) -> tuple[Document, types.Position]:
    """A text without its `|`, and where that was."""
    before, _, after = text.partition("|")
    document = Document(before + after, folder, snippets=True)
    return document, document.position(len(before))


def completed(text: str, folder: Path = Path()) -> list[types.CompletionItem]:
    """What is offered at the mark."""
    document, at = marked(text, folder)
    return code_completion.complete(document, types.CompletionParams(types.TextDocumentIdentifier("a"), at)).items


def hovered(text: str) -> str:
    """What is said of the word at the mark, empty where nothing is."""
    document, at = marked(text)
    found = hover_text.hover(document, types.HoverParams(types.TextDocumentIdentifier("a"), at))
    return found.contents.value if found and isinstance(found.contents, types.MarkupContent) else ""


def signed(text: str) -> tuple[str, str]:
    """The call around the mark as it is shown, and of it the field at hand."""
    document, at = marked(text)
    found = signature_help.signature(document, types.SignatureHelpParams(types.TextDocumentIdentifier("a"), at))
    if found is None:
        return "", ""
    one = found.signatures[0]
    if found.active_parameter is None or not one.parameters:
        return one.label, ""
    label = one.parameters[found.active_parameter].label
    return one.label, label if isinstance(label, str) else one.label[slice(*label)]


def answers(document: Document) -> dict[str, Callable[[], object]]:
    """All that is asked at the end of a text."""
    at, text = document.position(len(document.text)), types.TextDocumentIdentifier("a")
    return {
        "completion": lambda: code_completion.complete(document, types.CompletionParams(text, at)),
        "hover": lambda: hover_text.hover(document, types.HoverParams(text, at)),
        "signature help": lambda: signature_help.signature(document, types.SignatureHelpParams(text, at)),
        "diagnostics": lambda: diagnostics(document),
        "hints": lambda: inlay_hints.hints(
            document, types.InlayHintParams(text, types.Range(types.Position(0, 0), at))
        ),
    }
