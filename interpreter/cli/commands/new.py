"""Command `dsl new`: prints or writes template scenes with explanatory comments."""

from __future__ import annotations

import argparse
import os
import sys
from dataclasses import dataclass
from itertools import dropwhile, takewhile
from pathlib import Path

from softmark.grammar.diagnostic import make_visible
from softmark.grammar.name_suggestions import nearest
from softmark.scenes import ROOT

FOLDER = ROOT / "templates"


@dataclass(frozen=True)
class Template:
    """Template scene with explanatory comments, and the data files that it reads.

    The data files are in the same folder and have the same base name.
    """

    scene: Path

    @property
    def data_files(self) -> list[Path]:
        """Data files that the template reads."""
        return sorted(f for f in FOLDER.glob(f"{self.scene.stem}.*") if f != self.scene)

    @property
    def title(self) -> str:
        """Title that the template scene declares."""
        return next(line.partition('"')[2].rstrip('"') for line in self._lines() if line.startswith("scene "))

    @property
    def about(self) -> list[str]:
        """Lines of the comment below the title: the content of the scene, and the values to replace."""
        below = dropwhile(lambda line: not line.startswith("#"), self._lines())
        return [line.removeprefix("# ") for line in takewhile(lambda line: line.startswith("#"), below)]

    def _lines(self) -> list[str]:
        return self.scene.read_text(encoding="utf-8").splitlines()


def templates() -> dict[str, Template]:
    """Return the shipped templates by name."""
    return {file.stem: Template(file) for file in sorted(FOLDER.glob("*.scene"))}


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `dsl new`: `[TEMPLATE] [--list] [--out DIR]`."""
    parser.add_argument(
        "template",
        nargs="?",
        help="a template (default: beam); `dsl new --list` shows the content and the files of each",
    )
    parser.add_argument("--list", action="store_true", help="list the templates and the files that they write")
    parser.add_argument(
        "--out",
        metavar="DIR",
        type=Path,
        help="write the scene and the files that it reads to this folder, not to the terminal",
    )


def run(parsed: argparse.Namespace) -> int:
    """Print a template scene, or write it to a folder together with its data files; return the exit status."""
    known = templates()
    if parsed.template is not None and parsed.template not in known:
        close = nearest(parsed.template, known)
        hint = f"did you mean `{close}`?" if close else "templates: " + ", ".join(known)
        print(make_visible(f"error: there is no template `{parsed.template}`; {hint}"), file=sys.stderr)
        return 2
    if parsed.list:
        print("\n\n".join(_describe_template(name, known[name]) for name in known if parsed.template in (None, name)))
        return 0
    chosen = known[parsed.template or "beam"]
    if parsed.out is not None:
        return _copy_files([chosen.scene, *chosen.data_files], parsed.out)
    sys.stdout.write(chosen.scene.read_text(encoding="utf-8"))
    if chosen.data_files:
        names = " and ".join(f.name for f in chosen.data_files)
        print(f"it reads {names}: `dsl new {chosen.scene.stem} --out DIR` writes both", file=sys.stderr)
    return 0


def _describe_template(name: str, template: Template) -> str:
    """Return the description of a template, with the files that it writes."""
    files = ", ".join(f.name for f in (template.scene, *template.data_files))
    return "\n".join([f"{name}: {template.title}", *(f"  {line}" for line in template.about), f"  writes {files}"])


def _copy_files(files: list[Path], folder: Path) -> int:
    """Copy files to a folder without overwriting any file, and return the exit status."""
    from softmark.interpreter.results.atomic_files import replace

    taken = [folder / f.name for f in files if os.path.lexists(folder / f.name)]
    if taken:
        print(make_visible(f"error: {taken[0]} exists already; choose another folder"), file=sys.stderr)
        return 2
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for file in files:
            replace(folder / file.name, file.read_bytes())
    except OSError as failure:
        print(make_visible(f"error: {folder} cannot be written: {failure.strerror}"), file=sys.stderr)
        return 2
    for file in files:
        print(make_visible(str(folder / file.name)))
    return 0
