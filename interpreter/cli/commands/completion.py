"""Command `dsl completion`: prints the completion script of a shell.

The script calls this command again to get the candidates for the word that is being typed.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

SHELLS = ("bash", "zsh", "fish")


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `dsl completion`: `SHELL`."""
    meaning = 'for example: eval "$(dsl completion bash)"; `answers` is used by the scripts'
    parser.add_argument("shell", choices=(*SHELLS, "answers"), help=meaning)


def run(parsed: argparse.Namespace) -> int:
    """Print the completion script of a shell, or the candidates for an incomplete command line.

    The words of the command line are read from standard input, separated by NUL characters.
    """
    from softmark.interpreter.cli import completion

    if parsed.shell in SHELLS:
        print((Path(completion.__file__).parent / f"dsl.{parsed.shell}").read_text(encoding="utf-8"), end="")
        return 0
    from softmark.interpreter.cli.completion.candidates import find_candidates

    words = sys.stdin.buffer.read().decode("utf-8", errors="replace").split("\0")[:-1]
    for word, meaning in find_candidates(words).items():
        if word.isprintable():  # line feeds separate the candidates, so a file name with one is left out
            print(f"{word}\t{' '.join(meaning.split())}" if meaning else word)
    return 0
