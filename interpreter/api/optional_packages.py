"""Import of optional packages, with an error that gives the install command if one is missing."""

from __future__ import annotations

import importlib
from typing import Any


class MissingExtra(ImportError):
    """Error when an optional package is not installed; the message gives the install command."""


def import_extra(module: str, what: str, extra: str) -> Any:
    """Import and return an optional module. Raises MissingExtra with the name of the extra if it is not installed."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        if error.name is not None and error.name.partition(".")[0] != package:
            raise  # the package is installed, but one of its own imports fails
        raise MissingExtra(
            f'{what} needs {package}, which is not installed: pip install "softmark[{extra}]"', name=package
        ) from None
