"""Command `dsl compare`: compares errors and times of all models in scenes and their studies."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softmark.grammar.diagnostic import make_visible
from softmark.interpreter.cli.commands.common_options import add_override_option, add_plugin_option
from softmark.interpreter.cli.commands.common_options import parse_folder as folder_name
from softmark.interpreter.cli.commands.study_options import (
    add_resume_options,
    parse_count,
    parse_positive,
    print_warnings,
    run_study,
    write_result,
    write_results,
)

if TYPE_CHECKING:
    from softmark.interpreter.cli.commands.progress_line import Progress
    from softmark.interpreter.study.analysis.comparison_record import ComparisonRecord
    from softmark.interpreter.study.comparison_study import Comparison, ComparisonRequest
    from softmark.interpreter.study.configurations.configuration_expansion import SceneSubject


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `dsl compare`.

    `FILE... [-p NAME=VALUE]... [--model NAME]... [--vary NAME=VALUE,...]... [--study NAME] [--out DIR]` and more.
    """
    what = (
        "scenes (files, standard scenes, or -); or two JSON files of `dsl run` or `dsl compare`, whose differences "
        "are listed"
    )
    parser.add_argument("files", nargs="+", metavar="FILE", help=what)
    add_override_option(parser)
    add_plugin_option(parser)
    parser.add_argument(
        "--model", action="append", default=[], metavar="NAME", help="use only this model; may be repeated"
    )
    vary = (
        "vary a parameter, a field, or the model (`model=a,b`), instead of the scene's studies; if repeated, all "
        "combinations are computed"
    )
    parser.add_argument("--vary", action="append", default=[], metavar="NAME=VALUE,...", help=vary)
    parser.add_argument("--study", metavar="NAME", help="only this study of the scene")
    parser.add_argument("--out", type=folder_name, metavar="DIR",
                        help="folder for compare.html, compare.json and journal.jsonl"
                        " (default: NAME-comparison)")  # fmt: skip
    parser.add_argument("--json", metavar="FILE", help="write the JSON result to FILE; - is standard output")
    comment = (
        "with two JSON files: write their differences to FILE, as Markdown for a pull request; - is standard output"
    )
    parser.add_argument("--markdown", metavar="FILE", help=comment)
    add_work_options(parser)


def add_work_options(parser: argparse.ArgumentParser) -> None:
    """Add options for workers, time limits and repeated timing."""
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--jobs", type=parse_count, default=1, metavar="N", help="compute errors in N parallel processes"
    )
    where.add_argument("--cluster", metavar="ADDRESS", help="compute errors on a dask cluster, such as tcp://host:8786")
    parser.add_argument(
        "--timeout", type=parse_positive, metavar="S", help="stop each configuration that takes more than S seconds"
    )
    repeats = "measure the time of each configuration N times, one process at a time (default: 5; 0: no timing)"
    parser.add_argument("--repeats", type=_parse_count_or_zero, default=5, metavar="N", help=repeats)
    add_resume_options(parser)
    disturbed = "use timings even if other processes disturbed them"
    parser.add_argument("--allow-contaminated", action="store_true", help=disturbed)


def _parse_count_or_zero(text: str) -> int:
    return 0 if text == "0" else parse_count(text)


def run(parsed: argparse.Namespace) -> int:
    """Compare scenes, or two result files, and return the exit status."""
    results = [name for name in parsed.files if name.endswith(".json")]
    if results:
        if len(results) == len(parsed.files) == 2:
            return _print_changes(parsed)
        print("error: give two JSON files and nothing else to see what has changed", file=sys.stderr)
        return 2
    if parsed.markdown is not None:
        print("error: `--markdown` needs two JSON files, between which it shows the changes", file=sys.stderr)
        return 2
    from softmark.interpreter.cli.commands.progress_line import Progress

    progress = Progress(sys.stderr)
    progress.say("start", f"comparing {', '.join(parsed.files)}")
    try:
        return _compare(parsed, progress)
    finally:
        progress.clear()


