"""Completion candidates from the vocabulary and other names built into softmark."""

from __future__ import annotations


def documented_words(current: str) -> dict[str, str]:
    """Return names with a page in `dsl explain`: words with their descriptions, and codes once one is begun."""
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
    """Return the programs of `external_solver(...)`."""
    from softmark.interpreter.models.external.adapters import PROGRAMS

    return dict.fromkeys(PROGRAMS, "")


def systems() -> dict[str, str]:
    """Return the unit systems of `dsl import`."""
    from softmark.interpreter.importers.deck_units import SYSTEMS

    return dict.fromkeys(SYSTEMS, "")


def decks() -> list[str]:
    """Return the file endings that `dsl import` reads."""
    from softmark.interpreter.importers.import_formats import READERS

    return list(READERS)


def results() -> list[str]:
    """Return the file endings that `dsl judge` reads."""
    from softmark.interpreter.models.imported_results.readers import READERS

    return list(READERS)
