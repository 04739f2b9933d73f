"""Syntax file for Kate, KDevelop and other users of KSyntaxHighlighting, and the language server in Kate."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree as Xml

from softmark.interpreter.language_server.syntax_highlighting.highlighted_words import NAME, NUMBER, words

TITLE = "syntax highlighting and the language server for Kate"
SYNTAX, SERVER = "softmark.xml", "lspclient-settings.json"
STYLES = {  # name of a style, and its default style
    "Reserved": "dsKeyword", "Kind": "dsDataType", "Name": "dsVariable", "Constructor": "dsFunction",
    "Function": "dsBuiltIn", "Constant": "dsConstant", "Field": "dsAttribute", "Number": "dsFloat",
    "Unit": "dsAnnotation", "Text": "dsString", "Comment": "dsComment", "Normal": "dsNormal",
}  # fmt: skip


def files() -> dict[str, bytes]:
    """Return the syntax file, and the settings of Kate's plugin for language servers."""
    server = {"servers": {"softmark": {"command": ["dsl", "lsp"], "highlightingModeRegex": "^softmark scene$"}}}
    return {SYNTAX: syntax(), SERVER: (json.dumps(server, indent=2) + "\n").encode()}


def install(folder: Path) -> str:
    """Return instructions on how to install the files from `folder` in Kate."""
    return (
        f"cp {folder / SYNTAX} ~/.local/share/org.kde.syntax-highlighting/syntax/\n"
        f"The language server: put what {folder / SERVER} says into Settings, LSP Client, User Server Settings."
    )


def syntax() -> bytes:
    """Return the KSyntaxHighlighting file for Kate as XML."""
    own = words()
    root = Xml.Element("language", name="softmark scene", section="Scientific", version="1", kateversion="5.62",
                       extensions="*.scene", mimetype="text/x-softmark-scene", license="Apache-2.0")  # fmt: skip
    colours = Xml.SubElement(root, "highlighting")
    lists = {"reserved": own.reserved, "kinds": own.kinds, "constructors": own.constructors,
             "functions": own.functions, "constants": own.constants}  # fmt: skip
    for name, entries in lists.items():
        within = Xml.SubElement(colours, "list", name=name)
        for word in entries:
            Xml.SubElement(within, "item").text = word
    contexts = Xml.SubElement(colours, "contexts")
    _contexts(contexts)
    data = Xml.SubElement(colours, "itemDatas")
    for style, looks in STYLES.items():
        Xml.SubElement(data, "itemData", name=style, defStyleNum=looks)
    general = Xml.SubElement(root, "general")
    Xml.SubElement(Xml.SubElement(general, "comments"), "comment", name="singleLine", start="#")
    Xml.SubElement(general, "keywords", casesensitive="1")
    Xml.indent(root)
    head = b'<?xml version="1.0" encoding="UTF-8"?>\n<!DOCTYPE language>\n'
    return head + Xml.tostring(root, encoding="unicode").encode() + b"\n"


def _contexts(contexts: Xml.Element) -> None:
    """Add the contexts in which rules apply: at the start, after a kind, after a number, and in a text."""

    def rule(into: Xml.Element, tag: str, style: str, **given: str) -> None:
        Xml.SubElement(into, tag, {"attribute": style, "context": "#stay", **given})

    def context(name: str, style: str = "Normal", **given: str) -> Xml.Element:
        return Xml.SubElement(
            contexts, "context", {"name": name, "attribute": style, "lineEndContext": "#stay", **given}
        )

    main = context("Scene")
    rule(main, "DetectSpaces", "Normal")
    rule(main, "DetectChar", "Comment", char="#", context="Comment")
    rule(main, "DetectChar", "Text", char='"', context="Text")
    rule(main, "RegExpr", "Kind", String=rf"^\s*{NAME}(?=\s+{NAME}\s*=)", context="Declared", lookAhead="true")
    rule(main, "keyword", "Reserved", String="reserved")
    rule(main, "RegExpr", "Field", String=rf"\b{NAME}(?=\s*=(?!=))")
    rule(main, "RegExpr", "Number", String=rf"(?<![\w.]){NUMBER}", context="Number")
    rule(main, "AnyChar", "Normal", String=")]", context="Number")
    rule(main, "RegExpr", "Normal", String=rf"\b{NAME}(?=\()", context="Called", lookAhead="true")
    rule(main, "RegExpr", "Normal", String=rf"\b{NAME}(\.{NAME})+")
    rule(main, "keyword", "Constant", String="constants")
    rule(main, "RegExpr", "Normal", String=NAME)
    declared = context("Declared", lineEndContext="#pop", fallthroughContext="#pop")
    rule(declared, "DetectSpaces", "Normal")
    rule(declared, "keyword", "Kind", String="kinds")
    rule(declared, "keyword", "Reserved", String="reserved")
    rule(declared, "RegExpr", "Name", String=NAME, context="#pop")
    called = context("Called", fallthroughContext="#pop", lineEndContext="#pop")
    rule(called, "keyword", "Constructor", String="constructors", context="#pop")
    rule(called, "keyword", "Function", String="functions", context="#pop")
    rule(called, "RegExpr", "Normal", String=NAME, context="#pop")
    number = context("Number", fallthroughContext="#pop", lineEndContext="#pop")
    rule(number, "RegExpr", "Unit", String=_unit(), context="#pop")
    context("Comment", "Comment", lineEndContext="#pop")
    text = context("Text", "Text", lineEndContext="#pop")
    rule(text, "RegExpr", "Text", String=r'\\["\\]')
    rule(text, "DetectChar", "Text", char='"', context="#pop")


def _unit() -> str:
    factor = r"(?:%|°?[^\W\d_]\w*)(?:\^[+-]?\d+(?:\.\d+)?)?"
    reserved = "|".join(words().reserved)
    return rf"[ \t]*(?!(?:{reserved})\b){factor}(?:[*/·](?:\([\w*/^·-]+\)|{factor})(?![\w(]))*"
