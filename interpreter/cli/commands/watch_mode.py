"""Option `dsl run --watch`: runs the scene again whenever the scene or a file that it names is saved.

Each run is a separate process, so it uses the current files and plugins and keeps no state of earlier runs. If a file
is saved during a run, the next run starts when the current run has ended. All scene files and all files that they name
in quotes are watched, even if the scenes have errors.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

from softmark.grammar.diagnostic import make_visible
from softmark.interpreter.cli import exit_signals
from softmark.safe_files import open_regular, read_regular

POLL = 0.3  # s between two checks for changed files
CALM = 0.15  # s without changes after which a save is complete: editors save by several writes, or by renaming
GONE = 1.0  # s that a file may be missing while an editor replaces it
ENDING = 5.0  # s that a run may take to end after an interrupt, before it is killed
RECENT = 2_000_000_000  # ns: time stamps of files are coarse, so two saves may have the same stamp
MOST = 2000  # maximum number of watched files in a folder

Stamp = tuple[int, int, int]  # modification time, ns, size, bytes, and inode number of a file
State = Mapping[Path, str]


def watch(parsed: argparse.Namespace) -> int:
    """Run the scene after each change until a signal ends the program.

    Returns only if the command line is wrong, with the exit status.
    """
    from softmark.interpreter.language.scene_sources import UnreadableScene, locate_scene

    if parsed.file == "-":
        print("error: `--watch` needs the name of a file: standard input can be read only once", file=sys.stderr)
        return 2
    try:
        file = locate_scene(parsed.file)
    except UnreadableScene as missing:
        print(make_visible(f"error[E401]: {missing.reason}; {missing.remedy}"), file=sys.stderr)
        return 2
    watched = WatchedScene(file, tuple(Path(p) for p in parsed.plugins))
    child: list[subprocess.Popen[bytes]] = []
    exit_signals.set_interrupt_message(lambda: _stop_run(child))
    try:
        _watch_loop(watched, [sys.executable, "-m", "softmark.interpreter", "run", *run_arguments(parsed)], child)
    finally:
        _stop_run(child)


def _watch_loop(watched: WatchedScene, command: list[str], child: list[subprocess.Popen[bytes]]) -> NoReturn:
    before = watched.state()
    while True:
        child[:] = [subprocess.Popen(command, stdin=subprocess.DEVNULL)]
        child[0].wait()
        child.clear()
        count = sum(map(bool, before.values()))
        print(f"\nwatching {count} file{'s' if count != 1 else ''}; Ctrl-C ends", file=sys.stderr, flush=True)
        before, saved = watched.wait_for_change(before)
        print(make_visible(f"\n{time.strftime('%H:%M:%S')}  saved: {saved}"), file=sys.stderr, flush=True)


def run_arguments(parsed: argparse.Namespace) -> list[str]:
    """Return the arguments of the `dsl run` command to repeat, without `--watch`."""
    found = [parsed.file]
    for option, several in (("-p", parsed.overrides), ("--plugin", parsed.plugins), ("--model", parsed.model)):
        found += [word for value in several for word in (option, value)]
    for option, value in (("--out", parsed.out), ("--json", parsed.json), ("--junit", parsed.junit)):
        found += [] if value is None else [option, value]
    flags = (("--vtu", parsed.vtu), ("--stated", parsed.stated), ("--fresh", parsed.fresh))
    found += [option for option, given in flags if given]
    return [*found, "--repeat", str(parsed.repeat)]


def _stop_run(child: list[subprocess.Popen[bytes]]) -> str:
    """Stop the current run by SIGINT, or by SIGKILL after ENDING seconds.

    Returns an empty text, because the run prints its own message about the interruption.
    """
    for process in child:
        deadline = time.monotonic() + ENDING
        with suppress(OSError):  # if it has ended; `os` functions, because a method of `process` may be waiting
            os.kill(process.pid, signal.SIGINT)
            while os.waitpid(process.pid, os.WNOHANG)[0] == 0:
                if time.monotonic() > deadline:
                    os.kill(process.pid, signal.SIGKILL)
                time.sleep(0.02)
    return ""


@dataclass
class WatchedScene:
    """Scene file with its plugins and all files that the scene names."""

    scene: Path
    plugins: tuple[Path, ...] = ()
    _digests: dict[Path, tuple[Stamp, str]] = field(default_factory=dict)

    def state(self) -> State:
        """Return a digest of every watched file; the digest of a missing file is an empty text."""
        found = dict.fromkeys((self.scene, *self.plugins), "")
        pending = [self.scene]
        while pending:
            text = pending.pop()
            for path in _quoted_files(text):
                if path.suffix == self.scene.suffix and path not in found:
                    pending.append(path)
                found[path] = ""
        return {path: self._digest(path) for path in found}

    def wait_for_change(self, before: State) -> tuple[State, str]:
        """Wait until a watched file has changed and no file changes any more.

        Return the new state and the names of the changed files.
        """
        while (now := self.state()) == before:
            time.sleep(POLL)
        begin = time.monotonic()
        while True:
            time.sleep(CALM)
            later = self.state()
            away = not later[self.scene] and time.monotonic() < begin + GONE
            if later == now and not away:
                break
            now = later
        if now == before:  # the change was undone
            return self.wait_for_change(before)
        other = [p for p in {**before, **now} if before.get(p) != now.get(p)]
        return now, ", ".join(str(p) for p in other[:3]) + (f" and {len(other) - 3} more" if len(other) > 3 else "")

    def _digest(self, path: Path) -> str:
        """Return the SHA-256 of a file, or a listing of a folder.

        A file is read again only if its time stamp has changed. The result is an empty text if it cannot be read.
        """
        try:
            if path.is_dir():
                return (
                    repr([(p.name, _stamp(p)) for p in sorted(path.iterdir())[:MOST]])
                    if self._is_data_folder(path)
                    else ""
                )
            stamp, known = _stamp(path), self._digests.get(path)
            fresh = time.time_ns() - stamp[0] < RECENT
            if known is None or known[0] != stamp or fresh:
                with open_regular(path) as file:
                    known = stamp, hashlib.file_digest(file, "sha256").hexdigest()
                self._digests[path] = known
            return known[1]
        except OSError:
            return ""

    def _is_data_folder(self, folder: Path) -> bool:
        """Return whether a folder contains data; output and working folders, which change with runs, do not."""
        here = (self.scene.resolve(), Path.cwd())
        return not any(p.is_relative_to(folder.resolve()) for p in here) and not (folder / "report.json").exists()


def _stamp(path: Path) -> Stamp:
    found = path.stat()
    return found.st_mtime_ns, found.st_size, found.st_ino


def _quoted_files(text: Path) -> Iterator[Path]:
    """Yield the files that a scene file names in quotes, even if they do not exist."""
    from softmark.interpreter.language.scene_sources import LARGEST, find_quoted_paths

    with suppress(OSError):
        yield from find_quoted_paths(read_regular(text, LARGEST).decode("utf-8", errors="replace"), text.parent)
