"""From the outcome of a task to a class: a pure function of plain JSON.

right | inaccurate | silent | not_converged | diverged | refused | failed | timed_out | unjudged

Which warnings count as doubts of a model about its own accuracy is said once, in
interpreter/evidence/error_estimate.py.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from softmark.interpreter.evidence.error_estimate import DOUBTS, is_doubt
from softmark.records import dataclass

CLASSES = (
    "right", "inaccurate", "silent", "not_converged", "diverged", "refused", "failed", "timed_out", "unjudged"
)  # fmt: skip

ABOUT_REFERENCES = ("E503", "E531", "E532", "W332", "W333")
CODE = re.compile(r"([EW]\d{3}): ")


@dataclass(frozen=True)
class Classified:
    """What a point is, and the numbers that say so; `uncertainty` is that of the truth, relative."""

    word: str
    error: float | None = None
    stated: Mapping[str, Any] | None = None
    uncertainty: float | None = None
    message: str | None = None
    code: str | None = None
    warnings: tuple[str, ...] = ()
    status: str | None = None  # of the model


def classify(
    outcome: Mapping[str, Any], metric: str, within: float, uncertainty: float | None, doubt: str | None = None
) -> Classified:
    """The class of an outcome of `tasks.perform`.

    `uncertainty` is that of the truth, relative to its displacements; `doubt` why it is none here, if it is none.
    """
    point = outcome["point"]
    codes = tuple(dict.fromkeys(str(w["code"]) for w in point.get("warnings") or ()))
    status, message = str(point["status"]), point.get("message")
    code = match[1] if (match := CODE.match(message or "")) else None
    if status == "failed" and (truth := _untrue_of(outcome)) is not None:
        return Classified("unjudged", message=truth, code=code, warnings=codes)
    if status == "failed" and code is not None:
        word = "unjudged" if code in ABOUT_REFERENCES else "refused"
        return Classified(word, message=message, code=code, warnings=codes)
    if status in ("not_converged", "diverged", "failed", "timed_out"):
        return Classified(status, message=message, code=code, warnings=codes, status=status)
    if status == "skipped":
        return Classified("unjudged", message=message or "it was not computed", warnings=codes, status=status)
    return _judged(outcome, metric, within, uncertainty, doubt, codes)


def _judged(
    outcome: Mapping[str, Any], metric: str, within: float, uncertainty: float | None, doubt: str | None,
    codes: tuple[str, ...],
) -> Classified:  # fmt: skip
    """The class of what has an answer."""
    point = outcome["point"]
    stated, status = stated_of(point, metric), str(point["status"])
    entry = (point.get("errors") or {}).get(metric) or {}
    error: float | None = entry.get("value")
    blind = doubt or _blind(outcome, entry, within, uncertainty)
    message = point.get("message")
    if blind is not None or error is None:
        return Classified("unjudged", error, stated, uncertainty, blind, None, codes, status)
    allowed = within + (uncertainty or 0.0)
    if error <= allowed:
        return Classified("right", error, stated, uncertainty, message, None, codes, status)
    said = admission(point, stated, error - (uncertainty or 0.0))
    word = "silent" if said is None else "inaccurate"
    return Classified(word, error, stated, uncertainty, said or message, None, codes, status)


def _blind(
    outcome: Mapping[str, Any], entry: Mapping[str, Any], within: float, uncertainty: float | None
) -> str | None:
    """Why an answer cannot be judged, if it cannot."""
    against = entry.get("against")
    reference = (outcome.get("references") or {}).get(against)
    if reference is not None and reference.get("status") != "converged":
        return f"the reference has no answer: {reference.get('message')}"
    truth = (outcome.get("truths") or {}).get(against)
    if truth is not None and (reason := _untrue(str(against), truth)) is not None:
        return reason
    if against is not None and reference is None and truth is None:
        return f"nothing is known of how far `{against}` can be trusted"
    if entry.get("value") is None:
        return str(entry.get("reason") or "the metric has no value")
    if uncertainty is not None and uncertainty > within:
        return f"the reference is uncertain by {uncertainty:.2g}, more than the {within:g} that counts as right"
    return None


def _untrue_of(outcome: Mapping[str, Any]) -> str | None:
    """Why nothing could be computed, where that is because of a model that is taken as right."""
    failed = ((n, t) for n, t in (outcome.get("truths") or {}).items() if t.get("status") == "failed")
    return next((_untrue(n, t) for n, t in failed), None)


def _untrue(name: str, truth: Mapping[str, Any]) -> str | None:
    """Why a model is no truth, if it is none: it has to have an answer, without doubts, and vouch for it."""
    stated = truth.get("stated") or {}
    if truth.get("status") != "converged":
        return f"`{name}`, which is taken as right, has no answer: {truth.get('message') or truth.get('status')}"
    if stated.get("doubts"):
        said = (f"{code}, {DOUBTS[code]}" if code in DOUBTS else str(code) for code in stated["doubts"])
        return f"`{name}`, which is taken as right, doubts its answer ({'; '.join(said)})"
    if stated.get("value") is None:
        reason = stated.get("reason") or "it states no error"
        return f"`{name}`, which is taken as right, vouches for nothing: {reason}"
    return None


def stated_of(point: Mapping[str, Any], metric: str) -> Mapping[str, Any] | None:
    """What the model states of a metric; None where nothing was asked."""
    stated: Mapping[str, Any] = point.get("stated") or {}
    own: Mapping[str, Any] = (stated.get("of") or {}).get(metric) or stated
    return {n: v for n, v in own.items() if n not in ("of", "metric")} or None


def admission(point: Mapping[str, Any], stated: Mapping[str, Any] | None, error: float) -> str | None:
    """By what a model says itself that its answer may be off by `error`; None where it does not."""
    if point.get("status") == "capped":
        return "it was stopped by its cap, and says so"
    for warning in point.get("warnings") or ():
        if is_doubt(str(warning["code"])):
            return f"{warning['code']}: {warning['message']}"
    if stated is None:
        return None
    if stated.get("doubts"):
        return f"it doubts its answer ({', '.join(map(str, stated['doubts']))})"
    if stated.get("value") is None:
        return f"it vouches for nothing: {stated.get('reason') or 'no error could be stated'}"
    value = float(stated["value"])
    return f"it states an error of {value:.2g}" if value >= error else None
