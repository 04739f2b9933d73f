"""Command `dsl list`: lists words of the language, scenes, units, diagnostic codes and plugins."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import make_visible
from softmark.grammar.name_suggestions import nearest
from softmark.interpreter.cli.commands.common_options import add_plugin_option

if TYPE_CHECKING:
    from softmark.interpreter.language.field_schema import Constructor, Vocabulary


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `dsl list`: `[WHAT]`."""
    parser.add_argument(
        "what", nargs="?", help="models, materials, references, metrics, shapes, scenes, data, codes, units, ..."
    )
    add_plugin_option(parser)
    parser.add_argument(
        "--library", action="store_true", help="with `materials`: those of the library, with their ranges"
    )


def run(parsed: argparse.Namespace) -> int:
    """Print the names of a topic with one line of description each."""
    from softmark.interpreter.cli.commands.scene_arguments import errors, show
    from softmark.interpreter.validation.constructor_registry import vocabulary_with

    words, found = vocabulary_with(parsed.plugins)
    show(found)
    if errors(found):
        return 2
    topics = _topics(words)
    what = parsed.what
    if what is None:
        print("dsl list WHAT, with WHAT one of: " + ", ".join(topics))
        return 0
    what = what if what in topics else _plural(what)
    if what not in topics:
        close = nearest(parsed.what, topics)
        hint = f"did you mean `{close}`?" if close else "lists: " + ", ".join(topics)
        print(make_visible(f"error: there is no list of `{parsed.what}`; {hint}"), file=sys.stderr)
        return 2
    if parsed.library and what != "materials":
        print("error: `--library` is an option of `dsl list materials`", file=sys.stderr)
        return 2
    rows = _material_library_rows() if parsed.library else topics[what]()
    width = max((len(name) for name, _ in rows), default=0)
    for name, text in rows:
        print(f"{name:<{width}}  {text}".rstrip())
    return 0


Rows = list[tuple[str, str]]


def _topics(words: Vocabulary) -> dict[str, Callable[[], Rows]]:
    found: dict[str, Callable[[], Rows]] = {_plural(kind): partial(_constructors, words, kind) for kind in words}
    own: dict[str, Callable[[], Rows]] = {"elements": _elements, "scenes": _scenes, "codes": _codes, "data": _data}
    own["plugins"] = lambda: _plugins(words)
    return found | own | {"units": _units, "functions": _functions}


def _plural(kind: str) -> str:
    """Return the plural of a kind of declaration: `materials`, `bodies`, `published`."""
    from softmark.interpreter.language.field_schema import plural

    return plural(kind).split()[0]


def _constructors(words: Vocabulary, kind: str) -> Rows:
    found = (words.constructor(kind, name) for name in words[kind])
    return [(c.name, _reference_kind_prefix(c) + c.summary + _plugin_suffix(words, c)) for c in found if c is not None]


def _plugin_suffix(words: Vocabulary, c: Constructor) -> str:
    """Return ` [plugin NAME]` for a word that a plugin defines, else an empty text."""
    owner = words.owner(c.kind, c.name)
    return f" [plugin {owner.name}]" if owner else ""


def _plugins(words: Vocabulary) -> Rows:
    """Return a row for each plugin: its words if it was given by `--plugin`, or that it is installed but not loaded."""
    from softmark.interpreter.validation.plugin_loader import installed_plugins

    rows = []
    for one in words.plugins:
        own = [f"{kind} {w}" for kind, table in one.words.items() for w in table]
        own += [f"adapter {w}" for all_ in one.choices.values() for w in all_]
        why = [one.unread] * bool(one.unread) + [f"{kind} {w}: {why}" for (kind, w), why in one.broken.items()]
        rows.append((one.name, "; ".join([", ".join(own) or "nothing", *(f"broken: {w}" for w in why)])))
    named = {one.asked for one in words.plugins}
    others = {n: module for n, module in installed_plugins().items() if n not in named}
    return rows + [
        (n, f"installed ({module}); `--plugin {n}` makes its words available") for n, module in others.items()
    ]


def _reference_kind_prefix(c: Constructor) -> str:
    """Return the kind of a reference, such as `theory: `; an empty text for other words."""
    return f"{c.cls.usually()}: " if c.kind == "reference" else ""


def _material_library_rows() -> Rows:
    from softmark.interpreter.help.material_library import materials

    return [(own.name, f"{own.what} Stretches {own.range_words}; {own.file}") for own in materials().values()]


def _elements() -> Rows:
    from softmark.interpreter.validation.constructor_registry import CATALOGUE

    return [(name, (cls.__doc__ or "").split("\n")[0]) for name, cls in CATALOGUE.words().items()]


def _scenes() -> Rows:
    from softmark.grammar.diagnostic import Source
    from softmark.grammar.parser import parse
    from softmark.grammar.tree import Title
    from softmark.interpreter.language.scene_sources import standard_scenes

    rows = []
    for name, path in standard_scenes().items():
        tree = parse(Source(name, path.read_text(encoding="utf-8")))[0]
        rows.append((name, next((d.text for d in tree.declarations if isinstance(d, Title)), "")))
    return rows


def _data() -> Rows:
    from softmark.references.data_download import PREFIX, TABLE

    return [(f"{PREFIX}{name}", f"{entry.what}; {entry.licence}") for name, entry in TABLE.items()]


def _codes() -> Rows:
    from softmark.interpreter.help.codes import pages

    return [(code, page.title) for code, page in pages().items()]


def _units() -> Rows:
    from softmark.interpreter.language import units

    rows = [
        (name, units.dimension_name(d) + (", takes prefixes" if prefixed else ""))
        for name, (_, d, prefixed) in units.UNITS.items()
        if name != "1"
    ]
    return [*rows, ("prefixes", " ".join(units.PREFIXES))]


def _functions() -> Rows:
    from softmark.interpreter.help.reserved_words import CALLS, PLAIN

    return [*CALLS.values(), *((name, text) for name, text in PLAIN.items())]
