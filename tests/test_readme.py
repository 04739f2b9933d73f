"""README.md is true: its scene runs, its message is the one that is given, its commands exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import softmark
from softmark.grammar.diagnostic import Source, render
from softmark.interpreter.api import checked
from softmark.interpreter.cli import COMMANDS

TEXT = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


def block(kind: str) -> str:
    found = re.search(rf"^```{kind}\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
    assert found is not None
    return found[1]


def test_the_scene_runs_and_meets_its_expectation() -> None:
    report = softmark.loads(block("scene")).run()
    assert report.exit_status == 0
    assert [e.passed for e in report.expectations] == [True]


def test_the_message_is_the_one_that_is_given() -> None:
    shown = re.search(r"^```\n(error\[E204\].*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
    assert shown is not None
    wrong = block("scene").replace("young = 60 kPa", "young = 60 mm")
    _, found = checked(Source("beam.scene", wrong), Path(), None)
    assert render([d for d in found if d.severity == "error"], colour=False).strip() == shown[1].strip()


def test_the_python_example_runs() -> None:
    names: dict[str, object] = {}
    exec(compile(block("python"), "README.md", "exec"), names)
    report = names["report"]
    assert isinstance(report, softmark.Report)
    assert list(report.models) == ["rod"]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_is_in_the_table(command: str) -> None:
    assert f"`dsl {command}" in TEXT
