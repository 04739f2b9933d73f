"""Words that editors highlight, from the grammar and the tables of constructors."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

NAME = r"[A-Za-z_]\w*"
NUMBER = r"(?:\d+(?:\.(?!\.)\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
COORDINATES = ("x", "y", "z")


@dataclass(frozen=True)
class Words:
    """Words of the language by role, each list sorted."""

    reserved: list[str]
    kinds: list[str]
    constructors: list[str]
    functions: list[str]  # functions of numbers
    constants: list[str]  # elements, choices of fields, coordinates, `yes`, `no` and `pi`


@cache
def words() -> Words:
    """Return the words of the language, without plugins."""
    from softmark.grammar.parse_table import reserved_words
    from softmark.interpreter.help.reserved_words import CALLS, PLAIN
    from softmark.interpreter.help.word_pages import constructors
    from softmark.interpreter.validation.constructor_registry import CATALOGUE

    made = constructors()
    choices = {option for c in made for f in c.fields for option in f.options}
    names = {c.name for c in made}
    constants = {*choices, *CATALOGUE.words(), *PLAIN} - {""}
    return Words(sorted(reserved_words()), sorted(CATALOGUE), sorted(names), sorted(CALLS), sorted(constants))


def any_of(names: list[str]) -> str:
    """Return a regular expression that matches any of several words, trying the longest first."""
    return "|".join(sorted(names, key=lambda name: (-len(name), name)))
