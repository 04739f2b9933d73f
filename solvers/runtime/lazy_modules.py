"""Modules that are imported at their first use, so that reading a vocabulary costs no numpy.

The classes that a scene names live beside their numerics. `dsl check` and `dsl explain` read the classes only.
"""

from __future__ import annotations

import importlib
from typing import Any


class Deferred:
    """Stands for the module `name` and imports it at the first attribute that is asked of it."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        value = getattr(importlib.import_module(self._name), attribute)
        setattr(self, attribute, value)
        return value


np = Deferred("numpy")
