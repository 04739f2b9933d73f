"""Command `dsl conformance`: tests whether the words of a plugin keep the contracts of softmark."""

from __future__ import annotations

import argparse

from softmark.grammar.diagnostic import make_visible
from softmark.interpreter.cli.commands.scene_arguments import show


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `dsl conformance`: `FILE|NAME`."""
    parser.add_argument("file", metavar="FILE", help="a plugin: its file, or the name of an installed plugin")


def run(parsed: argparse.Namespace) -> int:
    """Test a plugin and return 0 if its words keep all contracts, 1 if one is broken, 2 if there is no plugin."""
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
