"""Emacs mode with highlighting and the language server (eglot, included in Emacs 29)."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from softmark.interpreter.language_server.syntax_highlighting.highlighted_words import words

TITLE = "syntax highlighting and the language server (eglot) for Emacs"
FILE = "softmark-mode.el"


def files() -> dict[str, bytes]:
    """Return the Emacs library: the template in this folder with the words of each role in place of `@role@`."""
    text = Path(__file__).with_name(FILE).read_text(encoding="utf-8")
    for role, own in asdict(words()).items():
        text = text.replace(f"@{role}@", " ".join(f'"{word}"' for word in own))
    return {FILE: text.encode()}


def install(folder: Path) -> str:
    """Return instructions on how to install the Emacs library from `folder`."""
    return (
        f'Add to your init file: (load "{folder.resolve() / FILE}")\n'
        '`M-x eglot` in a scene starts the language server: pip install "softmark[lsp]"'
    )
