"""The plain text of docstrings as Markdown (MyST): prose flows, formulas keep their lines, words become links."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

WRAPPED = 100  # characters: a line that the next word would have made longer was broken by the margin alone
SPECIAL = re.compile(r"([\\*_<>\[\]#$|~{}`@^])")
CODE = re.compile(r"(`[^`]+`)")
# a line of a formula: indented, or an equation that is no part of a sentence
FORMULA = re.compile(r"^(?:\s+\S.*|[\w'()^]+(?:\([^)]*\))? = .*|[^.;]*'' = .*)$")
OWN = re.compile(r"^(?:Source|Kind|Sources): ")

Linked = Callable[[str], str | None]


def no_links(word: str) -> None:
    """What `escaped` asks of a code word: none is a link."""


def escaped(text: str, linked: Linked = no_links) -> str:
    """Text in which nothing is markup but `code`; a code word that `linked` knows becomes what it gives."""
    parts = CODE.split(text)
    return "".join((linked(p[1:-1]) or p) if i % 2 else SPECIAL.sub(r"\\\1", p) for i, p in enumerate(parts))


def described(doc: str, linked: Linked = no_links) -> str:
    """A docstring as paragraphs and blocks of formulas."""
    blocks = (block for part in re.split(r"\n\s*\n", doc) for block in _blocks(part.split("\n")))
    return "\n\n".join(_fenced(lines) if formula else escaped(" ".join(lines), linked) for formula, lines in blocks)


def _blocks(lines: list[str]) -> Iterator[tuple[bool, list[str]]]:
    """Runs of lines that are a formula, and sentences that go on from one to the next."""
    own: list[str] = []
    before = ""
    kind = False
    for line, after in zip(lines, [*lines[1:], ""], strict=True):
        formula = bool(FORMULA.match(line)) and not _goes_on(before, line) and not (after and _goes_on(line, after))
        new = formula != kind or (not formula and not _goes_on(before, line)) or bool(OWN.match(line))
        if own and new:
            yield kind, own
            own = []
        own.append(line if formula else line.strip())
        before, kind = line, formula
    if own:
        yield kind, own


def _goes_on(before: str, line: str) -> bool:
    """Whether a line was broken by the margin alone, so that the next one goes on with its sentence."""
    return len(before) + 1 + len(line.split(" ", 1)[0]) > WRAPPED and not line.startswith(" ")


def _fenced(lines: list[str]) -> str:
    return "\n".join(["```text", *lines, "```"])


def fenced(language: str, text: str) -> str:
    """A block of code."""
    return f"```{language}\n{text.rstrip()}\n```"


def folded(summary: str, inside: str) -> str:
    """What opens when its summary is clicked; open on paper."""
    opened = f"```{{raw}} html\n<details><summary>{summary}</summary>\n```"
    return f"{opened}\n\n{inside}\n\n```{{raw}} html\n</details>\n```"
