"""`dsl stress`."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from softmark.interpreter.commands.compare import _count, _refused, _seconds, _warn, _written
from softmark.interpreter.commands.options import scene_options

if TYPE_CHECKING:
    from softmark.interpreter.commands.progress import Progress
    from softmark.interpreter.study.stress.engine import Request, Stress


def arguments(parser: argparse.ArgumentParser) -> None:
    """FILE [-p NAME=VALUE]... [--model NAME]... [--study NAME] [--out DIR] [--json FILE] ..."""
    parser.description = (
        "walk every model of a scene to its edges: right, inaccurate and saying so, silent, or without an answer. "
        "Exit status 1 where a point is silent: converged, wrong, and nothing says so."
    )
    scene_options(parser)
    parser.add_argument("--study", metavar="NAME", help="only this stability study of the scene")
    parser.add_argument("--out", metavar="DIR", help="folder for stress.html, stress.json and journal.jsonl"
                        " (default: NAME-stress)")  # fmt: skip
    parser.add_argument("--json", metavar="FILE", help="write the JSON result to FILE; - is standard output")
    parser.add_argument("--jobs", type=_count, default=1, metavar="N", help="compute points in N processes at a time")
    parser.add_argument("--timeout", type=_seconds, default=60.0, metavar="S",
                        help="give up a point after S seconds of CPU time (default: 60)")  # fmt: skip
    parser.add_argument("--memory", type=_seconds, default=4.0, metavar="GIB",
                        help="address space of each process in GiB (default: 4)")  # fmt: skip
    again = parser.add_mutually_exclusive_group()
    again.add_argument("--resume", action="store_true", help="go on with what an earlier run finished there")
    again.add_argument("--fresh", action="store_true", help="forget what an earlier run finished there")


def run(parsed: argparse.Namespace) -> int:
    """Stress the models of a scene; 1 where a point is silent."""
    from softmark.interpreter.commands.progress import Progress

    progress = Progress(sys.stderr)
    progress.say("start", f"stressing {parsed.file}")
    try:
        return _stress(parsed, progress)
    finally:
        progress.clear()


def _stress(parsed: argparse.Namespace, progress: Progress) -> int:
    from softmark.interpreter.commands.scenes import load, show
    from softmark.interpreter.commands.shelf import message, unusable
    from softmark.interpreter.names import concerning
    from softmark.interpreter.scene import SceneError

    scene, diagnostics = load(parsed.file, parsed.overrides)
    progress.clear()
    if scene is None:
        show(diagnostics)
        return 2
    _warn(concerning(scene, tuple(parsed.model), diagnostics))
    from softmark.interpreter.study.variations import subject_of

    subject = subject_of(scene)
    folder = Path(parsed.out if parsed.out is not None else f"{subject.name}-stress")
    places = [("--out", str(folder))] + ([("--json", parsed.json)] if parsed.json not in (None, "-") else [])
    if problem := unusable(places):
        return _refused(progress, problem)
    from softmark.interpreter.study import journal, pool
    from softmark.interpreter.study.stress import engine

    try:
        found = engine.stress(subject, _request(parsed, folder, progress))
    except SceneError as error:
        progress.clear()
        show(error.diagnostics)
        return 2
    except (journal.Refused, pool.Unavailable) as refused:
        return _refused(progress, f"error: {refused}")
    except OSError as error:
        return _refused(progress, message(str(folder), error, "--out"), 3)
    except engine.Interrupted as stop:
        return _refused(progress, f"interrupted; {stop}", 130)
    progress.clear()
    return _shelve(found, folder, parsed)


def _request(parsed: argparse.Namespace, folder: Path, progress: Progress) -> Request:
    from softmark.interpreter.study.stress.engine import Request

    return Request(
        folder=folder, models=tuple(parsed.model), study=parsed.study, jobs=parsed.jobs, timeout=parsed.timeout,
        memory=parsed.memory, resume=parsed.resume, fresh=parsed.fresh, command=shlex.join(["dsl", *sys.argv[1:]]),
        say=progress.say,
    )  # fmt: skip


def _shelve(found: Stress, folder: Path, parsed: argparse.Namespace) -> int:
    """Write the result and show it; the exit status."""
    from softmark.interpreter.commands.scenes import coloured
    from softmark.interpreter.commands.shelf import message
    from softmark.interpreter.report.files import replace
    from softmark.interpreter.report.stress_terminal import table

    text, sound = found.dumps(), True
    try:
        replace(folder / "stress.json", text)
        page = _page(found)
        if page is not None:
            replace(folder / "stress.html", page)
    except OSError as error:
        print(message(str(folder), error, "--out"), file=sys.stderr)
        sound = False
    if parsed.json is not None:
        sound &= _written(parsed.json, text)
    if parsed.json != "-":
        shown = folder / ("stress.html" if (folder / "stress.html").exists() else "stress.json")
        colour = sys.stdout.isatty() and coloured()
        print(table(found.to_json(), parsed.file, parsed.overrides, colour, str(shown) if sound else None))
    return found.exit_status if sound else 3


def _page(found: Stress) -> str | None:
    """The page; None where this installation has none."""
    try:
        from softmark.interpreter.report.stress_page import page
    except ImportError:
        return None
    return page(found.to_json())
