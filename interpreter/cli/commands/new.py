"""`dsl new`."""

from __future__ import annotations

import argparse
import sys

from softmark.grammar.diagnostic import visible
from softmark.grammar.suggest import nearest
from softmark.scenes import ROOT


def arguments(parser: argparse.ArgumentParser) -> None:
    """[TEMPLATE]"""
    parser.add_argument(
        "template", nargs="?", default="beam", help="a template (default: beam); `dsl new --list` names them"
    )
    parser.add_argument("--list", action="store_true", help="name the templates")


def run(parsed: argparse.Namespace) -> int:
    """Print a commented scene: `dsl new > my.scene`."""
    templates = {p.stem: p for p in sorted((ROOT / "templates").glob("*.scene"))}
    if parsed.list:
        print("\n".join(templates))
        return 0
    if parsed.template not in templates:
        close = nearest(parsed.template, templates)
        hint = f"did you mean `{close}`?" if close else "templates: " + ", ".join(templates)
        print(visible(f"error: there is no template `{parsed.template}`; {hint}"), file=sys.stderr)
        return 2
    sys.stdout.write(templates[parsed.template].read_text(encoding="utf-8"))
    return 0
