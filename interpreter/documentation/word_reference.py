"""Reference pages of all words: one page for each kind of declaration, from the texts of `dsl explain`."""

from __future__ import annotations

import html
import inspect
from collections import Counter
from functools import cache

from softmark.interpreter.documentation.docstring_markdown import (
    code_block,
    collapsible,
    docstring_to_markdown,
    escape_markup,
)
from softmark.interpreter.help import validity_ranges, word_pages
from softmark.interpreter.help.constructor_examples import example
from softmark.interpreter.help.material_library import LibraryMaterial, materials
from softmark.interpreter.help.reserved_words import CALLS, PLAIN, RESERVED, unit_page
from softmark.interpreter.language import units
from softmark.interpreter.language.field_schema import Constructor, Field
from softmark.interpreter.validation.constructor_registry import CATALOGUE
from softmark.references.reference_base import Reference

FOLDER = "reference"
SIGN = "# The words of the language\n\nThese pages contain the text that `dsl explain NAME` prints."


def pages() -> dict[str, str]:
    """Return Markdown by file name: one page for each kind, one for other words, one for the material library."""
    kinds = {f"{FOLDER}/{kind}.md": _kind_page(kind) for kind in CATALOGUE}
    others = {
        f"{FOLDER}/words.md": _reserved_words_page(),
        f"{FOLDER}/units.md": _units(),
        f"{FOLDER}/library.md": _library(),
    }
    names = [path.removeprefix(f"{FOLDER}/").removesuffix(".md") for path in (*kinds, *others)] + ["others"]
    tree = "\n".join(["```{toctree}", ":maxdepth: 1", "", *names, "```"])
    return {f"{FOLDER}/index.md": f"{SIGN}\n\n{tree}\n", **kinds, **others}


@cache
def _ambiguous_words() -> set[str]:
    """Return the words that are constructors of more than one kind."""
    found = Counter(name for kind in CATALOGUE for name in CATALOGUE[kind])
    return {name for name, count in found.items() if count > 1}


@cache
def _field_words() -> set[str]:
    """Return the names of fields and their options; in a sentence such a word may not mean the constructor."""
    fields = [f for c in word_pages.constructors() for f in c.fields]
    return {f.name for f in fields} | {o for f in fields for o in f.options}


def target(c: Constructor) -> str:
    """Return the link target of a constructor: its name, with its kind if several kinds have that name."""
    return f"{c.name} ({c.kind})" if c.name in _ambiguous_words() else c.name


def link_to_word(word: str) -> str | None:
    """Return the Markdown link to the section of a word, None if the word is ambiguous or unknown."""
    if word in _ambiguous_words() | _field_words() or not CATALOGUE.find(word):
        return None
    return f"{{word}}`{word}`"


def _anchor(name: str) -> str:
    return f"```{{word}} {name}\n```"


def _kind_page(kind: str) -> str:
    own = [c for name in CATALOGUE[kind] if (c := CATALOGUE.constructor(kind, name))]
    rows = [f"{{word}}`{c.name} <{target(c)}>`\n: {escape_markup(c.summary)}" for c in own]
    fields = [
        f"- {_name(f)} of {{word}}`{c.name} <{target(c)}>`: {escape_markup(f.doc)}"
        for c in word_pages.constructors() if c.kind != kind and (f := c.field(kind))
    ]  # fmt: skip
    takes = ["## Fields of this name", "\n".join(fields)] if fields else []
    listed = "\n".join([":::{container} words", "\n\n".join(rows), ":::"])
    head = [_anchor(f"{kind} (kind)"), f"# {kind}", code_block("text", f"{kind} NAME = CONSTRUCTOR(...)"), listed]
    return "\n\n".join([*head, *(constructor_section(c) for c in own), *takes]) + "\n"


def _name(f: Field) -> str:
    return f"`{f.name}`"


