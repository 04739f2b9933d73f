"""Command `dsl export`: writes models as input files of other programs."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from softmark.grammar.diagnostic import make_visible
from softmark.interpreter.cli.commands.common_options import add_scene_options, parse_folder
from softmark.interpreter.cli.commands.scene_arguments import errors, load, show
from softmark.interpreter.models.external.exporters import FORMATS


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `dsl export`: `FILE --to FORMAT [--out DIR] [-p NAME=VALUE]... [--model NAME]...`."""
    add_scene_options(parser)
    parser.add_argument("--to", required=True, choices=tuple(FORMATS), help="; ".join(f"{n}: {own.what}" for n, own in
                        FORMATS.items()))  # fmt: skip
    parser.add_argument("--out", metavar="DIR", type=parse_folder, help="where to write (default: SCENE-FORMAT)")


def run(parsed: argparse.Namespace) -> int:
    """Write models as input files of another program, with a sheet of expected results.

    Only the references are solved, not the models.
    """
    scene, found = load(parsed.file, parsed.overrides, parsed.model, parsed.plugins)
    show(errors(found))
    if scene is None or errors(found):
        return 2
    from softmark.interpreter.language.compiled_scene import SceneError
    from softmark.interpreter.validation.requested_names import unknown_models

    if problems := unknown_models(scene, tuple(parsed.model)):
        show(problems)
        return 2
    from softmark.interpreter.pipeline.run_options import RunOptions
    from softmark.interpreter.report.exam_export.exam_input_files import export
    from softmark.interpreter.results.atomic_files import refuse_link

    stem = Path(scene.path).stem if scene.path else "scene"
    target = Path(parsed.out or f"{stem}-{parsed.to}")
    try:
        if not parsed.out:
            refuse_link(target)
        done = export(scene, parsed.to, parsed.model, target, RunOptions(draw=False))
    except SceneError as error:
        show(error.diagnostics)
        return 2
    except OSError as failure:
        print(make_visible(f"error: {target} cannot be written: {failure.strerror}"), file=sys.stderr)
        return 2
    for file in done.written:
        print(make_visible(str(done.folder / file)))
    for what, why in done.left:
        print(make_visible(f"not exported: {what}: {why}"), file=sys.stderr)
    return 0
