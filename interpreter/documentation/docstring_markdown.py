"""Conversion of docstrings to Markdown (MyST).

Wrapped lines of prose are joined, formulas keep their lines, and words of the language become links.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

WRAPPED = 100  # characters: a line that would exceed this with the next word was only wrapped
SPECIAL = re.compile(r"([\\*_<>\[\]#$|~{}`@^])")
CODE = re.compile(r"(`[^`]+`)")
# a line of a formula: indented, or an equation that is no part of a sentence
FORMULA = re.compile(r"^(?:\s+\S.*|[\w'()^]+(?:\([^)]*\))? = .*|[^.;]*'' = .*)$")
OWN = re.compile(r"^(?:Source|Kind|Sources): ")

Linked = Callable[[str], str | None]


def no_links(word: str) -> None:
    """Return None for every word: the resolver of links for text without links."""


def escape_markup(text: str, linked: Linked = no_links) -> str:
    """Return text with all markup escaped except `code`.

    A word in `code` becomes a link if `linked` returns one for it.
    """
    parts = CODE.split(text)
    return "".join((linked(p[1:-1]) or p) if i % 2 else SPECIAL.sub(r"\\\1", p) for i, p in enumerate(parts))


def docstring_to_markdown(doc: str, linked: Linked = no_links) -> str:
    """Return a docstring as Markdown: paragraphs, and blocks of formulas."""
    blocks = (block for part in re.split(r"\n\s*\n", doc) for block in _group_formulas_and_paragraphs(part.split("\n")))
    return "\n\n".join(
        _formula_block(lines) if formula else escape_markup(" ".join(lines), linked) for formula, lines in blocks
    )


def _group_formulas_and_paragraphs(lines: list[str]) -> Iterator[tuple[bool, list[str]]]:
    """Yield groups of lines, each with whether it is a formula: a run of formulas, or the lines of one paragraph."""
    own: list[str] = []
    before = ""
    kind = False
    for line, after in zip(lines, [*lines[1:], ""], strict=True):
        formula = (
            bool(FORMULA.match(line))
            and not _continues_sentence(before, line)
            and not (after and _continues_sentence(line, after))
        )
        new = formula != kind or (not formula and not _continues_sentence(before, line)) or bool(OWN.match(line))
        if own and new:
            yield kind, own
            own = []
        own.append(line if formula else line.strip())
        before, kind = line, formula
    if own:
        yield kind, own


def _continues_sentence(before: str, line: str) -> bool:
    """Return whether `line` continues the sentence of the line before it, which was only wrapped at the margin."""
    return len(before) + 1 + len(line.split(" ", 1)[0]) > WRAPPED and not line.startswith(" ")


def _formula_block(lines: list[str]) -> str:
    return "\n".join(["```text", *lines, "```"])


def code_block(language: str, text: str) -> str:
    """Return a fenced Markdown code block in a language."""
    return f"```{language}\n{text.rstrip()}\n```"


def collapsible(summary: str, inside: str) -> str:
    """Return collapsible Markdown content with a summary to click on; it is open in print."""
    opened = f"```{{raw}} html\n<details><summary>{summary}</summary>\n```"
    return f"{opened}\n\n{inside}\n\n```{{raw}} html\n</details>\n```"
