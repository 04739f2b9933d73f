"""Command `dsl board`: makes a leaderboard site of every model on every case of a suite.

Errors and times are computed as by `dsl compare`.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import make_all_visible, make_visible
from softmark.interpreter.cli.commands.common_options import parse_folder as folder_name
from softmark.interpreter.cli.commands.compare import add_work_options, comparison_request
from softmark.interpreter.cli.commands.study_options import run_study, write_results

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.cli.commands.progress_line import Progress
    from softmark.interpreter.language.compiled_scene import Scene
    from softmark.interpreter.study.comparison_study import Comparison
    from softmark.interpreter.study.leaderboard.leaderboard_cells import Board
    from softmark.interpreter.study.leaderboard.suite_cases import BoardCase

STANDARD = "2026"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `dsl board`.

    `[SUITE|FILE...] [--out DIR] [--json FILE|-] [--against OLD] [--check]` and more.
    """
    what = (
        "a suite, or scenes, each of which is one case measured by its first error metric (default: the suite "
        f"{STANDARD})"
    )
    parser.add_argument("files", nargs="*", metavar="FILE", help=what)
    parser.add_argument("--out", type=folder_name, metavar="DIR",
                        help="folder for index.html, board.json and journal.jsonl (default: board)")  # fmt: skip
    parser.add_argument("--json", metavar="FILE", help="write the JSON result to FILE; - is standard output")
    parser.add_argument("--against", metavar="OLD", help="an earlier board.json: print what has changed, as Markdown")
    also = "also run another program, such as `calculix`, on the finite element models of each scene"
    parser.add_argument("--also", action="append", default=[], metavar="PROGRAM", help=also)
    parser.add_argument("--check", action="store_true", help="read the suite and its scenes; compute nothing")
    add_work_options(parser)


def run(parsed: argparse.Namespace) -> int:
    """Make a leaderboard and return the exit status: 3 if a case or a model has no result."""
    from softmark.interpreter.cli.commands.progress_line import Progress
    from softmark.interpreter.study.leaderboard import leaderboard_changes

    try:
        old = None if parsed.against is None else leaderboard_changes.read_board(parsed.against)
    except leaderboard_changes.NotALeaderboard as foreign:
        print(make_visible(f"error: {foreign}"), file=sys.stderr)
        return 2
    if unknown := _check_programs(parsed.also):
        print(make_visible(unknown), file=sys.stderr)
        return 2
    if parsed.also and "-" in parsed.files:
        print("error: --also cannot be used with standard input, which is read only once: give a scene file",
              file=sys.stderr)  # fmt: skip
        return 2
    read = _read_title_and_cases(parsed.files or [STANDARD], parsed.also)
    if read is None:
        return 2
    title, cases = read
    if parsed.check:
        print(_case_list(title, cases))
        return 0
    progress = Progress(sys.stderr)
    progress.say("start", f"{len(cases)} case{'s' if len(cases) != 1 else ''}")
    try:
        return _make_board(title, cases, old, parsed, progress)
    finally:
        progress.clear()


def _check_programs(programs: list[str]) -> str:
    """Return an error message if `--also` names an unknown program, else an empty text."""
    from softmark.grammar.name_suggestions import nearest
    from softmark.interpreter.models.external.adapters import PROGRAMS

    for name in programs:
        if name not in PROGRAMS:
            close = nearest(name, PROGRAMS)
            hint = f"did you mean `{close}`?" if close else f"programs are {', '.join(PROGRAMS)}"
            return f"error: there is no adapter for `{name}`; {hint}"
    return ""


