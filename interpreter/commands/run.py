"""`dsl run`."""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.commands.progress import Progress
    from softmark.interpreter.results import Report
    from softmark.interpreter.scene import Scene


def arguments(parser: argparse.ArgumentParser) -> None:
    """FILE [-p NAME=VALUE]... [--model NAME]... [--out DIR] [--json FILE|-] [--repeat N]"""
    parser.add_argument(
        "file", metavar="FILE", help="a scene file, a standard scene, or - for standard input"
    )
    parser.add_argument(
        "-p",
        action="append",
        default=[],
        dest="overrides",
        metavar="NAME=VALUE",
        help="replace a parameter or a field",
    )
    parser.add_argument("--model", action="append", default=[], metavar="NAME", help="only this model")
    parser.add_argument(
        "--out", metavar="DIR", help="folder for report.html and report.json (default: NAME-report)"
    )
    parser.add_argument("--json", metavar="FILE", help="write the JSON report to FILE; - is standard output")
    parser.add_argument("--repeat", type=_count, default=1, metavar="N", help="time each solution N times")


def _count(text: str) -> int:
    if not text.isdigit() or not 1 <= int(text) <= 1000:
        raise argparse.ArgumentTypeError(f"`{text}` is not a number from 1 to 1000")
    return int(text)


def run(parsed: argparse.Namespace) -> int:
    """Run the scene; the exit status is that of its report."""
    from softmark.interpreter.commands.progress import Progress

    progress = Progress(sys.stderr)
    progress.say("start", f"running {parsed.file}")  # before anything is imported or read
    from softmark.interpreter.commands.scenes import load, show
    from softmark.interpreter.names import concerning, unknown_models

    only = tuple(parsed.model)
    scene, found = load(parsed.file, parsed.overrides)
    found = concerning(scene, only, found)
    progress.clear()
    show(found)
    if scene is None:
        return 2
    if problems := unknown_models(scene, only):
        show(problems)
        return 2
    try:
        return _run(scene, found, parsed, progress)
    finally:
        progress.clear()


def _run(scene: Scene, found: list[Diagnostic], parsed: argparse.Namespace, progress: Progress) -> int:
    from softmark.interpreter import run as runner
    from softmark.interpreter.commands.scenes import show
    from softmark.interpreter.report import terminal
    from softmark.interpreter.scene import SceneError

    def warn(later: Sequence[Diagnostic]) -> None:
        progress.clear()
        show(later)

    shelf = Shelf(parsed, scene)
    if problem := shelf.unusable():
        progress.clear()
        print(problem, file=sys.stderr)
        return 2
    options = runner.Options(tuple(parsed.model), parsed.repeat, progress.say, shelf.keep, warn)
    try:
        report = runner.run(scene, found, options)
    except SceneError as error:
        progress.clear()
        show(error.diagnostics)
        return 2
    except KeyboardInterrupt:
        progress.clear()
        print(f"interrupted; {shelf.kept}", file=sys.stderr)
        return 130
    progress.clear()
    written = shelf.finish(report)
    if parsed.json != "-":
        print(terminal.table(report, sys.stdout.isatty()))
        if written:
            print(f"\nreport: {written}")
    return 3 if shelf.failed else report.exit_status


class Shelf:
    """Where a run's report goes: kept after each model, so that nothing is lost when a later one fails."""

    def __init__(self, parsed: argparse.Namespace, scene: Scene) -> None:
        self.json: str | None = parsed.json
        name = Path(scene.path).stem if scene.path else "scene"
        self.folder = (
            Path(parsed.out)
            if parsed.out is not None
            else None
            if parsed.json is not None
            else Path(f"{name}-report")
        )
        self.failed = False
        self.count = 0

    def unusable(self) -> str:
        """Why the report could not be written where it is asked for, found before anything is computed."""
        try:
            if self.folder is not None:
                self.folder.mkdir(parents=True, exist_ok=True)
                tempfile.TemporaryFile(dir=self.folder).close()
            if self.json not in (None, "-"):
                place = Path(str(self.json))
                if not self.json or place.is_dir():
                    raise OSError(None, "it is a folder" if self.json else "the name is empty")
                tempfile.TemporaryFile(dir=place.parent).close()
        except OSError as error:
            where, option = (self.json, "--json") if self.folder is None else (self.folder, "--out")
            why = error.strerror or str(error)
            return f"error[E404]: cannot write {where or 'the report'}: {why}; choose another place with {option}"
        return ""

    @property
    def kept(self) -> str:
        """What an interrupted run leaves."""
        if self.count == 0 or self.folder is None or self.failed:
            return "nothing was finished"
        return f"{self.count} finished model{'s' if self.count != 1 else ''} in {self.folder / 'report.json'}"

    def keep(self, report: Report) -> None:
        """Write an unfinished report."""
        self.count = len(report.models)
        self._write(report)

    def finish(self, report: Report) -> str:
        """Write the finished report; the value is where a person finds it."""
        self._write(report)
        if self.json == "-":
            sys.stdout.write(report.dumps())
        elif self.json is not None:
            self._attempt(
                Path(self.json), lambda: Path(str(self.json)).write_text(report.dumps(), encoding="utf-8")
            )
        return str(self.folder / "report.html") if self.folder and not self.failed else ""

    def _write(self, report: Report) -> None:
        if self.folder is not None and not self.failed:
            from softmark.interpreter.report.files import write

            folder = self.folder
            self._attempt(folder, lambda: write(report, folder))

    def _attempt(self, place: Path, action: Callable[[], object]) -> None:
        try:
            action()
        except OSError as error:
            self.failed = True
            reason = error.strerror or str(error)
            print(
                f"error[E404]: cannot write {place}: {reason}; choose another folder with --out",
                file=sys.stderr,
            )
