"""Command `dsl fmt`: formats scene files."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.grammar.parser import parse
from softmark.interpreter.cli.commands.scene_arguments import Unread, has_errors, read_scene, show


def arguments(parser: argparse.ArgumentParser) -> None:
    """FILE... [--check]"""
    parser.add_argument(
        "files", nargs="+", metavar="FILE", help="scene files; - formats standard input to standard output"
    )
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 if a file is not in canonical form")


def run(parsed: argparse.Namespace) -> int:
    """Return 0 if done, 1 with --check if a file would change, 2 if a file cannot be formatted."""
    return max(_one(name, parsed.check) for name in parsed.files)


def _one(name: str, check: bool) -> int:
    from softmark.grammar.printer import CannotFormat, format_source

    try:
        source, _, path = read_scene(name)
    except Unread as unread:
        show([unread.diagnostic])
        return 2
    if path is not None and not check and os.path.islink(name):
        remedy = f"format the file that it leads to: `dsl fmt {os.path.realpath(name)}`"
        problem = f"`{name}` is a symbolic link, which is not written through"
        show([Diagnostic("E404", problem, None, None, help=remedy)])
        return 2
    if path is not None and not check and not os.path.isfile(name):
        problem = f"`{name}` is a scene of the standard library, which is not rewritten"
        remedy = f"give the path of a file of your own; `dsl fmt --check {name}` says whether it would change"
        show([Diagnostic("E404", problem, None, None, help=remedy)])
        return 2
    problems = parse(source)[1]
    if has_errors(problems):
        show(problems)
        return 2
    try:
        text = format_source(source)
    except CannotFormat as reason:
        print(f"error[E405]: {source.name} is left as it is: {reason}", file=sys.stderr)
        return 2
    return _deliver(source, text, path, check)


def _deliver(source: Source, text: str, path: Path | None, check: bool) -> int:
    if check:
        if text != source.text:
            print(f"{source.name} is not in canonical form", file=sys.stderr)
        return int(text != source.text)
    if path is None:
        sys.stdout.write(text)
    elif text != source.text:
        return _replace(path, text)
    return 0


def _replace(path: Path, text: str) -> int:
    """Write a temporary file and rename it, so that an interruption never leaves a partial file."""
    from softmark.interpreter.results.atomic_files import replacing

    try:
        mode = path.stat().st_mode & 0o777
        with replacing(path) as part:
            part.write_text(text, encoding="utf-8", newline="\n")
        os.chmod(path, mode)
    except OSError as error:
        print(f"error[E404]: cannot write {path}: {error.strerror}", file=sys.stderr)
        return 2
    print(f"formatted {path}")
    return 0
