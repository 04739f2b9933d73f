"""Scenes of the library as they are loaded, once for all tests of a process: nothing changes them."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import softmark
from softmark.interpreter.api.python_api import LoadedScene


@cache
def loaded(file: Path) -> LoadedScene:
    """By its file."""
    return softmark.load(file)
