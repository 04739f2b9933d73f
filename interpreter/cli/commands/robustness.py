"""Command `dsl robustness` (alias `dsl stress`): runs robustness studies of the models of a scene."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import make_visible
from softmark.interpreter.cli.commands.common_options import add_scene_options
from softmark.interpreter.cli.commands.common_options import parse_folder as folder_name
from softmark.interpreter.cli.commands.study_options import (
    add_resume_options,
    parse_count,
    parse_positive,
    print_warnings,
    run_study,
    write_results,
)

if TYPE_CHECKING:
    from softmark.interpreter.cli.commands.progress_line import Progress
    from softmark.interpreter.study.configurations.configuration_expansion import SceneSubject
    from softmark.interpreter.study.robustness.robustness_record import Robustness
    from softmark.interpreter.study.robustness.robustness_study import RobustnessRequest


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `dsl robustness`.

    `FILE [-p NAME=VALUE]... [--model NAME]... [--study NAME] [--out DIR] [--json FILE]` and more.
    """
    parser.description = (
        "Vary the parameters of each model of a scene until it becomes wrong. Each tested value is right, inaccurate "
        "with a warning, silent (converged and wrong without a warning), or without a solution. The exit status is 1 "
        "if a value is silent."
    )
    add_scene_options(parser)
    parser.add_argument("--study", metavar="NAME", help="only this robustness study of the scene")
    parser.add_argument("--out", type=folder_name, metavar="DIR",
                        help="folder for stress.html, stress.json and journal.jsonl"
                        " (default: NAME-stress)")  # fmt: skip
    parser.add_argument("--json", metavar="FILE", help="write the JSON result to FILE; - is standard output")
    parser.add_argument(
        "--jobs", type=parse_count, default=1, metavar="N", help="compute solutions in N parallel processes"
    )
    parser.add_argument("--timeout", type=parse_positive, default=60.0, metavar="S",
                        help="stop each solution that takes more than S seconds of CPU time (default: 60)")  # fmt: skip
    parser.add_argument("--memory", type=parse_positive, default=4.0, metavar="GIB",
                        help="largest address space of each process, GiB (default: 4)")  # fmt: skip
    add_resume_options(parser)


def run(parsed: argparse.Namespace) -> int:
    """Run the robustness studies of a scene; return 1 if a result is wrong without a warning."""
    from softmark.interpreter.cli.commands.progress_line import Progress

    progress = Progress(sys.stderr)
    progress.say("start", f"testing the robustness of {parsed.file}")
    try:
        return _run_and_write_studies(parsed, progress)
    finally:
        progress.clear()


def _run_and_write_studies(parsed: argparse.Namespace, progress: Progress) -> int:
    from softmark.interpreter.cli.commands.scene_arguments import load, show
    from softmark.interpreter.study.configurations.configuration_expansion import subject_of
    from softmark.interpreter.validation.requested_names import without_unrequested_warnings

    scene, diagnostics = load(parsed.file, parsed.overrides, parsed.model, parsed.plugins)
    progress.clear()
    if scene is None:
        show(diagnostics)
        return 2
    print_warnings(without_unrequested_warnings(scene, tuple(parsed.model), diagnostics))
    for name, model in scene.of_kind("model").items():
        if model.thing.reason_without_robustness and (not parsed.model or name in parsed.model):
            print(make_visible(f"left out: model `{name}`: {model.thing.reason_without_robustness}"), file=sys.stderr)
    subject = subject_of(scene)
    folder = Path(parsed.out if parsed.out is not None else f"{subject.name}-stress")
    work = lambda: _run_study(subject, _request(parsed, folder, progress))  # noqa: E731
    found = run_study(work, folder, parsed, progress, "stress", [scene])
    return found if isinstance(found, int) else _write_result(found, folder, parsed)


def _run_study(subject: SceneSubject, request: RobustnessRequest) -> Robustness:
    from softmark.interpreter.study.robustness.robustness_study import run_robustness_studies

    return run_robustness_studies(subject, request)


def _request(parsed: argparse.Namespace, folder: Path, progress: Progress) -> RobustnessRequest:
    from softmark.interpreter.study.robustness.robustness_study import RobustnessRequest

    return RobustnessRequest(
        folder=folder, models=tuple(parsed.model), study=parsed.study, jobs=parsed.jobs, timeout=parsed.timeout,
        memory=parsed.memory, resume=parsed.resume, fresh=parsed.fresh, command=shlex.join(["dsl", *sys.argv[1:]]),
        say=progress.say,
    )  # fmt: skip


def _write_result(found: Robustness, folder: Path, parsed: argparse.Namespace) -> int:
    """Write the result files of a robustness study, print its table, and return the exit status."""
    from softmark.interpreter.cli.commands.scene_arguments import supports_colour
    from softmark.interpreter.report.robustness.robustness_page import page
    from softmark.interpreter.report.robustness.robustness_terminal import table

    text = found.dumps()
    files = {"stress.json": lambda: text, "stress.html": lambda: page(found)}
    sound = write_results(files, text, folder, parsed)
    if parsed.json != "-":
        colour, shown = sys.stdout.isatty() and supports_colour(), str(folder / "stress.html")
        print(table(found, parsed.file, parsed.overrides, colour, shown if sound else None))
    return found.exit_status if sound else 3
