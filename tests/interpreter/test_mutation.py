"""Every shipped scene with one token deleted, doubled or misspelt is an error or a valid scene.

By default a sample of the mutations is checked, the same in every run, and a larger one, of others, with `-m slow`.
All of them: SOFTMARK_ALL_MUTATIONS=1 pytest tests/interpreter/test_mutation.py. Add -s to see the slowest.
"""

from __future__ import annotations

import os
import random
import re
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from softmark.grammar.diagnostic import Diagnostic, Source, render
from softmark.grammar.lexer import Token, lex
from softmark.interpreter.validation.scene_loader import load_scene
from softmark.scenes import ROOT

SCENES = sorted(ROOT.rglob("*.scene"))
SAMPLES = [  # mutations of each scene
    pytest.param(1, id="few"),
    pytest.param(40, id="many", marks=pytest.mark.slow),
]
PLACES = {
    "(": "[",
    ")": "]",
    "[": "(",
    "]": ")",
    "=": ":",
    ",": ";",
    "<": ">",
    ">": "<",
    "+": "-",
    "-": "+",
    "*": "/",
    "/": "*",
}


@dataclass(frozen=True)
class Mutation:
    """A scene with one token changed."""

    what: str
    token: Token
    text: str

    def __str__(self) -> str:
        return f"{self.what} `{self.token.text}` in line {self.token.line}"


def mutations(text: str) -> Iterator[Mutation]:
    """Each token deleted, doubled, and misspelt."""
    chance = random.Random(text)
    for token in lex(text).tokens:
        before, after = text[: token.start], text[token.end :]
        yield Mutation("delete", token, before + after)
        yield Mutation("double", token, f"{before}{token.text} {token.text}{after}")
        yield Mutation("misspell", token, before + misspelt(token.text, chance) + after)


def misspelt(word: str, chance: random.Random) -> str:
    """Two neighbours swapped, or a letter replaced; another sign for a sign."""
    if word in PLACES:
        return PLACES[word]
    i = chance.randrange(len(word))
    if len(set(word)) > 1 and chance.random() < 0.5:
        i = chance.choice([j for j in range(len(word) - 1) if word[j] != word[j + 1]])
        return word[:i] + word[i + 1] + word[i] + word[i + 2 :]
    return word[:i] + chance.choice("qzQ7_%") + word[i + 1 :]


def chosen(scene: Path, count: int) -> list[Mutation]:
    """The mutations of a scene that are checked in this run."""
    every = list(mutations(scene.read_text(encoding="utf-8")))
    if os.environ.get("SOFTMARK_ALL_MUTATIONS") or len(every) <= count:
        return every
    return random.Random(f"{scene.name} {count}").sample(every, count)


@pytest.mark.parametrize("count", SAMPLES)
@pytest.mark.parametrize("scene", SCENES, ids=lambda p: p.stem)
def test_mutations(scene: Path, count: int) -> None:
    slowest = (0.0, "")
    for mutation in chosen(scene, count):
        start = time.process_time()
        compiled, found = load_scene(Source(scene.name, mutation.text), scene.parent, scene)
        slowest = max(slowest, (time.process_time() - start, str(mutation)))
        wrong = [d for d in found if d.severity == "error"]
        assert (compiled is None) == bool(wrong), mutation
        for diagnostic in found:
            assert_inside(diagnostic, mutation)
        assert render(found).count("[") >= len(found), mutation
    print(f"\n{scene.stem}: at most {slowest[0]:.3f} s CPU, {slowest[1]}")


def assert_inside(diagnostic: Diagnostic, mutation: Mutation) -> None:
    """The span lies in the text that it names, and its line and column say the same as its offsets."""
    source, span = diagnostic.source, diagnostic.span
    assert source is not None, mutation
    assert span is not None, mutation
    assert 0 <= span.start <= span.end <= len(source.text), (mutation, diagnostic)
    for offset, line, column in ((span.start, span.line, span.column), (span.end, span.end_line, span.end_column)):
        starts = [0, *(m.end() for m in re.finditer(r"\r\n|\n|\r", source.text))]
        assert starts[line - 1] + column - 1 == offset, (mutation, diagnostic)
    assert diagnostic.message, mutation
