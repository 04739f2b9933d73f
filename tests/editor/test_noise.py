"""A server whose checks print and raise: what is printed does not reach the protocol, and what raises ends nothing."""

from __future__ import annotations

import sys
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

pytest.importorskip("pytest_lsp")

import pytest_lsp
from editor_client import DSL, LOOP, began, opened, said
from editor_texts import SCENE
from lsprotocol import types
from pytest_lsp import ClientServerConfig, LanguageClient

pytestmark = LOOP
LOUD = """
import os
from softmark.interpreter.validation import scene_loader
quiet = scene_loader.check_scene
def loud(scene, found, only=()):
    print("noise")
    os.write(1, b"noise of a library")
    os.system("echo noise of a process")
    if "boom" in scene.source.text:
        raise RuntimeError("boom")
    return quiet(scene, found, only)
scene_loader.check_scene = loud
"""
COMMAND = [sys.executable, "-c", LOUD + DSL, "lsp"]


@pytest_lsp.fixture(scope="module", config=ClientServerConfig(server_command=COMMAND))
async def client(lsp_client: LanguageClient) -> AsyncIterator[None]:
    await began(lsp_client)
    yield
    await lsp_client.shutdown_session()


async def test_the_protocol_stays_clean_and_the_server_alive(client: LanguageClient, tmp_path: Path) -> None:
    bad = opened(client, SCENE + "param boom = 3 mm\n", tmp_path, "bad.scene")
    good = opened(client, SCENE + "param bad = 3 mn\n", tmp_path, "good.scene")
    found = await said(client, good)
    assert "E209" in {d.code for d in found}
    item = types.HoverParams(bad, types.Position(0, 6))
    assert await client.text_document_hover_async(item) is not None
