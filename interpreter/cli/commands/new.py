"""`dsl new`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from softmark.grammar.diagnostic import visible
from softmark.grammar.suggest import nearest
from softmark.scenes import ROOT

FOLDER = ROOT / "templates"


def arguments(parser: argparse.ArgumentParser) -> None:
    """[TEMPLATE]"""
    parser.add_argument(
        "template", nargs="?", default="beam", help="a template (default: beam); `dsl new --list` names them"
    )
    parser.add_argument("--list", action="store_true", help="name the templates")
    parser.add_argument(
        "--out", metavar="DIR", type=Path, help="write the scene and the files that it reads there, not to the terminal"
    )


def run(parsed: argparse.Namespace) -> int:
    """Print a commented scene, `dsl new > my.scene`, or write it with the files that it reads."""
    templates = {p.stem: p for p in sorted(FOLDER.glob("*.scene"))}
    if parsed.list:
        width = max(map(len, templates))
        for name, file in templates.items():
            print(f"{name:{width}} {_title(file)}")
        return 0
    if parsed.template not in templates:
        close = nearest(parsed.template, templates)
        hint = f"did you mean `{close}`?" if close else "templates: " + ", ".join(templates)
        print(visible(f"error: there is no template `{parsed.template}`; {hint}"), file=sys.stderr)
        return 2
    scene = templates[parsed.template]
    beside = sorted(f for f in FOLDER.glob(f"{scene.stem}.*") if f != scene)
    if parsed.out is not None:
        return _written([scene, *beside], parsed.out)
    sys.stdout.write(scene.read_text(encoding="utf-8"))
    if beside:
        names = " and ".join(f.name for f in beside)
        print(f"it reads {names}: `dsl new {scene.stem} --out DIR` writes both", file=sys.stderr)
    return 0


def _title(scene: Path) -> str:
    """What a template says of itself behind the word `scene`."""
    lines = scene.read_text(encoding="utf-8").splitlines()
    return next(line.partition('"')[2].rstrip('"') for line in lines if line.startswith("scene "))


def _written(files: list[Path], folder: Path) -> int:
    """Copies of files in a folder; none replaces another file."""
    taken = [folder / f.name for f in files if (folder / f.name).exists()]
    if taken:
        print(visible(f"error: {taken[0]} is there already; name another folder"), file=sys.stderr)
        return 2
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for file in files:
            (folder / file.name).write_bytes(file.read_bytes())
    except OSError as failure:
        print(visible(f"error: {folder} cannot be written: {failure.strerror}"), file=sys.stderr)
        return 2
    for file in files:
        print(visible(str(folder / file.name)))
    return 0
