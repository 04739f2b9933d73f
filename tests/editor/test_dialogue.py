"""Dialogues with the server over a real client."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("pytest_lsp")

from editor_client import LOOP, client, opened, said
from lsprotocol import types
from pytest_lsp import LanguageClient

from softmark.scenes import ROOT

pytestmark = LOOP
__all__ = ["client"]


async def test_a_shipped_scene_has_warnings_and_no_errors(client: LanguageClient) -> None:
    file = next(ROOT.rglob("silicone-beam.scene"))
    text = opened(client, file.read_text(encoding="utf-8"), file.parent, file.name)
    assert {d.severity for d in await said(client, text)} == {types.DiagnosticSeverity.Warning}


async def test_an_error_comes_and_goes_with_the_text(client: LanguageClient, tmp_path: Path) -> None:
    text = opened(client, "param L = 3 mn\n", tmp_path)
    (found,) = [d for d in await said(client, text) if d.severity == types.DiagnosticSeverity.Error]
    assert (found.code, found.range.start) == ("E209", types.Position(0, 12))
