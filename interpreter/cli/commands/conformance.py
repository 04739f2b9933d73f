"""Command `dsl conformance`: tests the words of a plugin against their contracts."""

from __future__ import annotations

import argparse

from softmark.grammar.diagnostic import make_visible
from softmark.interpreter.cli.commands.scene_arguments import show


def arguments(parser: argparse.ArgumentParser) -> None:
    """FILE|NAME"""
    parser.add_argument("file", metavar="FILE", help="a plugin: its file, or the name of an installed plugin")


def run(parsed: argparse.Namespace) -> int:
    """Return 0 if a plugin keeps all contracts of its words, 1 if it breaks one, 2 if there is no such plugin."""
    from softmark.interpreter.cli.conformance.plugin_contracts import check_plugin

    found = check_plugin(parsed.file)
    show(found.diagnostics)
    if any(d.code == "E731" for d in found.diagnostics):
        return 2
    untried = sum(d.code == "W732" for d in found.diagnostics)
    said = "all contracts kept" if found.sound else "contracts are broken"
    print(
        make_visible(
            f"{parsed.file}: {', '.join(found.words) or 'no word'}; {said}"
            + (f", {untried} not tried" if untried else "")
        )
    )
    return 0 if found.sound else 1
