"""Options, error handling and output shared by the commands `compare`, `board` and `robustness`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.cli.commands.progress_line import Progress
    from softmark.interpreter.language.compiled_scene import Scene

Found = TypeVar("Found")


def parse_count(text: str) -> int:
    """Return `text` as a whole number from 1 to 1000; another text is a command-line error."""
    if not text.isdigit() or not 1 <= int(text) <= 1000:
        raise argparse.ArgumentTypeError(f"`{text}` is not a number from 1 to 1000")
    return int(text)


def parse_positive(text: str) -> float:
    """Return `text` as a positive finite number; another text is a command-line error."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"`{text}` is not a positive number")
    return value


def add_resume_options(parser: argparse.ArgumentParser) -> None:
    """Add the options `--resume` and `--fresh`."""
    again = parser.add_mutually_exclusive_group()
    again.add_argument("--resume", action="store_true", help="continue an earlier run in the same folder")
    again.add_argument("--fresh", action="store_true", help="discard the results of an earlier run in the same folder")


def print_warnings(warnings: Sequence[Diagnostic]) -> None:
    """Print the first warning of each code on one line; the HTML page lists all warnings."""
    from softmark.grammar.diagnostic import make_visible

    first: dict[str, list[Diagnostic]] = {}
    for w in warnings:
        first.setdefault(w.code, []).append(w)
    for code, own in first.items():
        where = f" line {own[0].span.line}" if own[0].span else ""
        more = f" (and {len(own) - 1} more of the kind)" if len(own) > 1 else ""
        print(make_visible(f"{code}{where}: {own[0].message}{more}"), file=sys.stderr)


def run_study(
    work: Callable[[], Found],
    folder: Path,
    parsed: argparse.Namespace,
    progress: Progress,
    name: str,
    scenes: Sequence[Scene],
    page: str | None = None,
) -> Found | int:
    """Run a study and return the result of `work`; if the study fails, print the reason and return the exit status.

    `name` is the base name of the result files. `page` is the name of the HTML page, by default `name` with `.html`.
    """
    from softmark.interpreter.cli.commands.output_collisions import find_collision, input_files, output_files
    from softmark.interpreter.cli.commands.report_folder import symlink_error, unwritable_error, write_error_message
    from softmark.interpreter.cli.commands.scene_arguments import show
    from softmark.interpreter.language.compiled_scene import SceneError
    from softmark.interpreter.study.configurations.configuration_expansion import TooManyConfigurations
    from softmark.interpreter.study.workers import task_journal, worker_pool

    places = [("--out", str(folder))] + ([("--json", parsed.json)] if parsed.json not in (None, "-") else [])
    made = output_files("--out", folder, (f"{name}.json", page or f"{name}.html", "journal.jsonl"))
    outputs = [*made, *(("--json", Path(place)) for option, place in places if option == "--json")]
    read = [place for scene in scenes for place in input_files(scene)]
    linked = symlink_error(folder if parsed.out is None else None)
    if problem := linked or find_collision(outputs, read) or unwritable_error(places, [path for _, path in made]):
        return _print_refusal(progress, problem)
    try:
        found = work()
    except SceneError as error:
        progress.clear()
        show(error.diagnostics)
        return 2
    except (task_journal.JournalRefused, worker_pool.NoWorkers, TooManyConfigurations) as refused:
        return _print_refusal(progress, f"error: {refused}")
    except OSError as error:
        return _print_refusal(progress, write_error_message(str(folder), error, "--out"), 3)
    except task_journal.Interrupted as stop:
        return _print_refusal(progress, f"interrupted; {stop}", 130)
    progress.clear()
    return found


def _print_refusal(progress: Progress, words: str, status: int = 2) -> int:
    from softmark.grammar.diagnostic import make_all_visible

    progress.clear()
    print(make_all_visible(words), file=sys.stderr)
    return status


def write_results(files: Mapping[str, Callable[[], str]], text: str, folder: Path, parsed: argparse.Namespace) -> bool:
    """Write the result files of a study into a folder, and return whether all could be written.

    `text` is the JSON result, which is also written to the path of `--json`.
    """
    from softmark.interpreter.cli.commands.report_folder import write_error_message
    from softmark.interpreter.results.atomic_files import replace

    sound = True
    try:
        for name, made in files.items():
            replace(folder / name, made())
    except OSError as error:
        print(write_error_message(str(folder), error, "--out"), file=sys.stderr)
        sound = False
    return sound if parsed.json is None else write_result(parsed.json, text) and sound


def write_result(place: str, text: str, option: str = "--json") -> bool:
    """Write a text to the path `place` of an option, `-` for standard output; return whether that succeeded."""
    from softmark.interpreter.cli.commands.report_folder import write_error_message
    from softmark.interpreter.results.atomic_files import write_named

    if place == "-":
        sys.stdout.write(text)
        return True
    try:
        write_named(Path(place), text)
    except OSError as error:
        print(write_error_message(place, error, option), file=sys.stderr)
        return False
    return True
