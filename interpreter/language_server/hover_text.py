"""Hover text of words: `textDocument/hover`, with meaning, range, default, and quantities in SI."""

from __future__ import annotations

from bisect import bisect_left

from lsprotocol import types

from softmark.grammar.lexer import Token
from softmark.interpreter.help.reserved_words import unit_page, word_page
from softmark.interpreter.help.word_pages import field_facts, page
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, Parameter
from softmark.interpreter.language.expression_evaluation import Value
from softmark.interpreter.language.field_schema import Constructor
from softmark.interpreter.language_server import hover_markdown
from softmark.interpreter.language_server.cursor_context import NAMES, CursorContext, find_cursor_context
from softmark.interpreter.language_server.declared_names import find_declared_names, format_in_si, format_value
from softmark.interpreter.language_server.text_document import Document


def hover(document: Document, params: types.HoverParams) -> types.Hover | None:
    """Return the hover text of the word at a position, or None if it has none."""
    index = _token_index(document, document.offset(params.position))
    if index is None:
        return None
    token = document.tokens[index]
    said = _hover_of_token(document, index, token)
    if not said:
        return None
    return types.Hover(types.MarkupContent(types.MarkupKind.Markdown, said), document.range(token.span))


def _token_index(document: Document, offset: int) -> int | None:
    """Return the index of the token that contains or starts at an offset, else of the token that ends there."""
    index = bisect_left(document.tokens, offset + 1, key=lambda t: t.start) - 1
    near = [i for i in (index, index - 1) if i >= 0 and offset <= document.tokens[i].end]
    return next((i for i in near if document.tokens[i].kind in (*NAMES, "NUMBER", "UNIT")), near[0] if near else None)


def _hover_of_token(document: Document, index: int, token: Token) -> str:
    if token.kind in ("NUMBER", "UNIT"):
        return _quantity(document.tokens, index)
    if token.kind not in NAMES:
        return hover_markdown.prose(word_page(token.text) or "")
    here = find_cursor_context(document, token.start)
    following = document.tokens[index + 1].kind if index + 1 < len(document.tokens) else ""
    return "" if here is None else _hover_of_name(here, token.text, following)


# ------------------------------------------------------------------ numbers


def _quantity(tokens: list[Token], index: int) -> str:
    """Return the text of a number with its unit converted to SI, or the explanation of a unit."""
    number, unit = (tokens[index], tokens[index + 1 : index + 2]) if tokens[index].kind == "NUMBER" else (None, [])
    if number is None:
        unit, before = [tokens[index]], tokens[index - 1] if index else None
        number = before if before is not None and before.kind == "NUMBER" else None
    if not unit or unit[0].kind != "UNIT":
        return ""
    try:
        measure = units.parse_unit(unit[0].text)
    except units.UnitError:
        return ""
    if number is None:
        return hover_markdown.prose(unit_page(unit[0].text) or "")
    value = float(number.text) * measure.factor
    said = f"{value:.9g} {units.si_unit(measure.dimension)}".removesuffix(" 1")
    return (
        f"`{number.text} {unit[0].text}` is {units.dimension_name(measure.dimension)}: **{hover_markdown.prose(said)}**"
    )


# ------------------------------------------------------------------ names


def _hover_of_name(here: CursorContext, name: str, following: str) -> str:
    """Return the meaning of a name in its context: a kind, a field, a constructor, a choice, or a declaration."""
    frame = here.frames[-1] if here.frames else None
    if not here.before and name in here.document.vocabulary:
        return _page(here, name)
    made = frame.constructor if frame is not None and not frame.value and following == "EQUAL" else None
    if made is not None and (field := made.field(name)) is not None:
        return f"`{field.name}` of `{made.name}`: {hover_markdown.prose(field.doc + field_facts(field))}"
    if following == "LPAR":
        return _hover_of_call(here, name)
    return (
        _of_field(here, name) or _declaration_text(here.document, name) or hover_markdown.prose(word_page(name) or "")
    )


def _hover_of_call(here: CursorContext, name: str) -> str:
    """Return the text of a function or constructor; of several constructors, the one of the expected kind."""
    field = here.call.field if here.call else None
    kind = field.kind if field else here.kind
    words = here.document.vocabulary
    made = words.constructor(kind, name) if kind in words else None
    found = made or next(iter(words.find(name)), None)
    return _hover_of_constructor(here, found) if found else hover_markdown.prose(word_page(name) or "")


def _of_field(here: CursorContext, name: str) -> str:
    """Return the text of a field's choice, of an element, or of a constructor without brackets."""
    field = here.call.field if here.call else None
    if field is None:
        return ""
    if name in field.options:
        return f"`{name}`: a choice for `{field.name}`: {hover_markdown.prose(field.doc + field_facts(field))}"
    if field.kind == "element" and name in here.document.vocabulary.words():
        return _page(here, name)
    words = here.document.vocabulary
    made = field.form in ("value", "fibres") and field.kind in words
    word = words.constructor(field.kind, name) if made else None
    return _hover_of_constructor(here, word) if word and name not in find_declared_names(here.document) else ""


def _hover_of_constructor(here: CursorContext, word: Constructor) -> str:
    owner = here.document.vocabulary.owner(word.kind, word.name)
    return hover_markdown.constructor(word) + (
        f"\n\nFrom the plugin {hover_markdown.prose(owner.name)}" if owner else ""
    )


def _page(here: CursorContext, name: str) -> str:
    title, _, rest = (page(name, here.document.vocabulary) or "").partition("\n")
    return f"{hover_markdown.prose(title)}\n\n```text\n{rest.strip()}\n```"


def _declaration_text(document: Document, name: str) -> str:
    """Return the text of a parameter with its value, or of a declaration; for `rod.eta`, of model and metric."""
    scene = document.known
    if (parameter := scene.parameters.get(name)) is not None:
        return _parameter(parameter)
    if (known := scene.declared.get(name)) is not None:
        return _declaration_summary(known)
    parts = (scene.declared.get(part) for part in name.split(".")[:2]) if "." in name else ()
    return "\n\n---\n\n".join(_declaration_summary(part) for part in parts if part is not None)


def _parameter(p: Parameter) -> str:
    lines = [
        _code_block(f"param {p.name} = {p.text}"),
        f"**{hover_markdown.prose(format_value(p.value))}**, {_si_value_text(p.value)}",
    ]
    if p.interval is not None:
        lines.append(hover_markdown.prose(p.interval.words(p.value.dimension)))
    return "\n\n".join(lines)


def _declaration_summary(d: Declared) -> str:
    return f"{_code_block(d.location.text)}\n\n{d.kind} `{d.name}`: {hover_markdown.prose(d.constructor.summary)}"


def _code_block(text: str) -> str:
    return f"```softmark\n{text}\n```"


def _si_value_text(value: Value) -> str:
    return hover_markdown.prose(f"{units.dimension_name(value.dimension)}, {format_in_si(value, 9)}")
