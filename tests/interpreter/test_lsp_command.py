"""`dsl lsp` where what it needs is not there: its packages, an editor."""

from __future__ import annotations

import pytest

from softmark.interpreter.cli.commands import lsp
from softmark.interpreter.cli.main import main


def test_without_the_extra_one_line_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(lsp, "find_spec", lambda name: None)
    assert main(["lsp"]) == 2
    said = capsys.readouterr()
    assert said.err == 'error: `dsl lsp` needs pygls: pip install "softmark[lsp]"\n'
    assert said.out == ""


def test_in_a_terminal_it_says_who_starts_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(lsp, "find_spec", lambda name: True)
    monkeypatch.setattr("sys.stdin.isatty", lambda: True)
    assert main(["lsp"]) == 2
    assert "is started by editors" in capsys.readouterr().err
