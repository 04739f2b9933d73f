"""Completion candidates from the words of the language and other built-in names."""

from __future__ import annotations


def documented_words(current: str) -> dict[str, str]:
    """Return the names that `dsl explain` describes: words, and diagnostic codes if `current` begins like one."""
    from softmark.interpreter.validation.constructor_registry import CATALOGUE

    if current[:1] in ("E", "W") and current[1:].isdigit():
        from softmark.interpreter.help.codes import pages

        return dict.fromkeys(pages(), "a message")
    from softmark.interpreter.help.reserved_words import CALLS, RESERVED

    found = {**dict.fromkeys(RESERVED, "reserved word"), **dict.fromkeys(CALLS, "function")}
    found |= dict.fromkeys(CATALOGUE.words(), "element") | dict.fromkeys(CATALOGUE, "kind of declaration")
    return found | {name: kind for kind, table in CATALOGUE.items() for name in table}


def topics() -> dict[str, str]:
    """Return the topics of `dsl list`."""
    from softmark.interpreter.cli.commands.list_words import _topics
    from softmark.interpreter.validation.constructor_registry import CATALOGUE

    return dict.fromkeys(_topics(CATALOGUE), "")


def programs() -> dict[str, str]:
    """Return the names of external programs for `external_solver(...)`."""
    from softmark.interpreter.models.external.adapters import PROGRAMS

    return dict.fromkeys(PROGRAMS, "")


def unit_systems() -> dict[str, str]:
    """Return the unit systems of `dsl import`."""
    from softmark.interpreter.importers.deck_units import SYSTEMS

    return dict.fromkeys(SYSTEMS, "")


def deck_file_endings() -> list[str]:
    """Return the endings of the input files that `dsl import` reads."""
    from softmark.interpreter.importers.import_formats import READERS

    return list(READERS)


def result_file_endings() -> list[str]:
    """Return the endings of the result files that `dsl judge` reads."""
    from softmark.interpreter.models.imported_results.readers import READERS

    return list(READERS)
