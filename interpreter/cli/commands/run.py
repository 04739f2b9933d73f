"""Command `dsl run`: solves the models of a scene and writes a report."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from softmark.interpreter.cli.commands.common_options import add_diagnostics_option, add_scene_options, parse_folder

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.cli.commands.progress_line import Progress
    from softmark.interpreter.cli.commands.report_folder import ReportWriter
    from softmark.interpreter.pipeline.cached_results import RunCache
    from softmark.interpreter.pipeline.run_options import RunOptions, SceneText
    from softmark.interpreter.results.run_report import Report


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `dsl run`.

    `FILE [-p NAME=VALUE]... [--model NAME]... [--out DIR] [--json FILE|-] [--junit FILE] [--vtu] [--stated] [--fresh]
    [--watch]` and more.
    """
    add_scene_options(parser)
    parser.add_argument(
        "--out", type=parse_folder, metavar="DIR", help="folder for report.html and report.json (default: NAME-report)"
    )
    parser.add_argument("--json", metavar="FILE", help="write the JSON report to FILE; - is standard output")
    parser.add_argument("--junit", metavar="FILE", help="write models and expectations as a JUnit file")
    add_diagnostics_option(parser, "github")
    parser.add_argument("--vtu", action="store_true", help="write meshes and surfaces for ParaView as well")
    stated = "also compute the error estimates that each take about as long as a solution"
    parser.add_argument("--stated", action="store_true", help=stated)
    fresh = "reuse no results of an earlier run in the same folder, not even unchanged ones"
    parser.add_argument("--fresh", action="store_true", help=fresh)
    parser.add_argument(
        "--watch", action="store_true", help="run again whenever the scene or one of its files is saved"
    )
    parser.add_argument("--repeat", type=_count, default=1, metavar="N", help="time each solution N times")


def _count(text: str) -> int:
    if not text.isdigit() or not 1 <= int(text) <= 1000:
        raise argparse.ArgumentTypeError(f"`{text}` is not a number from 1 to 1000")
    return int(text)


def run(parsed: argparse.Namespace, reading: Callable[[], SceneText] | None = None) -> int:
    """Run a scene, write its report, and return the exit status.

    By default the scene is `parsed.file`; if `reading` is given, it returns the scene and may raise Unread.
    """
    from softmark.interpreter.cli.commands.progress_line import Progress

    if reading is None and parsed.watch:
        from softmark.interpreter.cli.commands.watch_mode import watch

        return watch(parsed)
    progress = Progress(sys.stderr)
    progress.say("start", f"running {parsed.file}")  # before anything is imported or read
    try:
        return _run(parsed, progress, reading)
    finally:
        progress.clear()


def _run(parsed: argparse.Namespace, progress: Progress, reading: Callable[[], SceneText] | None) -> int:
    from softmark.interpreter.cli.commands.report_folder import ReportWriter, UnusableReportPlace
    from softmark.interpreter.cli.commands.scene_arguments import SceneReadError, read_scene, show
    from softmark.interpreter.help.diagnostic_formats import LocatedDiagnostic, format_diagnostics
    from softmark.interpreter.language.compiled_scene import SceneError
    from softmark.interpreter.pipeline.run_options import RunOptions, SceneText
    from softmark.interpreter.pipeline.run_pipeline import run_to_report

    def warn(found: Sequence[Diagnostic]) -> None:
        progress.clear()
        if parsed.diagnostics == "text":
            show(found)
        else:
            _annotate(format_diagnostics("github", [LocatedDiagnostic(parsed.file, d) for d in found]), parsed)

    shelf = ReportWriter(parsed)
    stated = () if parsed.stated else None
    options = RunOptions(
        tuple(parsed.model),
        parsed.repeat,
        progress.say,
        shelf.begin,
        shelf.save_unfinished,
        warn,
        stated=stated,
        free=True,
        beside=True,
    )
    try:
        text = (
            reading()
            if reading
            else SceneText(*read_scene(parsed.file), tuple(parsed.overrides), tuple(parsed.plugins))
        )
        keeper = None if reading else _run_cache(parsed, shelf, progress)
        report = run_to_report(text, options) if keeper is None else _run_with_cache(text, options, keeper)
    except SceneReadError as unread:
        warn([unread.diagnostic])
        return 2
    except SceneError as error:
        warn(error.diagnostics)
        return 2
    except UnusableReportPlace as problem:
        progress.clear()
        print(problem, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        if not shelf.begun:
            raise
        progress.clear()
        print(f"interrupted; {shelf.rescue()}", file=sys.stderr)
        return 130
    except BaseException:
        shelf.rescue()
        raise
    progress.clear()
    return _write_and_print(report, parsed, shelf)


def _run_with_cache(text: SceneText, options: RunOptions, keeper: RunCache) -> Report:
    """Run a scene with reuse of saved results, save the new results, and return the report."""
    from softmark.interpreter.pipeline.cached_results import OutdatedResults
    from softmark.interpreter.pipeline.run_pipeline import run_to_report

    try:
        return run_to_report(text, options, keeper)
    except OutdatedResults:
        return run_to_report(text, options, keeper.without_saved_results())


def _run_cache(parsed: argparse.Namespace, shelf: ReportWriter, progress: Progress) -> RunCache:
    """Return the run cache in the folder of the report.

    With `--vtu` no saved results are reused, because they do not contain the meshes to be written.
    """
    from softmark.grammar.diagnostic import make_visible
    from softmark.interpreter.study.run_cache.result_keeper import FolderRunCache

    def remark(text: str) -> None:
        progress.clear()
        print(make_visible(text), file=sys.stderr)

    return FolderRunCache(lambda: shelf.folder, parsed.fresh or parsed.vtu, remark)


def _write_and_print(report: Report, parsed: argparse.Namespace, shelf: ReportWriter) -> int:
    """Write and print the finished report, and return the exit status."""
    from softmark.grammar.diagnostic import make_visible
    from softmark.interpreter.report.run import report_terminal

    written = shelf.finish(report)
    if parsed.json != "-":
        print(report_terminal.table(report, sys.stdout.isatty()))
        if written:
            print(f"\nreport: {make_visible(written)}")
    if parsed.diagnostics == "github":
        from softmark.interpreter.help.diagnostic_formats.github import annotate_report

        _annotate(annotate_report(report), parsed)
    return 3 if shelf.failed else report.exit_status


def _annotate(commands: str, parsed: argparse.Namespace) -> None:
    """Print GitHub workflow commands to standard output, or to standard error if `--json -` writes JSON there."""
    print(commands, end="", file=sys.stderr if parsed.json == "-" else sys.stdout)
