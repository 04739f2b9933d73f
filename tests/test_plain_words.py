"""Plain words, as far as a machine can check them: first words of docstrings, and names of modules."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PARTS = ("grammar", "interpreter", "references", "solvers")
FILES = [f for part in PARTS for f in sorted((ROOT / part).rglob("*.py")) if "__pycache__" not in f.parts]
# No docstring begins with one of these: the noun or the verb comes first.
FIRST = re.compile(
    r"(Of|In|At|As|By|For|From|On|To|With|Without|Within|Beside|Behind|That|Those|This|These|It|Its|They|Their"
    r"|What|Which|Who|Whoever|Whose|Where|Wherever|When|Whenever|Whether|Why|How|But|And|Or|The same)\b"
)
# Modules may share a name only where they have the same role in sibling packages.
SAME_ROLE = {"__init__", "__main__"}
# A module's name is a noun: none of these participles, prepositions and adverbs.
NOT_NOUNS = """
above afloat after apart around asked away before behind below beside between beyond carried
disturbed doubts drawn found given gone held kept known lacking left made meant named out outside
pressed rubbing said seen shown shared stated stressed taken tied told touched touching turned
turning unchecked varying within without
"""
NO_NOUN = frozenset(NOT_NOUNS.split())


def docstrings(file: Path) -> list[tuple[str, str]]:
    """The name and the docstring of each module, class and function of a file that has one."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    kinds = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
    nodes = [n for n in ast.walk(tree) if isinstance(n, kinds)]
    found = [(getattr(n, "name", file.stem), ast.get_docstring(n)) for n in nodes]
    return [(name, text) for name, text in found if text]


@pytest.mark.parametrize("part", PARTS)
def test_docstrings_begin_with_a_noun_or_a_verb(part: str) -> None:
    wrong = [
        f"{file.relative_to(ROOT)}: {name}: {text.splitlines()[0]}"
        for file in FILES
        if file.is_relative_to(ROOT / part)
        for name, text in docstrings(file)
        if FIRST.match(text)
    ]
    assert not wrong, "\n".join(wrong)


def test_modules_have_names_of_their_own() -> None:
    places = defaultdict(list)
    for file in FILES:
        places[file.stem].append(file.relative_to(ROOT).as_posix())
    assert not {name: where for name, where in places.items() if len(where) > 1 and name not in SAME_ROLE}


def test_names_of_modules_are_nouns() -> None:
    assert not [file.relative_to(ROOT).as_posix() for file in FILES if file.stem in NO_NOUN]


def test_the_lint_finds_what_it_is_for() -> None:
    assert FIRST.match("Of contact, m^2.")
    assert FIRST.match("What presses on a surface.")
    assert not FIRST.match("Contact area, m^2.")
    assert not FIRST.match("Theory of beams.")
