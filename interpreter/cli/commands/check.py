"""Command `dsl check`: reports errors and warnings of scenes without solving anything."""

from __future__ import annotations

import argparse

from softmark.interpreter.cli.commands.common_options import diagnostics_option, override_option, plugin_option
from softmark.interpreter.cli.commands.scene_arguments import has_errors, load, show
from softmark.interpreter.help.diagnostic_formats import FORMATS, LocatedDiagnostic, format_diagnostics


def arguments(parser: argparse.ArgumentParser) -> None:
    """FILE... [--diagnostics text|json|github|sarif] [-p NAME=VALUE]"""
    parser.add_argument(
        "files", nargs="+", metavar="FILE", help="a scene file, a standard scene, or - for standard input"
    )
    override_option(parser)
    plugin_option(parser)
    diagnostics_option(parser, *FORMATS)


def run(parsed: argparse.Namespace) -> int:
    """Check scenes and return 0 if none has an error, else 2."""
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
            print(make_visible(f"{name}: {_contents(scene)}"))
    if parsed.diagnostics != "text":
        print(format_diagnostics(parsed.diagnostics, told), end="")
    return status


def _contents(scene: object) -> str:
    """Return `4 models, 3 references, 5 metrics, 9 expectations`."""
    from softmark.interpreter.language.compiled_scene import Scene

    if not isinstance(scene, Scene):
        return ""
    counts = [(len(scene.of_kind(kind)), kind) for kind in ("model", "reference", "metric")]
    counts.append((len(scene.expectations), "expectation"))
    return "no errors; " + ", ".join(f"{n} {word}{'s' if n != 1 else ''}" for n, word in counts)
