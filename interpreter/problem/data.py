"""Public data sets that a scene names: fetched when it runs, never when it is checked."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from softmark.interpreter.language.scene import Location
from softmark.interpreter.problem.case import fault


def located(shape: Any, at: Location) -> Any:
    """A shape whose file, if it is a data set, is here now. Raises Fault where it cannot be had."""
    path = getattr(shape, "path", "")
    if not path.startswith("data:"):
        return shape
    from softmark.references.data import Unavailable, find

    try:
        return replace(shape, path=str(find(path)))
    except Unavailable as failure:
        raise fault(
            "E406", at, f"the data set `{path}` is not available: {failure.reason}", help=failure.remedy
        ) from failure
