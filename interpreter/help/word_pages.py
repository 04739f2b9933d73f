"""Explanation page of a word of the language or of a diagnostic code, printed by `dsl explain`."""

from __future__ import annotations

import inspect
import re

from softmark.interpreter.help import validity_ranges
from softmark.interpreter.help.constructor_examples import example
from softmark.interpreter.help.reserved_words import unit_page, word_page
from softmark.interpreter.language import foreign_aliases, renamed_words, units
from softmark.interpreter.language.field_schema import Constructor, Field, Vocabulary
from softmark.interpreter.language.foreign_words import explain_foreign_word
from softmark.interpreter.validation.constructor_registry import CATALOGUE
from softmark.references.reference_base import Reference

CODE = re.compile(r"[EW]\d{3}$", re.IGNORECASE)


def page(name: str, words: Vocabulary = CATALOGUE) -> str | None:
    """Return the explanation page of a name, None if the name is unknown; `words` may include words of plugins."""
    if CODE.match(name):
        from softmark.interpreter.help.codes import pages

        known = pages().get(name.upper())
        return known.text if known else None
    if found := words.find(name):
        return "\n\n".join(constructor_page(c) for c in found)
    if name in words:
        rows = [words.constructor(name, n) for n in words[name]]
        lines = "\n".join(f"  {c.name:<24}{c.summary}" for c in rows if c)
        fields = _field_page(name)
        return f"{name}: declared as `{name} NAME = CONSTRUCTOR(...)`\n\n{lines}" + (f"\n\n{fields}" if fields else "")
    if word := word_page(name):
        return word
    if name in CATALOGUE.words():
        return f"{name} (element)\n\n{inspect.getdoc(CATALOGUE.words()[name])}"
    if used := _field_page(name) or _choice_page(name):
        return used
    if present := renamed_words.present_names().get(name):
        return f"`{name}` is an earlier name of `{present}`.\n\n{page(present)}"
    meant = foreign_aliases.WORDS.get(name) or foreign_aliases.SYNONYMS.get(name) or foreign_aliases.CHOICES.get(name)
    if meant and not explain_foreign_word(name) and not unit_page(name):
        said = f"`{name}` is not a word of this language; here it is called `{meant}`."
        return f"{said}\n\n{page(meant) or _field_page(meant)}"
    return unit_page(name) or _library_page(name)


def _library_page(name: str) -> str | None:
    """Return the page of a library material, None for an unknown name."""
    from softmark.interpreter.help import material_library

    return material_library.page(name)


def _field_page(name: str) -> str:
    """Return the page of a field name: the constructors that have a field of this name."""
    owners = [(c, f) for c in constructors() if (f := c.field(name))]
    return "\n".join(f"field of `{c.name}`: {f.doc}{field_facts(f)}" for c, f in owners)


def _choice_page(name: str) -> str:
    """Return the page of an option: the fields that have this option."""
    owners = [(c, f) for c in constructors() for f in c.fields if name in f.options]
    return "\n".join(f"choice for `{f.name}` of `{c.name}`: {f.doc}{field_facts(f)}" for c, f in owners)


def constructors() -> list[Constructor]:
    """Return all constructors of the language."""
    made = (CATALOGUE.constructor(kind, n) for kind, table in CATALOGUE.items() for n in table)
    return [c for c in made if c is not None]


def constructor_page(c: Constructor) -> str:
    """Return the page of a constructor: description, fields, example, source and measured validity ranges."""
    lines = [f"{c.name} ({c.kind})", "", inspect.getdoc(c.cls) or "", "", "Fields, in this order:"]
    width = max((len(f.name) for f in c.fields), default=0)
    lines += [f"  {f.name:<{width}}  {f.doc}{field_facts(f)}" for f in c.fields]
    if not c.fields:
        lines.append("  none")
    lines += ["", f"Example: {c.kind} NAME = {example(c)}"]
    if issubclass(c.cls, Reference):
        about = f"{c.cls.usually()}, {c.cls.means}" if c.cls.means else c.cls.usually()
        lines += ["", f"Kind: {about}", f"Source: {c.cls.source}"]
    if measured := validity_ranges.lines(c.name):
        lines += ["", *measured]
    return "\n".join(lines)


def field_facts(f: Field) -> str:
    """Return the dimension, range and default of a field as text."""
    facts = [f.expected if f.form != "quantity" or f.dimension is None else _dimension(f)]
    if f.interval is not None and f.form in ("quantity", "vector", "integer", "each"):
        facts.append(f.interval.words(f.dimension or units.NONE))
    facts += ["may vary in space"] if f.varies else []
    if f.required:
        facts.append("required")
    elif f.default is not None or "default:" not in f.doc:  # or the meaning says what replaces it
        facts.append(f"default {_default(f)}")
    return f" [{'; '.join(facts)}]"


def _dimension(f: Field) -> str:
    named, usual = units.dimension_name(f.dimension or units.NONE), units.usual_units(f.dimension or units.NONE)
    return named if f.dimension == units.NONE or named.endswith(usual) else f"{named}, in {usual}"


def _default(f: Field) -> str:
    if f.form == "condition" and f.default is not None:
        return "everywhere"
    if f.default is None:
        return "the only one" if f.form == "name" and f.kind == "body" else "none"
    if f.form == "flag":
        return "yes" if f.default else "no"
    if f.form == "quantity" and f.dimension is not None:
        return units.format_value(f.default, f.dimension)
    if f.form == "components":
        return "(" + ", ".join("xyz"[i] for i in f.default) + ")"
    if f.form == "direction":
        axes = {"+": 1.0, "-": -1.0}.items()
        named = (sign + "xyz"[i] for sign, one in axes for i in range(3) if f.default[i] == one)
        return next(named, str(f.default))
    if f.form == "vector":
        return "(" + ", ".join(f"{v:g}" for v in f.default) + f") {units.si_unit(f.dimension or units.NONE)}"
    return str(f.default) or "none"


def plugin_word_pages(words: Vocabulary, name: str) -> str | None:
    """Return the pages of a plugin's word `name`; None if no plugin has it.

    The language's own word of that name, if any, is included.
    """
    found = [(c, words.owner(c.kind, c.name)) for c in words.find(name)] if words.plugins else []
    chosen = {(kind, word) for p in words.plugins for kind, word, _ in p.choices}
    if not any(owner or (c.kind, c.name) in chosen for c, owner in found):
        return None
    pages = (
        constructor_page(c) + (f"\n\nFrom the plugin {p.name}: class {c.cls.__name__}" if p else "") for c, p in found
    )
    return "\n\n".join(pages)
