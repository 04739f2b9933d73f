"""Writer of a run's report: checks the output folder before the run, and saves results while models are solved.

The HTML page is written only once, at the end or when the run is interrupted. Until then only the numbers are saved.
They are saved only so often that saving takes a small part of the time, so that many small models are not slowed down.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import make_visible
from softmark.interpreter.cli.commands.output_collisions import find_collision, input_files, output_files

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Scene
    from softmark.interpreter.results.run_report import Report


SPARE = 10.0  # minimum time between two saves, as a multiple of the time that the last save took


class UnusableReportPlace(Exception):
    """Error: the report cannot be written to the requested place. The text gives the reason."""


class ReportWriter:
    """Writer of the report into the folder of `--out` and the files of `--json` and `--junit`.

    Results of finished models stay on disk even if a later model fails.
    """

    def __init__(self, parsed: argparse.Namespace) -> None:
        self.folder = None if parsed.out is None else Path(parsed.out)
        self.named = parsed.out is not None or (parsed.json is not None and not parsed.vtu)
        self.files = {o: f for o, f in (("--json", parsed.json), ("--junit", parsed.junit)) if f not in (None, "-")}
        self.begun = False
        self.printed = parsed.json == "-"
        self.vtu = parsed.vtu
        self.failed = False
        self.count = 0
        self.pending: Report | None = None  # report that is not on disk yet, or only without its page
        self._again = 0.0

    def begin(self, scene: Scene) -> None:
        """Choose and check the places of the report of a scene. Raises Unusable.

        From now on an interrupt saves the finished results.
        """
        from softmark.interpreter.cli import exit_signals

        if not self.named:
            self.folder = Path(f"{Path(scene.path).stem if scene.path else 'scene'}-report")
        exit_signals.set_interrupt_message(self.rescue)
        if problem := symlink_error(None if self.named else self.folder) or self._reason_unusable(scene):
            raise UnusableReportPlace(problem)
        self.begun = True

    def _reason_unusable(self, scene: Scene) -> str:
        """Return the reason why the report cannot be written to the requested places, or an empty text."""
        written = output_files("--out", self.folder, ("report.json", "report.html"))
        read, outputs = input_files(scene), [*written, *((o, Path(f)) for o, f in self.files.items())]
        if self.vtu and self.folder is not None:
            below = (self.folder / "vtu").resolve()
            outputs += [("--out, with --vtu", p) for _, p in read if p.resolve().is_relative_to(below)]
        places = [("--out", str(self.folder))] if self.folder is not None else []
        return find_collision(outputs, read) or unwritable_error(
            (*places, *self.files.items()), [p for _, p in written]
        )

    @property
    def saved_results_phrase(self) -> str:
        """Phrase that says which results an interrupted run has saved, and where."""
        places = (
            [str(self.folder / "report.json")] if self.folder else [f for o, f in self.files.items() if o == "--json"]
        )
        if self.count == 0 or self.failed or not places:
            return "nothing was finished"
        return f"{self.count} finished model{'s' if self.count != 1 else ''} in {places[0]}"

    def save_unfinished(self, report: Report) -> None:
        """Save the report of an unfinished run, unless one was saved a short time ago."""
        self.pending = report
        begin = time.perf_counter()
        if begin < self._again:
            return
        self._write(report, page=False)
        end = time.perf_counter()
        self._again = end + SPARE * (end - begin)

    def rescue(self) -> str:
        """Write the results of an interrupted run, with the HTML page, and return a phrase about the saved results."""
        report, self.pending = self.pending, None
        if report is not None:
            try:
                self._write(report)
            except Exception:  # the state is unknown after an interruption; the report saved before still exists
                return self.saved_results_phrase
        return self.saved_results_phrase

    def finish(self, report: Report) -> str:
        """Write the finished report and return the path of its HTML page, or an empty text."""
        self.pending = None
        self._write(report)
        if self.vtu and self.folder is not None:
            folder = self.folder
            self._try_writing("--out", str(folder), lambda: self._paraview(report, folder))
        if self.printed:
            sys.stdout.write(report.dumps())
        return str(self.folder / "report.html") if self.folder and not self.failed else ""

    def _write(self, report: Report, page: bool = True) -> None:
        from softmark.interpreter.report.files import junit_report
        from softmark.interpreter.report.files.report_files import write
        from softmark.interpreter.results.atomic_files import write_named

        if self.folder is not None:
            folder = self.folder
            self._try_writing("--out", str(folder), lambda: write(report, folder, page))
        for option, place in self.files.items():
            text = report.dumps() if option == "--json" else junit_report.render(report)
            self._try_writing(option, place, partial(write_named, Path(place), text))
        self.count = len(report.models)

    @staticmethod
    def _paraview(report: Report, folder: Path) -> None:
        from softmark.interpreter.report.files.report_files import write_vtu

        write_vtu(report, folder)  # a ValueError is a defect of softmark, not a problem of the output folder

    def _try_writing(self, option: str, place: str, action: Callable[[], object]) -> None:
        try:
            action()
        except OSError as error:
            if not self.failed:
                print(write_error_message(place, error, option), file=sys.stderr)
            self.failed = True


def symlink_error(folder: Path | None) -> str:
    """Return an error message if the output folder is a symbolic link, else an empty text."""
    if folder is None or not folder.is_symlink():
        return ""
    return write_error_message(str(folder), OSError(None, "it is a symbolic link"), "--out")


def unwritable_error(places: Iterable[tuple[str, str]], written: Iterable[Path] = ()) -> str:
    """Return an error message if one of several output paths cannot be written, else an empty text.

    `places` are pairs of an option and its path; `written` are the files inside the folder of `--out`.
    """
    for option, place in places:
        if "\0" in place:
            return write_error_message(place, OSError(None, "the name contains a NUL character"), option)
        try:
            _check_writable_folder(Path(place) if option == "--out" else _writable_parent(place))
        except OSError as error:
            return write_error_message(place, error, option)
    for path in written:
        if path.is_dir():
            return write_error_message(str(path), OSError(None, "it is a folder"), "--out")
    return ""


def _writable_parent(place: str) -> Path:
    """Return the folder in which a file can be written. Raises OSError."""
    if not place:
        raise OSError(None, "the name is empty")
    if Path(place).is_dir():
        raise OSError(None, "it is a folder")
    if not Path(place).parent.is_dir():
        raise OSError(None, "its folder does not exist")
    if Path(place).exists() and not Path(place).is_file():  # a device or a pipe
        return Path(tempfile.gettempdir())
    return Path(place).parent


def _check_writable_folder(folder: Path) -> None:
    """Test whether a folder, or its nearest existing parent, can be written. Raises OSError."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    tempfile.TemporaryFile(dir=folder).close()


def write_error_message(place: str, error: OSError, option: str) -> str:
    """Return the error message for a path that cannot be written; `option` is the option that sets the path."""
    reason = error.strerror or str(error)
    return make_visible(
        f"error[E404]: cannot write {place or 'the report'}: {reason}; choose another path with {option}"
    )
