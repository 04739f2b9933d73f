"""Command `dsl explain`: prints the help page of a word of the language, a unit, or a diagnostic code."""

from __future__ import annotations

import argparse
import sys

from softmark.grammar.diagnostic import make_visible
from softmark.interpreter.cli.commands.common_options import add_plugin_option
from softmark.interpreter.help.unknown_words import hint
from softmark.interpreter.help.word_pages import page, plugin_word_pages
from softmark.interpreter.validation.constructor_registry import vocabulary_with


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `dsl explain`: `NAME|CODE`."""
    add_plugin_option(parser)
    parser.add_argument(
        "name", metavar="NAME|CODE", help="a word of the language, such as `cylinder`, or a code, such as E204"
    )


def run(parsed: argparse.Namespace) -> int:
    """Print the help page of a constructor, a kind of declaration, another word, a unit, or a diagnostic code."""
    from softmark.interpreter.cli.commands.scene_arguments import errors, show

    words, found = vocabulary_with(parsed.plugins)
    show(found)
    if errors(found):
        return 2
    text = plugin_word_pages(words, parsed.name) or page(parsed.name, words)
    if text is None:
        print(make_visible(f"error: there is nothing called `{parsed.name}`; {hint(parsed.name)}"), file=sys.stderr)
        return 2
    print(text)
    return 0
