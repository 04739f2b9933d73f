"""What is not installed with softmark itself: one message with the way to install it."""

from __future__ import annotations

import importlib
from typing import Any


class MissingExtra(ImportError):
    """A package that only some of softmark needs is not installed; the message says how to get it."""


def needed(module: str, what: str, extra: str) -> Any:
    """A module of an extra. Raises MissingExtra where its package is not there."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        if error.name is not None and error.name.partition(".")[0] != package:
            raise  # it is there, and something that it needs is broken
        raise MissingExtra(
            f'{what} needs {package}, which is not installed: pip install "softmark[{extra}]"', name=package
        ) from None
