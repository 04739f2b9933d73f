"""Command `dsl judge`: evaluates result files of other programs by the metrics of a scene.

Each file becomes a model of the scene, although the text of the scene does not mention it.
"""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from softmark.interpreter.cli.commands import run as running
from softmark.interpreter.cli.commands.common_options import (
    add_diagnostics_option,
    add_override_option,
    add_plugin_option,
    parse_folder,
)
from softmark.interpreter.cli.commands.report_folder import symlink_error
from softmark.interpreter.cli.commands.scene_arguments import SceneReadError, read_scene

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Source
    from softmark.interpreter.pipeline.run_options import SceneText

FIELDS = {  # fields of `results(...)` by option, and whether their value is quoted
    "unit": ("unit of length of the files, such as 1mm (default: 1 m)", False),
    "at": ('name of the displacement vectors, or "position"', True),
    "rest": ("a file with the undeformed points", True),
    "time": ("unit of time of the files, such as 1ms (default: 1 s)", False),
    "within": ("how far the body may reach outside the mesh of the file, such as 1mm", False),
    "by": ("how points are identified: by `place` or by `nodes`", False),
    "body": ("the body, if the scene has several", False),
}


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `dsl judge`.

    `SCENE RESULT... [--as NAME]... [--unit U] [--at NAME] [--model NAME]... [--out DIR] [--json FILE|-]`.
    """
    parser.add_argument("file", metavar="SCENE", help="a scene file, a standard scene, or - for standard input")
    parser.add_argument(
        "results", metavar="RESULT", nargs="+", help="a file: .vtu, .pvd, .vtk, .xdmf, .frd, .xplt or .csv"
    )
    parser.add_argument("--as", action="append", default=[], dest="names", metavar="NAME",
                        help="name of each result, in order (default: the name of its file)")  # fmt: skip
    for name, (meaning, _) in FIELDS.items():
        parser.add_argument(f"--{name}", metavar=name.upper(), default="1 m" if name == "unit" else None, help=meaning)
    parser.add_argument("--model", action="append", default=[], metavar="NAME",
                        help="also compute this model of the scene; models that metrics compare with are always "
                             "computed")  # fmt: skip
    add_override_option(parser)
    add_plugin_option(parser)
    parser.add_argument("--out", type=parse_folder, metavar="DIR", help="folder of the report (default: NAME-judged)")
    parser.add_argument("--json", metavar="FILE", help="write the JSON report to FILE; - is standard output")
    parser.add_argument("--junit", metavar="FILE", help="write models and expectations as a JUnit file")
    add_diagnostics_option(parser, "github")


def run(parsed: argparse.Namespace) -> int:
    """Evaluate result files with the metrics of a scene, and return the exit status of the report."""
    names = list(parsed.names)
    if len(names) > len(parsed.results):
        print(f"dsl judge: error: `--as {names[-1]}` has no result: {len(parsed.results)} given", file=sys.stderr)
        return 2
    scene = _scene_source_or_error(parsed.file)
    declared = [] if isinstance(scene, SceneReadError) else _declared_names(scene[0])
    if name := next((own for own in names if own in declared), None):
        other = f"call it `--as {_unused_name(name, declared)}`"
        print(f"dsl judge: error: `--as {name}`: the scene already declares `{name}`; {other}",
              file=sys.stderr)  # fmt: skip
        return 2
    for path in parsed.results[len(names) :]:
        names.append(_name_for_file(path, [*names, *declared]))
    compared = [] if isinstance(scene, SceneReadError) else _compared_models(scene, parsed)
    parsed.model = list(dict.fromkeys([*names, *parsed.model, *compared]))
    parsed.vtu, parsed.stated, parsed.repeat = False, False, 1
    if parsed.out is None and parsed.json is None:
        parsed.out = f"{Path(parsed.file).stem or 'scene'}-judged"
        if problem := symlink_error(Path(parsed.out)):
            print(problem, file=sys.stderr)
            return 2
    return running.run(parsed, lambda: _scene_with_results(scene, parsed, names))


def _scene_source_or_error(file: str) -> tuple[Source, Path, Path | None] | SceneReadError:
    """Return the source, folder and file of a scene, or the error if it cannot be read.

    Standard input can be read only once, so the error is kept and reported later.
    """
    try:
        return read_scene(file)
    except SceneReadError as unread:
        return unread


def _declared_names(source: Source) -> list[str]:
    """Return the names that a scene declares.

    Parts that cannot be parsed are skipped; their errors are reported later.
    """
    from softmark.grammar import tree
    from softmark.grammar.parser import parse

    return [d.name for d in parse(source)[0].declarations if isinstance(d, tree.Declare | tree.Param)]


def _compared_models(scene: tuple[Source, Path, Path | None], parsed: argparse.Namespace) -> list[str]:
    """Return the models that metrics are measured against, so that they can be computed as well."""
    from softmark.interpreter.validation.constructor_registry import compile_source

    compiled, _ = compile_source(*scene, parsed.overrides, parsed.plugins)
    models, metrics = compiled.of_kind("model"), compiled.of_kind("metric").values()
    return [name for name in dict.fromkeys(metric.thing.measured_from for metric in metrics) if name in models]


def _unused_name(name: str, taken: list[str]) -> str:
    """Return `name_2`, or `name` with the next larger number that is not in `taken`."""
    return next(own for n in range(2, len(taken) + 3) if (own := f"{name}_{n}") not in taken)


def _name_for_file(path: str, taken: list[str]) -> str:
    """Return a valid model name for a result file, different from the names in `taken`."""
    found = re.sub(r"\W+", "_", Path(path).stem, flags=re.ASCII).strip("_").lower() or "theirs"
    found = found if found[0].isalpha() else f"result_{found}"
    return found if found not in taken else _unused_name(found, taken)


def _scene_with_results(
    scene: tuple[Source, Path, Path | None] | SceneReadError, parsed: argparse.Namespace, names: list[str]
) -> SceneText:
    """Return the scene with one more model for each result file, called by the `names`. Raises Unread."""
    from softmark.grammar.diagnostic import Source
    from softmark.interpreter.pipeline.run_options import SceneText

    if isinstance(scene, SceneReadError):
        raise scene
    source, place, file = scene
    given = [(n, getattr(parsed, n)) for n in FIELDS if getattr(parsed, n) is not None]
    fields = "".join(f", {n} = {_quote_text(_absolute_file_option(n, v)) if FIELDS[n][1] else v}" for n, v in given)
    lines = [
        f"model {name} = results({_quote_text(str(Path(path).resolve()))}{fields})"
        for name, path in zip(names, parsed.results, strict=True)
    ]
    text = source.text.rstrip() + "\n\n# judged\n" + "\n".join(lines) + "\n"
    return SceneText(Source(source.name, text), place, file, tuple(parsed.overrides), tuple(parsed.plugins))


def _absolute_file_option(field: str, value: str) -> str:
    """Return the value of an option; a file name becomes an absolute path."""
    return str(Path(value).resolve()) if field == "rest" else value


def _quote_text(value: str) -> str:
    return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
