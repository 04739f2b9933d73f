"""Command `dsl fmt`: formats scene files."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.grammar.parser import parse
from softmark.interpreter.cli.commands.scene_arguments import SceneReadError, has_errors, read_scene, show


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `dsl fmt`: `FILE... [--check | --upgrade]`."""
    parser.add_argument(
        "files", nargs="+", metavar="FILE", help="scene files; - formats standard input to standard output"
    )
    mode = parser.add_mutually_exclusive_group()
    mode.add_argument("--check", action="store_true", help="write nothing; exit 1 if a file is not in canonical form")
    mode.add_argument(
        "--upgrade", action="store_true", help="replace earlier words of the language by the present ones; nothing else"
    )


def run(parsed: argparse.Namespace) -> int:
    """Format scenes and return the exit status.

    0: all files are formatted; 1: `--check` found a file to change; 2: a file cannot be formatted.
    """
    return max(_format_file(name, parsed.check, parsed.upgrade) for name in parsed.files)


def _format_file(name: str, check: bool, upgrade: bool) -> int:
    from softmark.grammar.printer import CannotFormat, format_source

    try:
        source, _, path = read_scene(name)
    except SceneReadError as unread:
        show([unread.diagnostic])
        return 2
    if path is not None and not check and os.path.islink(name):
        remedy = f"format the target of the link: `dsl fmt {os.path.realpath(name)}`"
        problem = f"`{name}` is a symbolic link, which is not overwritten"
        show([Diagnostic("E404", problem, None, None, help=remedy)])
        return 2
    if path is not None and not check and not os.path.isfile(name):
        problem = f"`{name}` is a scene of the standard library, which cannot be changed"
        remedy = f"give the path of a file of your own; `dsl fmt --check {name}` reports whether it would change"
        show([Diagnostic("E404", problem, None, None, help=remedy)])
        return 2
    if upgrade:
        return _upgrade(source, path)
    problems = parse(source)[1]
    if has_errors(problems):
        show(problems)
        return 2
    try:
        text = format_source(source)
    except CannotFormat as reason:
        print(f"error[E405]: {source.name} is not formatted: {reason}", file=sys.stderr)
        return 2
    return _write_or_check(source, text, path, check)


def _upgrade(source: Source, path: Path | None) -> int:
    """Replace renamed words in a scene by their present names.

    Declarations that cannot be parsed stay unchanged.
    """
    from softmark.interpreter.language.renamed_words import upgrade

    text = source.text if "\0" in source.text else upgrade(source.text, parse(source)[0])
    if path is None:
        sys.stdout.write(text)
    elif text != source.text:
        return _replace(path, text, "upgraded")
    return 0


def _write_or_check(source: Source, text: str, path: Path | None, check: bool) -> int:
    if check:
        if text != source.text:
            print(f"{source.name} is not in canonical form", file=sys.stderr)
        return int(text != source.text)
    if path is None:
        sys.stdout.write(text)
    elif text != source.text:
        return _replace(path, text)
    return 0


def _replace(path: Path, text: str, done: str = "formatted") -> int:
    """Replace a file by a new text, and return the exit status.

    The text is written to a temporary file that is then renamed, so that an interruption never leaves a partial file.
    """
    from softmark.interpreter.results.atomic_files import replace_atomically

    try:
        mode = path.stat().st_mode & 0o777
        with replace_atomically(path) as part:
            part.write_text(text, encoding="utf-8", newline="\n")
        os.chmod(path, mode)
    except OSError as error:
        print(f"error[E404]: cannot write {path}: {error.strerror}", file=sys.stderr)
        return 2
    print(f"{done} {path}")
    return 0
