"""What tests share: reading a page, and refusing one whose tags are out of place; models that answer wrongly."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from html.parser import HTMLParser
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.prepared_model import Solution

VOID = {"meta", "input", "br", "img", "link", "wbr"}


class Page(HTMLParser):
    """What a page is made of; raises at the first tag out of place."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.words: list[str] = []
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert len(attrs) == len(dict(attrs)), f"an attribute twice in <{tag}>"
        self.tags.append((tag, {k: v or "" for k, v in attrs}))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] not in ("style", "script"):
            self.words.append(data)

    def count(self, tag: str) -> int:
        return sum(t == tag for t, _ in self.tags)

    def all(self, tag: str) -> list[dict[str, str]]:
        return [attrs for t, attrs in self.tags if t == tag]

    @property
    def text(self) -> str:
        """The words as read, with plain spaces."""
        return re.sub(r"\s+", " ", "".join(self.words))


@pytest.fixture(scope="session")
def parsed() -> Callable[[str], Page]:
    """Reads a page, once for several tests."""
    return lru_cache(maxsize=8)(Page)


@pytest.fixture(scope="session")
def fuzz_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files that fuzzed scenes may name, a pipe and a link to an endless device among them."""
    found: Path = import_module("scene").stage(tmp_path_factory.mktemp("fuzz"))  # tests/fuzz/scene.py
    return found


@dataclass
class Twisted:
    """A prepared model whose solutions are tampered with."""

    inner: Any
    change: Callable[[Solution], Solution]

    def __getattr__(self, name: str) -> Any:
        return getattr(self.inner, name)

    def solve(self, watch: Any) -> Solution:
        return self.change(self.inner.solve(watch))


@pytest.fixture
def tampered(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[Solution], Solution]], None]:
    """Makes every model's solutions pass through a change."""
    from softmark.interpreter.pipeline import model_runs as runner

    honest = runner.prepared_model

    def install(change: Callable[[Solution], Solution]) -> None:
        def prepared(*arguments: Any) -> Any:
            found, spent = honest(*arguments)
            return Twisted(found, change), spent

        monkeypatch.setattr(runner, "prepared_model", prepared)

    return install
