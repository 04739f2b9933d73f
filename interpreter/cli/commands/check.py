"""`dsl check`."""

from __future__ import annotations

import argparse
import json

from softmark.interpreter.cli.commands.options import override_option, plugin_option
from softmark.interpreter.cli.commands.scenes import has_errors, load, show


def arguments(parser: argparse.ArgumentParser) -> None:
    """FILE... [--diagnostics text|json] [-p NAME=VALUE]"""
    parser.add_argument(
        "files", nargs="+", metavar="FILE", help="a scene file, a standard scene, or - for standard input"
    )
    override_option(parser)
    plugin_option(parser)
    parser.add_argument(
        "--diagnostics",
        choices=("text", "json"),
        default="text",
        help="json: one object a line on standard output",
    )


def run(parsed: argparse.Namespace) -> int:
    """0 if no scene has an error, else 2."""
    from softmark.grammar.diagnostic import visible

    status = 0
    for name in parsed.files:
        scene, found = load(name, parsed.overrides, plugins=parsed.plugins)
        if parsed.diagnostics == "json":
            from softmark.grammar.diagnostic import to_json

            for diagnostic in found:
                print(json.dumps(to_json(diagnostic), ensure_ascii=False))
        else:
            show(found)
        if scene is None or has_errors(found):
            status = 2
        elif parsed.diagnostics == "text":
            print(visible(f"{name}: {_contents(scene)}"))
    return status


def _contents(scene: object) -> str:
    """`4 models, 3 references, 5 metrics, 9 expectations`."""
    from softmark.interpreter.language.scene import Scene

    if not isinstance(scene, Scene):
        return ""
    counts = [(len(scene.of_kind(kind)), kind) for kind in ("model", "reference", "metric")]
    counts.append((len(scene.expectations), "expectation"))
    return "no errors; " + ", ".join(f"{n} {word}{'s' if n != 1 else ''}" for n, word in counts)
