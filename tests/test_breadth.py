"""The table of quick cases names tests that are there: one that was renamed would be slow, or quick, without a word."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from breadth import QUICK

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("file", QUICK)
def test_what_it_names_is_there(file: str) -> None:
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    assert set(QUICK[file]) <= {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
