"""Completion items for each position in a scene; `code_completion` returns them to the editor.

To complete a further form of field: add a function to VALUES.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from lsprotocol.types import CompletionItemKind as Kind

from softmark.interpreter.help.constructor_examples import sample
from softmark.interpreter.help.reserved_words import CALLS, RESERVED
from softmark.interpreter.help.word_pages import field_facts
from softmark.interpreter.language import units
from softmark.interpreter.language.field_schema import Constructor, Field, Vocabulary, article
from softmark.interpreter.language.units import Dimension
from softmark.interpreter.language_server.cursor_context import CursorContext, OpenBracket
from softmark.interpreter.language_server.declared_names import dimension, find_declared_names, format_value

STATEMENTS = ("param", "expect", "use", "scene", "softmark")
OWNERS = ("model", "reference")  # kinds that have metrics
OPERATORS = frozenset({"SIGN", "TIMES", "CIRCUMFLEX", "COMPARE", "RANGE", "AND", "OR", "NOT", "IN"})


@dataclass(frozen=True)
class CompletionOffer:
    """Completion item with a short description `detail` and a long one `doc`.

    `snippet`, if given, is the text to insert.
    """

    label: str
    kind: Kind
    detail: str = ""
    doc: str = ""
    snippet: str = ""


def offers(here: CursorContext) -> Iterator[CompletionOffer]:
    """Yield all completions at a position that is not inside quotes and not after a number."""
    frame = here.frames[-1] if here.frames else None
    if not here.before:
        yield from _kinds(here.document.vocabulary)
    elif frame is None:
        yield from _declaration_items(here)
    elif frame.function and frame.constructor is not None:
        yield from _argument(here, frame)
    else:
        yield from _bracket_items(here, frame)


# ------------------------------------------------------------------ outside of brackets


def _kinds(vocabulary: Vocabulary) -> Iterator[CompletionOffer]:
    for kind in vocabulary:
        words = ", ".join(list(vocabulary[kind])[:8])
        yield CompletionOffer(
            kind,
            Kind.Keyword,
            f"declares {article(kind)} {kind}",
            f"`{kind} NAME = CONSTRUCTOR(...)`: {words}, ...",
        )
    for word in STATEMENTS:
        yield CompletionOffer(word, Kind.Keyword, "", RESERVED[word])


def _declaration_items(here: CursorContext) -> Iterator[CompletionOffer]:
    """Yield completions in a declaration outside brackets."""
    last = here.before[-1]
    if here.is_after_equals and len(here.before) == 3:
        yield from constructor_offers(here, here.kind)
        yield from names(here, here.kind)
    elif here.kind == "expect" and (len(here.before) == 1 or last.kind in OPERATORS):
        yield from _metric_items(here)
        if "." not in here.word:
            yield from numbers(here, None)
    elif here.kind == "param" and (last.kind == "EQUAL" or last.kind in OPERATORS):
        yield from numbers(here, None)
    elif here.kind == "use" and last.kind == "STRING":
        yield CompletionOffer("as", Kind.Keyword, "", RESERVED["as"])


def _metric_items(here: CursorContext) -> Iterator[CompletionOffer]:
    """Yield `model.metric` for the model already written, or for all models."""
    known = find_declared_names(here.document)
    owners = [n for n, kind in known.items() if kind in OWNERS and "." not in n]
    metrics = [n for n, kind in known.items() if kind == "metric" and "." not in n]
    written = here.word.split(".")[0] if "." in here.word else ""
    for owner in [written] if written in owners else owners:
        for metric in metrics:
            yield CompletionOffer(
                f"{owner}.{metric}", Kind.Variable, f"metric `{metric}` of the {known[owner]} `{owner}`"
            )


# ------------------------------------------------------------------ in brackets


def _argument(here: CursorContext, frame: OpenBracket) -> Iterator[CompletionOffer]:
    """Yield completion offers inside a call: the fields that are not given yet, or values of the current field."""
    if not frame.name and not frame.value and frame.constructor is not None:
        positional = {f.name for f in frame.constructor.fields[: frame.place]}
        for field in frame.constructor.fields:
            if field.name not in frame.given | positional:
                doc = f"{field.doc}{field_facts(field)}"
                yield CompletionOffer(f"{field.name} = ", Kind.Field, field.expected, doc, f"{field.name} = ")
        if frame.given:
            return
    if frame.field is not None and _is_value_expected(frame):
        yield from field_value_items(here, frame.field)


def _bracket_items(here: CursorContext, frame: OpenBracket) -> Iterator[CompletionOffer]:
    """Yield completions in a group, a list or the brackets of a numeric function such as `sin`."""
    if not _is_value_expected(frame):
        return
    call = here.call
    if frame.function or call is None or call.constructor is None:
        yield from numbers(here, None)
        if here.kind == "expect":
            yield from _metric_items(here)
    elif call.field is not None:
        yield from field_value_items(here, call.field)


def _is_value_expected(frame: OpenBracket) -> bool:
    """Return whether a value is expected, because none is written yet or the last token is an operator."""
    return not frame.value or frame.value[-1].kind in OPERATORS


# ------------------------------------------------------------------ values by the form of a field


def field_value_items(here: CursorContext, field: Field) -> Iterator[CompletionOffer]:
    """Yield completions for the value of a field."""
    yield from VALUES.get(field.form, _number)(here, field)


def _number(here: CursorContext, field: Field) -> Iterator[CompletionOffer]:
    frame = here.frames[-1]
    if not frame.value and frame.function:
        yield CompletionOffer(sample(field), Kind.Value, "an example")
    yield from numbers(here, field.dimension if not frame.value else None)


def numbers(here: CursorContext, due: Dimension | None) -> Iterator[CompletionOffer]:
    """Yield numeric functions, and the parameters with a dimension (any dimension if None)."""
    for name, kind in find_declared_names(here.document).items():
        if kind == "param" and name != here.own and (due is None or dimension(here.document, name) in (due, None)):
            yield CompletionOffer(name, Kind.Constant, value_of(here, name))
    for name, (form, doc) in CALLS.items():
        yield CompletionOffer(name, Kind.Function, form, doc, f"{name}($1)")
    yield CompletionOffer("pi", Kind.Constant, "3.14159...")


def value_of(here: CursorContext, name: str) -> str:
    """Return the formatted value of a parameter; empty if unknown."""
    parameter = here.document.known.parameters.get(name)
    if parameter is None:
        return ""
    return format_value(parameter.value)


def _choice(here: CursorContext, field: Field) -> Iterator[CompletionOffer]:
    for option in field.options:
        yield CompletionOffer(option, Kind.EnumMember, "default" if option == field.default else "", field.doc)


def _flag(here: CursorContext, field: Field) -> Iterator[CompletionOffer]:
    for word in ("yes", "no"):
        yield CompletionOffer(word, Kind.EnumMember, "default" if (word == "yes") == field.default else "", field.doc)


def _name(here: CursorContext, field: Field) -> Iterator[CompletionOffer]:
    yield from names(here, field.kind, *field.also)


def names(here: CursorContext, *kinds: str) -> Iterator[CompletionOffer]:
    """Yield declared names of some kinds, except that of the current declaration."""
    scene = here.document.known
    for name, kind in find_declared_names(here.document).items():
        if kind in kinds and name != here.own:
            known = scene.declared.get(name)
            yield CompletionOffer(name, Kind.Variable, f"{kind}: {known.constructor.name}" if known else kind)


def _value(here: CursorContext, field: Field) -> Iterator[CompletionOffer]:
    if field.kind == "element":
        for word, cls in here.document.vocabulary.words().items():
            yield CompletionOffer(word, Kind.EnumMember, (cls.__doc__ or "").strip().split("\n")[0])
        return
    yield from names(here, field.kind)
    yield from constructor_offers(here, field.kind)


def constructor_offers(here: CursorContext, kind: str) -> Iterator[CompletionOffer]:
    """Yield the constructors of a kind."""
    known = {
        of: name for name, of in find_declared_names(here.document).items() if name != here.own
    }  # last declared name of each kind
    vocabulary = here.document.vocabulary
    for name in vocabulary.get(kind, {}):
        if (c := vocabulary.constructor(kind, name)) is not None:
            yield CompletionOffer(name, Kind.Constructor, c.summary, "", snippet(c, known))


def snippet(c: Constructor, known: dict[str, str]) -> str:
    """Return the text of a call with its required fields as placeholders: `fem(element = ${1:tet4})$0`.

    `known` has declared names by kind, which are proposed as values.
    """
    required = [f for f in c.fields if f.required]
    if not c.fields:
        return f"{c.name}()"
    given = (
        f"{f.name} = ${{{i}:{_escape_snippet(known.get(f.kind) or sample(f))}}}" for i, f in enumerate(required, 1)
    )
    return f"{c.name}({', '.join(given) or '$1'})$0"


def _escape_snippet(text: str) -> str:
    return text.replace("\\", "\\\\").replace("$", "\\$").replace("}", "\\}")


def _direction(here: CursorContext, field: Field) -> Iterator[CompletionOffer]:
    for sign, word in (("-", "against"), ("+", "along")):
        for axis in "xyz":
            yield CompletionOffer(sign + axis, Kind.EnumMember, f"{word} {axis}")


def _fibres(here: CursorContext, field: Field) -> Iterator[CompletionOffer]:
    yield from _direction(here, field)
    yield from _value(here, field)


def _components(here: CursorContext, field: Field) -> Iterator[CompletionOffer]:
    for axis in "xyz":
        yield CompletionOffer(axis, Kind.EnumMember, field.doc)


def _condition(here: CursorContext, field: Field) -> Iterator[CompletionOffer]:
    for axis in "xyz":
        yield CompletionOffer(axis, Kind.Variable, "coordinate before deformation")
    yield from names(here, "region")
    yield CompletionOffer("not", Kind.Keyword, "", RESERVED["not"])
    if here.frames[-1].value:
        yield from numbers(here, units.LENGTH)


def _study_target_items(here: CursorContext, field: Field) -> Iterator[CompletionOffer]:
    """Yield completions of a quantity that a study varies: parameters, and fields of declarations as `name.field`."""
    scene = here.document.known
    for name, kind in find_declared_names(here.document).items():
        if kind == "param":
            yield CompletionOffer(name, Kind.Constant, value_of(here, name))
    for name, known in scene.declared.items():
        for own in known.constructor.fields:
            if own.form in ("quantity", "integer", "choice", "flag", "vector"):
                yield CompletionOffer(f"{name}.{own.name}", Kind.Field, own.expected, own.doc)


def _no_items(here: CursorContext, field: Field) -> Iterator[CompletionOffer]:
    yield from ()


VALUES: dict[str, Callable[[CursorContext, Field], Iterator[CompletionOffer]]] = {
    "choice": _choice,
    "flag": _flag,
    "name": _name,
    "names": _name,
    "value": _value,
    "direction": _direction,
    "fibres": _fibres,
    "components": _components,
    "condition": _condition,
    "target": _study_target_items,
    "targets": _study_target_items,
    "text": _no_items,
    "texts": _no_items,
    "file": _no_items,
    "files": _no_items,
}
