"""Command `dsl editor`: writes editor support files for scenes, generated from the current vocabulary."""

from __future__ import annotations

import argparse
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

from softmark.grammar.diagnostic import make_visible
from softmark.interpreter.cli.commands.common_options import parse_folder
from softmark.interpreter.language_server.syntax_highlighting import EDITORS


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `dsl editor`: `[EDITOR] [--out DIR]`."""
    parser.add_argument(
        "editor", nargs="?", choices=tuple(EDITORS), help="name of the editor; without it, a list of editors"
    )
    parser.add_argument("--out", metavar="DIR", type=parse_folder, help="folder to write to (default: softmark-EDITOR)")


def run(parsed: argparse.Namespace) -> int:
    """Write the files of an editor and print how to install them, or list the editors."""
    if parsed.editor is None:
        width = max(map(len, EDITORS))
        print("\n".join(f"dsl editor {name:{width}}  {_editor_module(name).TITLE}" for name in EDITORS))
        return 0
    from softmark.interpreter.results.atomic_files import make_inner_folder, refuse_link, replace

    into = Path(parsed.out or f"softmark-{parsed.editor}")
    editor = _editor_module(parsed.editor)
    try:
        if not parsed.out:
            refuse_link(into)
        for name, content in editor.files().items():
            replace(make_inner_folder(into, *Path(name).parent.parts) / Path(name).name, content)
            print(make_visible(str(into / name)))
    except OSError as failure:
        print(make_visible(f"error: {into} cannot be written: {failure.strerror}"), file=sys.stderr)
        return 2
    print("", *map(make_visible, editor.install(into).splitlines()), sep="\n")
    return 0


def _editor_module(name: str) -> Any:
    return import_module(f"softmark.interpreter.language_server.syntax_highlighting.{EDITORS[name]}")