def constructor_section(c: Constructor) -> str:
    """Return the section of one constructor: description, fields, example, source and measured validity ranges."""
    index = [f"single: {f.name} (field); {c.name}" for f in c.fields]
    parts = [_anchor(target(c)), *([_index(index)] if index else []), f"## `{c.name}`"]

    def others(word: str) -> str | None:
        return None if word == c.name else link_to_word(word)

    parts.append(docstring_to_markdown(inspect.getdoc(c.cls) or "", others))
    parts += ["**Fields**, in this order:" if c.fields else "It has no fields.", *(_field_entry(f) for f in c.fields)]
    parts += ["**Example**", code_block("scene", f"{c.kind} NAME = {example(c)}")]
    if issubclass(c.cls, Reference):
        about = f"{c.cls.usually()}, {c.cls.means}" if c.cls.means else c.cls.usually()
        parts += [f"**Kind:** {escape_markup(about)}", f"**Source:** {escape_markup(c.cls.source)}"]
    if measured := validity_ranges.lines(c.name):
        parts.append(
            collapsible(html.escape("Where it was measured to be right"), code_block("text", "\n".join(measured)))
        )
    return "\n\n".join(parts)


def _index(entries: list[str]) -> str:
    return "\n".join(["```{indexed}", *entries, "```"])


def _field_entry(f: Field) -> str:
    facts = word_pages.field_facts(f).strip(" []")
    return f"{_name(f)}\n: {escape_markup(f.doc, link_to_word)}\n\n  {{.facts}}\n  {escape_markup(facts)}"


def _reserved_words_page() -> str:
    """Return the page of reserved words, functions, predefined names and elements."""
    parts = ["# Reserved words, functions, elements", "## Reserved words"]
    parts += [f"{_anchor(name)}\n\n`{name}`\n: {escape_markup(text)}" for name, text in RESERVED.items()]
    parts += ["## Functions", *(f"`{call}`\n: {escape_markup(text)}" for call, text in CALLS.values())]
    parts += ["## Names with a meaning", *(f"`{name}`\n: {escape_markup(text)}" for name, text in PLAIN.items())]
    parts.append("## Elements")
    for name, cls in CATALOGUE.words().items():
        parts += [_anchor(name), f"### `{name}`", docstring_to_markdown(inspect.getdoc(cls) or "")]
    return "\n\n".join(parts) + "\n"


def _units() -> str:
    """Return the page section of units, with the quantities that they measure and their size in SI."""
    said = [(name, unit_page(name)) for name in units.UNITS if name != "1"]
    rows = [f"`{name}`\n: {escape_markup(_unit_size_and_prefixes(name, page))}" for name, page in said if page]
    prefixes = f"Some take prefixes: {', '.join(f'`{p}`' for p in units.PREFIXES)}."
    return "\n\n".join(["# Units", prefixes, ":::{container} words", *rows, ":::"]) + "\n"


def _unit_size_and_prefixes(name: str, page: str) -> str:
    """Return the size of a unit, the first line of its page, and whether it takes prefixes."""
    said = page.split("\n\n", 1)[1].split("\n")[0].removeprefix("It ").removeprefix("measures ")
    return said.removesuffix(".") + ("; takes prefixes" if units.UNITS[name][2] else "")


def _library() -> str:
    """Return the page of the material library, with the sources of the materials."""
    head = "# The library of materials\n\n`dsl explain NAME` also plots the tension curve of a material."
    return "\n\n".join([head, *(_library_section(own) for own in materials().values())]) + "\n"


def _library_section(own: LibraryMaterial) -> str:
    said = [f"{key}\n: {escape_markup(text)}" for key, text in own.said.items()]
    use = f'use "{own.file}" as lib    # and then lib.{own.name}'
    text = own.text.replace(", ", ",\n    ") if len(own.text) > 90 else own.text
    return "\n\n".join(
        [_anchor(own.name), f"## `{own.name}`", escape_markup(own.what), code_block("scene", f"{text}\n\n{use}"), *said]
    )
