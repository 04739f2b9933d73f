"""Command `dsl check`: reports errors and warnings of scenes without solving them."""

from __future__ import annotations

import argparse

from softmark.interpreter.cli.commands.common_options import (
    add_diagnostics_option,
    add_override_option,
    add_plugin_option,
)
from softmark.interpreter.cli.commands.scene_arguments import has_errors, load, show
from softmark.interpreter.help.diagnostic_formats import FORMATS, LocatedDiagnostic, format_diagnostics


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `dsl check`: `FILE... [--diagnostics text|json|github|sarif] [-p NAME=VALUE]`."""
    parser.add_argument(
        "files", nargs="+", metavar="FILE", help="a scene file, a standard scene, or - for standard input"
    )
    add_override_option(parser)
    add_plugin_option(parser)
    add_diagnostics_option(parser, *FORMATS)


def run(parsed: argparse.Namespace) -> int:
    """Check scenes, print their diagnostics, and return 0 if none has an error, else 2."""
    from softmark.grammar.diagnostic import make_visible

    status, told = 0, []
    for name in parsed.files:
        scene, found = load(name, parsed.overrides, plugins=parsed.plugins)
        if parsed.diagnostics == "text":
            show(found)
        else:
            told += [LocatedDiagnostic(name, diagnostic) for diagnostic in found]
        if scene is None or has_errors(found):
            status = 2
        elif parsed.diagnostics == "text":
            print(make_visible(f"{name}: {_describe_counts(scene)}"))
    if parsed.diagnostics != "text":
        print(format_diagnostics(parsed.diagnostics, told), end="")
    return status


def _describe_counts(scene: object) -> str:
    """Return the numbers of declarations in a scene as text: `4 models, 3 references, 5 metrics, 9 expectations`."""
    from softmark.interpreter.language.compiled_scene import Scene

    if not isinstance(scene, Scene):
        return ""
    counts = [(len(scene.of_kind(kind)), kind) for kind in ("model", "reference", "metric")]
    counts.append((len(scene.expectations), "expectation"))
    return "no errors; " + ", ".join(f"{n} {word}{'s' if n != 1 else ''}" for n, word in counts)
