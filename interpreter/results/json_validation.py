"""Validation of JSON from a file against the form that its readers expect.

The first mismatch is reported. A form is one or several types, a list with the form of its items, or a dictionary of
forms by key, with `*` for any other key and `!` after required keys. Null is accepted for everything optional.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, TypeAlias

Form: TypeAlias = "type | tuple[type, ...] | list[Any] | Mapping[str, Any]"

NUMBER = (int, float)
SPREAD = dict.fromkeys(("median", "q1", "q3", "min", "max", "p95", "runs"), NUMBER)
CLOCKS = ("setup_s", "solve_s", "step_s", "step_cpu_s", "cpu_s", "wall_s")
METRIC = {"value": NUMBER, "uncertainty": NUMBER, "unit": str, "reason": str}
JUDGED = {"metrics": {"*!": METRIC}, "status": str, "message": str}

REPORT = {
    "models!": {"*!": {**JUDGED, "time": dict.fromkeys(CLOCKS, SPREAD)}},
    "references!": {"*!": JUDGED},
    "environment": {}, "scene": {"parameters": {"*!": {}}},
    "expectations": [{"text!": str, "passed": bool}],
}  # fmt: skip
POINT = {
    "model!": str, "scene": str, "study": str, "status": str, "message": str, "variation": {"*": str},
    "errors": {"*!": METRIC}, "cost": {**dict.fromkeys(CLOCKS, SPREAD), "contaminated": bool},
}  # fmt: skip
COMPARISON = {"points!": [POINT], "references!": {"*!": {"*!": {}}}, "environment": {}, "scenes": [{}]}

OUTCOME = {
    "key": str, "point!": {"status!": str}, "references!": {"*!": {"status!": str, "probes": {"*!": {}}}},
    "truths": {"*!": {"stated": {}}}, "limit_s": NUMBER,
}  # fmt: skip
LEAN = {
    "references": {"*!": {"estimated_error": NUMBER, "sizes": {"*": NUMBER}}}, "limit_s": NUMBER,
    "truths": OUTCOME["truths"], "point!": {
        "status!": str, "message": str, "errors": {"*!": METRIC}, "warnings": [{"code!": str}],
        "stated": {"value": NUMBER, "doubts": [str], "parts": {"*": NUMBER}, "of": {"*!": {}}},
    },
}  # fmt: skip
RECORD = {"key!": str, "status": str, "message": str, "host": str, "kind": str, "elapsed_s": NUMBER}
ENTRIES: Mapping[str, Form] = {
    "accuracy": {"outcome!": OUTCOME}, "timing": {"record!": RECORD}, "stress": {"outcome!": LEAN},
}  # fmt: skip


def find_misfit(value: Any, form: Any, place: str = "") -> str | None:
    """Return a message about the first mismatch, `models.a.metrics is a list`; None if the value has the form.

    `place` is the path of the value in the file.
    """
    if isinstance(form, list):
        return _describe_list_mismatch(value, form[0], place)
    if isinstance(form, Mapping):
        return _describe_object_mismatch(value, form, place)
    if form == NUMBER:
        return None if _is_number(value) else f"`{place}` is {describe_type(value)}, not a number"
    return None if isinstance(value, form) else f"`{place}` is {describe_type(value)}"


def _is_number(value: Any) -> bool:
    """Return whether a value is a finite number within the range of float, and not a boolean."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return math.isfinite(value) if isinstance(value, float) else abs(value) < 2**63


def _describe_list_mismatch(value: Any, form: Any, place: str) -> str | None:
    if not isinstance(value, list):
        return f"`{place}` is {describe_type(value)}, not a list"
    parts = (find_misfit(item, form, f"{place}[{i}]") for i, item in enumerate(value))
    return next((part for part in parts if part), None)


def _describe_object_mismatch(value: Any, form: Mapping[str, Any], place: str) -> str | None:
    if not isinstance(value, dict):
        return f"`{place}` is {describe_type(value)}, not an object"
    asked = {key.removesuffix("!"): (part, key.endswith("!")) for key, part in form.items()}
    for key, (_, needed) in asked.items():
        if needed and key != "*" and value.get(key) is None:
            return f"`{_entry_path(place, key)}` is missing"
    for key, item in value.items():
        part, needed = asked.get(key) or asked.get("*") or (None, False)
        if part is None or (item is None and not needed):
            continue
        if problem := find_misfit(item, part, _entry_path(place, key)):
            return problem
    return None


def _entry_path(place: str, key: str) -> str:
    """Return the path of the entry `key` at `place`; long keys are shortened, since they come from the file."""
    short = key if len(key) <= 40 else f"{key[:40]}…"
    return f"{place}.{short}" if place else short


def describe_type(value: Any) -> str:
    """Return the type of a JSON value in words, such as `a list`."""
    words = {bool: "true or false", int: "a number", float: "a number", str: "a text", list: "a list"}
    return words.get(type(value), "null" if value is None else "an object")
