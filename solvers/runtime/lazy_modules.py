"""Modules that are imported at their first use, so that reading the vocabulary does not import numpy.

The module of a word of the scene language contains both its class and its numerical methods. `dsl check` and `dsl
explain` need only the classes.
"""

from __future__ import annotations

import importlib
from typing import Any


class LazyModule:
    """A proxy for the module `name` that imports it at the first attribute access."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        value = getattr(importlib.import_module(self._name), attribute)
        setattr(self, attribute, value)
        return value


np = LazyModule("numpy")