def _print_changes(parsed: argparse.Namespace) -> int:
    """Print the changes between two result files, and return the exit status."""
    import json

    from softmark.interpreter.cli.commands.output_collisions import find_collision
    from softmark.interpreter.report.comparison.comparison_changes import changes_table
    from softmark.interpreter.report.comparison.comparison_comment import comment
    from softmark.interpreter.study.analysis import result_changes

    asked = {"--json": parsed.json, "--markdown": parsed.markdown}
    given = [("a result that is compared", Path(name)) for name in parsed.files]
    files = [(option, Path(name)) for option, name in asked.items() if name not in (None, "-")]
    if problem := find_collision(files, given):
        print(problem, file=sys.stderr)
        return 2
    try:
        old, new = (result_changes.read_result(name) for name in parsed.files)
        found = result_changes.find_changes(old, new, (parsed.files[0], parsed.files[1]))
    except result_changes.NotComparable as foreign:
        print(make_visible(f"error: {foreign}"), file=sys.stderr)
        return 2
    texts = {
        "--json": lambda: json.dumps(found.to_json(), indent=1, ensure_ascii=False) + "\n",
        "--markdown": lambda: comment(found),
    }
    if all(name is None for name in asked.values()):
        print(changes_table(found, sys.stdout.isatty()))
    sound = [write_result(name, texts[option](), option) for option, name in asked.items() if name is not None]
    return 0 if all(sound) else 3


# ------------------------------------------------------------------ scenes


def _compare(parsed: argparse.Namespace, progress: Progress) -> int:
    subjects = _subjects(parsed, progress)
    if subjects is None:
        return 2
    folder = Path(parsed.out if parsed.out is not None else _default_folder(subjects))
    work, scenes = lambda: _run_comparison(subjects, folder, parsed, progress), [s.scene for s in subjects]
    found = run_study(work, folder, parsed, progress, "compare", scenes)
    return found if isinstance(found, int) else _write_result(found, folder, parsed)


def _run_comparison(
    subjects: list[SceneSubject], folder: Path, parsed: argparse.Namespace, progress: Progress
) -> Comparison:  # fmt: skip
    from softmark.interpreter.study.comparison_study import compare

    def accurate(found: ComparisonRecord) -> None:
        """Print the errors of all configurations as soon as they are known, long before timing ends."""
        from softmark.interpreter.report.comparison.comparison_terminal import error_tables

        progress.clear()
        print(error_tables(found, colour=True), end="\n\n", file=sys.stderr, flush=True)

    request = comparison_request(
        parsed, folder, progress, parsed.resume, vary=tuple(parsed.vary), models=tuple(parsed.model),
        study=parsed.study, accurate=accurate if progress.live else None,
    )  # fmt: skip
    return compare(subjects, request)


def _subjects(parsed: argparse.Namespace, progress: Progress) -> list[SceneSubject] | None:
    """Return the scenes with unique short names.

    If a scene has errors, print them and return None.
    """
    from softmark.interpreter.cli.commands.scene_arguments import load, show
    from softmark.interpreter.study.configurations.configuration_expansion import subject_of
    from softmark.interpreter.validation.requested_names import without_unrequested_warnings

    found: list[SceneSubject] = []
    sound = True
    for name in parsed.files:
        scene, diagnostics = load(name, parsed.overrides, parsed.model, parsed.plugins)
        progress.clear()
        if scene is None:
            show(diagnostics)
            sound = False
        else:
            print_warnings(without_unrequested_warnings(scene, tuple(parsed.model), diagnostics))
            found.append(subject_of(scene, [s.name for s in found]))
    return found if sound else None


def _default_folder(subjects: list[SceneSubject]) -> str:
    return f"{subjects[0].name}-comparison" if len(subjects) == 1 else "comparison"


def comparison_request(
    parsed: argparse.Namespace, folder: Path, progress: Progress, resume: bool, **asked: Any
) -> ComparisonRequest:
    """Return the settings of a comparison.

    They come from the options of `add_work_options` in `parsed`, and from the keyword arguments `asked`.
    """
    from softmark.interpreter.cli import exit_signals
    from softmark.interpreter.study.comparison_study import ComparisonRequest

    return ComparisonRequest(
        folder=folder, jobs=parsed.jobs, cluster=parsed.cluster, timeout=parsed.timeout, repeats=parsed.repeats,
        resume=resume, fresh=parsed.fresh, allow_contaminated=parsed.allow_contaminated,
        command=shlex.join(["dsl", *sys.argv[1:]]), say=progress.say,
        saying=exit_signals.set_interrupt_message, **asked,
    )  # fmt: skip


def _write_result(comparison: Comparison, folder: Path, parsed: argparse.Namespace) -> int:
    """Write the result files of a comparison, print its table, and return the exit status."""
    from softmark.interpreter.report.comparison.comparison_page import page
    from softmark.interpreter.report.comparison.comparison_terminal import table

    found, text = comparison.found, comparison.dumps()
    sound = write_results({"compare.json": lambda: text, "compare.html": lambda: page(found)}, text, folder, parsed)
    if parsed.json != "-":
        print(table(found, sys.stdout.isatty(), str(folder / "compare.html") if sound else None))
    return comparison.exit_status if sound else 3
