"""The reference of every word: a page for each kind of declaration, made of what `dsl explain` says."""

from __future__ import annotations

import html
import inspect
from collections import Counter
from functools import cache

from softmark.interpreter.documentation.docstring_markdown import described, escaped, fenced, folded
from softmark.interpreter.help import validity_ranges, word_pages
from softmark.interpreter.help.constructor_examples import example
from softmark.interpreter.help.material_library import Kept, materials
from softmark.interpreter.help.reserved_words import CALLS, PLAIN, RESERVED, unit_page
from softmark.interpreter.language import units
from softmark.interpreter.language.field_schema import Constructor, Field
from softmark.interpreter.validation.constructor_registry import CATALOGUE
from softmark.references.reference_base import Reference

FOLDER = "reference"
SIGN = "# The words of the language\n\nWhat `dsl explain NAME` prints, as pages; made from the classes themselves."


def pages() -> dict[str, str]:
    """Markdown by the name of its file: of each kind, of words that are no constructors, and of the library."""
    kinds = {f"{FOLDER}/{kind}.md": _kind(kind) for kind in CATALOGUE}
    others = {f"{FOLDER}/words.md": _words(), f"{FOLDER}/units.md": _units(), f"{FOLDER}/library.md": _library()}
    names = [path.removeprefix(f"{FOLDER}/").removesuffix(".md") for path in (*kinds, *others)] + ["others"]
    tree = "\n".join(["```{toctree}", ":maxdepth: 1", "", *names, "```"])
    return {f"{FOLDER}/index.md": f"{SIGN}\n\n{tree}\n", **kinds, **others}


@cache
def _several() -> set[str]:
    """Words that more than one kind has."""
    found = Counter(name for kind in CATALOGUE for name in CATALOGUE[kind])
    return {name for name, count in found.items() if count > 1}


@cache
def _also_fields() -> set[str]:
    """Names of fields, and choices of fields: such a word in a sentence need not be the constructor."""
    fields = [f for c in word_pages.constructors() for f in c.fields]
    return {f.name for f in fields} | {o for f in fields for o in f.options}


def target(c: Constructor) -> str:
    """What the role `word` calls it: its name, and where several kinds have it the kind too."""
    return f"{c.name} ({c.kind})" if c.name in _several() else c.name


def linked(word: str) -> str | None:
    """A word in a sentence as a link to its section, if it can be nothing else."""
    if word in _several() | _also_fields() or not CATALOGUE.find(word):
        return None
    return f"{{word}}`{word}`"


def _anchor(name: str) -> str:
    return f"```{{word}} {name}\n```"


def _kind(kind: str) -> str:
    own = [c for name in CATALOGUE[kind] if (c := CATALOGUE.constructor(kind, name))]
    rows = [f"{{word}}`{c.name} <{target(c)}>`\n: {escaped(c.summary)}" for c in own]
    fields = [
        f"- {_name(f)} of {{word}}`{c.name} <{target(c)}>`: {escaped(f.doc)}"
        for c in word_pages.constructors() if c.kind != kind and (f := c.field(kind))
    ]  # fmt: skip
    takes = ["## Fields of this name", "\n".join(fields)] if fields else []
    listed = "\n".join([":::{container} words", "\n\n".join(rows), ":::"])
    head = [_anchor(f"{kind} (kind)"), f"# {kind}", fenced("text", f"{kind} NAME = CONSTRUCTOR(...)"), listed]
    return "\n\n".join([*head, *(constructor(c) for c in own), *takes]) + "\n"


def _name(f: Field) -> str:
    return f"`{f.name}`"


def constructor(c: Constructor) -> str:
    """The section of one word: what it is, its fields, an example, its source, where it was measured to be right."""
    index = [f"single: {f.name} (field); {c.name}" for f in c.fields]
    parts = [_anchor(target(c)), *([_index(index)] if index else []), f"## `{c.name}`"]

    def others(word: str) -> str | None:
        return None if word == c.name else linked(word)

    parts.append(described(inspect.getdoc(c.cls) or "", others))
    parts += ["**Fields**, in this order:" if c.fields else "It has no fields.", *(_field(f) for f in c.fields)]
    parts += ["**Example**", fenced("scene", f"{c.kind} NAME = {example(c)}")]
    if issubclass(c.cls, Reference):
        about = f"{c.cls.usually()}, {c.cls.means}" if c.cls.means else c.cls.usually()
        parts += [f"**Kind:** {escaped(about)}", f"**Source:** {escaped(c.cls.source)}"]
    if measured := validity_ranges.lines(c.name):
        parts.append(folded(html.escape("Where it was measured to be right"), fenced("text", "\n".join(measured))))
    return "\n\n".join(parts)


def _index(entries: list[str]) -> str:
    return "\n".join(["```{indexed}", *entries, "```"])


def _field(f: Field) -> str:
    facts = word_pages.facts(f).strip(" []")
    return f"{_name(f)}\n: {escaped(f.doc, linked)}\n\n  {{.facts}}\n  {escaped(facts)}"


def _words() -> str:
    """Reserved words, functions, names with a meaning of their own, and elements."""
    parts = ["# Reserved words, functions, elements", "## Reserved words"]
    parts += [f"{_anchor(name)}\n\n`{name}`\n: {escaped(text)}" for name, text in RESERVED.items()]
    parts += ["## Functions", *(f"`{call}`\n: {escaped(text)}" for call, text in CALLS.values())]
    parts += ["## Names with a meaning", *(f"`{name}`\n: {escaped(text)}" for name, text in PLAIN.items())]
    parts.append("## Elements")
    for name, cls in CATALOGUE.words().items():
        parts += [_anchor(name), f"### `{name}`", described(inspect.getdoc(cls) or "")]
    return "\n\n".join(parts) + "\n"


def _units() -> str:
    """Units, what they measure, and their size in SI."""
    said = [(name, unit_page(name)) for name in units.UNITS if name != "1"]
    rows = [f"`{name}`\n: {escaped(_size(name, page))}" for name, page in said if page]
    prefixes = f"Some take prefixes: {', '.join(f'`{p}`' for p in units.PREFIXES)}."
    return "\n\n".join(["# Units", prefixes, ":::{container} words", *rows, ":::"]) + "\n"


def _size(name: str, page: str) -> str:
    """What the page of a unit says first, and whether it takes prefixes."""
    said = page.split("\n\n", 1)[1].split("\n")[0].removeprefix("It ").removeprefix("measures ")
    return said.removesuffix(".") + ("; takes prefixes" if units.UNITS[name][2] else "")


def _library() -> str:
    """The materials of the library, with their sources."""
    head = "# The library of materials\n\nOf each `dsl explain NAME` shows the curve of a pull as well."
    return "\n\n".join([head, *(_kept(own) for own in materials().values())]) + "\n"


def _kept(own: Kept) -> str:
    said = [f"{key}\n: {escaped(text)}" for key, text in own.said.items()]
    use = f'use "{own.file}" as lib    # and then lib.{own.name}'
    text = own.text.replace(", ", ",\n    ") if len(own.text) > 90 else own.text
    return "\n\n".join(
        [_anchor(own.name), f"## `{own.name}`", escaped(own.what), fenced("scene", f"{text}\n\n{use}"), *said]
    )
