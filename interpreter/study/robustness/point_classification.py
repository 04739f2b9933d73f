"""From the outcome of a task to a class: a pure function.

right | inaccurate | silent | not_converged | diverged | refused | failed | timed_out | unjudged

Which warnings count as doubts of a model about its own accuracy is said once, in
interpreter/verification/error_estimate.py.
"""

from __future__ import annotations

import re

from softmark.interpreter.results.error_statements import StatedError
from softmark.interpreter.results.state_results import LEFT_OUT
from softmark.interpreter.study.configurations.task_outcome import PointError, PointSummary, Truth
from softmark.interpreter.study.robustness.reference_trust import LeanOutcome
from softmark.interpreter.study.robustness.robustness_record import Classified
from softmark.interpreter.verification.error_estimate import DOUBTS, is_doubt

ABOUT_REFERENCES = ("E503", "E531", "E532", "W332", "W333")
CODE = re.compile(r"([EW]\d{3}): ")
NOTHING = PointError(None, "1", None)


def classify(
    outcome: LeanOutcome, metric: str, within: float, uncertainty: float | None, doubt: str | None = None
) -> Classified:
    """The class of an outcome of `tasks.perform`.

    `uncertainty` is that of the truth, relative to its displacements; `doubt` why it is none here, if it is none.
    """
    point = outcome.point
    codes = tuple(dict.fromkeys(w.code for w in point.warnings))
    status, message = point.status, point.message
    code = match[1] if (match := CODE.match(message or "")) else None
    if status == "failed" and (truth := _untrue_of(outcome)) is not None:
        return Classified("unjudged", message=truth, code=code, warnings=codes)
    if status == "failed" and code is not None:
        word = "unjudged" if code in ABOUT_REFERENCES else "refused"
        return Classified(word, message=message, code=code, warnings=codes)
    if status in ("not_converged", "diverged", "failed", "timed_out"):
        return Classified(status, message=message, code=code, warnings=codes, status=status)
    if status in LEFT_OUT:
        return Classified("unjudged", message=message or "it was not computed", warnings=codes, status=status)
    return _judged(outcome, metric, within, uncertainty, doubt, codes)


def _judged(
    outcome: LeanOutcome, metric: str, within: float, uncertainty: float | None, doubt: str | None,
    codes: tuple[str, ...],
) -> Classified:  # fmt: skip
    """The class of what has an answer."""
    point = outcome.point
    stated, status = stated_of(point, metric), point.status
    entry = point.errors.get(metric, NOTHING)
    blind = doubt or _blind(outcome, entry, within, uncertainty)
    if blind is not None or entry.value is None:
        return Classified("unjudged", entry.value, stated, uncertainty, blind, None, codes, status)
    if entry.value <= within + (uncertainty or 0.0):
        return Classified("right", entry.value, stated, uncertainty, point.message, None, codes, status)
    said = admission(point, stated, entry.value - (uncertainty or 0.0))
    word = "silent" if said is None else "inaccurate"
    return Classified(word, entry.value, stated, uncertainty, said or point.message, None, codes, status)


def _blind(outcome: LeanOutcome, entry: PointError, within: float, uncertainty: float | None) -> str | None:
    """Why an answer cannot be judged, if it cannot."""
    against = entry.against or ""
    reference, truth = outcome.references.get(against), (outcome.truths or {}).get(against)
    if reference is not None and reference.status != "converged":
        return f"the reference has no answer: {reference.message}"
    if truth is not None and (reason := _untrue(against, truth)) is not None:
        return reason
    if entry.against is not None and reference is None and truth is None:
        return f"nothing is known of how far `{against}` can be trusted"
    if entry.value is None:
        return entry.reason or "the metric has no value"
    if uncertainty is not None and uncertainty > within:
        return f"the reference is uncertain by {uncertainty:.2g}, more than the {within:g} that counts as right"
    return None


def _untrue_of(outcome: LeanOutcome) -> str | None:
    """Why nothing could be computed, where that is because of a model that is taken as right."""
    failed = ((n, t) for n, t in (outcome.truths or {}).items() if t.status == "failed")
    return next((_untrue(n, t) for n, t in failed), None)


def _untrue(name: str, truth: Truth) -> str | None:
    """Why a model is no truth, if it is none: it has to have an answer, without doubts, and vouch for it."""
    stated = truth.stated or StatedError()
    if truth.status != "converged":
        return f"`{name}`, which is taken as right, has no answer: {truth.message or truth.status}"
    if stated.doubts:
        said = (f"{code}, {DOUBTS[code]}" if code in DOUBTS else code for code in stated.doubts)
        return f"`{name}`, which is taken as right, doubts its answer ({'; '.join(said)})"
    if stated.value is None:
        reason = stated.reason or "it states no error"
        return f"`{name}`, which is taken as right, vouches for nothing: {reason}"
    return None


def stated_of(point: PointSummary, metric: str) -> StatedError | None:
    """What the model states of a metric; None where nothing was asked."""
    said = point.stated
    if said is None:
        return None
    return (said.of or {}).get(metric) or StatedError(said.value, said.unit, said.parts, said.reason, said.doubts)


def admission(point: PointSummary, stated: StatedError | None, error: float) -> str | None:
    """By what a model says itself that its answer may be off by `error`; None where it does not."""
    if point.status == "capped":
        return "it was stopped by its cap, and says so"
    for warning in point.warnings:
        if is_doubt(warning.code):
            return f"{warning.code}: {warning.message}"
    if stated is None:
        return None
    if stated.doubts:
        return f"it doubts its answer ({', '.join(stated.doubts)})"
    if stated.value is None:
        return f"it vouches for nothing: {stated.reason or 'no error could be stated'}"
    return f"it states an error of {stated.value:.2g}" if stated.value >= error else None