def _read_title_and_cases(names: list[str], also: list[str]) -> tuple[str, list[BoardCase]] | None:
    """Return the title and the cases of a suite, or of scenes given by name.

    If the suite has errors or a scene is missing, print the errors and return None.
    """
    from softmark.interpreter.cli.commands.other_programs_option import load_with_programs
    from softmark.interpreter.cli.commands.scene_arguments import SceneReadError, read_scene, show
    from softmark.interpreter.study.leaderboard.suite_cases import case_of_scene, cases_of_suite
    from softmark.interpreter.study.leaderboard.suite_file import is_suite, read_suite, standard_suites

    def load(name: str) -> tuple[Scene | None, list[Diagnostic]]:
        return load_with_programs(name, also)

    known = standard_suites()
    if len(names) == 1:
        try:
            source, folder, _ = read_scene(str(known.get(names[0], names[0])))
        except SceneReadError as unread:
            show([unread.diagnostic])
            return None
        if is_suite(source.text):
            suite, found = read_suite(source, folder)
            cases, faults = ([], found) if suite is None else cases_of_suite(suite, load)
            show(faults)
            return None if suite is None or faults else (suite.title, cases)
    scenes: list[BoardCase] = []
    for name in names:
        scene, diagnostics = load(name)
        if scene is None:
            show(diagnostics)
            return None
        scenes.append(case_of_scene(scene, [c.case.name for c in scenes]))
    return f"{len(scenes)} scenes" if len(scenes) > 1 else scenes[0].title, scenes


def _case_list(title: str, cases: list[BoardCase]) -> str:
    """Return the list of cases as text, each with its number of models and its question."""
    lines = [f"{c.case.name:<12}{c.kind or '-':<13}{len(c.entrants):>2}  {c.case.asks}" for c in cases]
    return str(make_all_visible("\n".join([title, *lines])))


def _make_board(
    title: str, cases: list[BoardCase], old: Board | None, parsed: argparse.Namespace, progress: Progress
) -> int:  # fmt: skip
    from softmark.interpreter.study.comparison_study import compare
    from softmark.interpreter.study.leaderboard.suite_cases import subjects_of

    subjects, folder = subjects_of(cases), Path(parsed.out or "board")
    request = comparison_request(parsed, folder, progress, not parsed.fresh, plain=True)
    scenes = [s.scene for s in subjects]
    found = run_study(lambda: compare(subjects, request), folder, parsed, progress, "board", scenes, "index.html")
    return found if isinstance(found, int) else _write_site(title, cases, found, old, folder, parsed)


def _write_site(
    title: str, cases: list[BoardCase], found: Comparison, old: Board | None, folder: Path, parsed: argparse.Namespace
) -> int:
    """Write the site, print a summary and return the exit status."""
    from softmark.interpreter.report.leaderboard.leaderboard_comment import comment
    from softmark.interpreter.report.leaderboard.leaderboard_page import page
    from softmark.interpreter.study.leaderboard.leaderboard_cells import board_of

    board = board_of(title, cases, found.found.points, found.to_json())
    text = json.dumps(board.to_json(), indent=1, allow_nan=False, ensure_ascii=False) + "\n"
    files = {"board.json": lambda: text, "index.html": lambda: page(board, found.found)}
    changes = None if old is None else comment(old, board)
    if changes is not None:
        files["against.md"] = lambda: changes
    sound = write_results(files, text, folder, parsed)
    if parsed.json != "-":
        print(make_all_visible(changes if changes is not None else _case_summaries(board, folder)))
    whole = sound and found.exit_status == 0 and not any(case.reason for case in cases)
    return 0 if whole else 3


def _case_summaries(board: Board, folder: Path) -> str:
    """Return one line of text for each case: its number of right results, and its best model."""
    lines = [board.title]
    for name, card in board.cases.items():
        cells = board.of(name)
        right = sum(c.verdict == "met" for c in cells)
        best = f"{cells[0].model}: {cells[0].error:.2g}" if cells and cells[0].error is not None else card.reason or "-"
        lines.append(f"  {name:<12}{right:>3} right of {len(cells):<4}{best}")
    return "\n".join([*lines, f"{folder / 'index.html'}"])
