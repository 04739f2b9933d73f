"""Classification of the outcome of one solution in a robustness study into nine classes.

right | inaccurate | silent | not_converged | diverged | refused | failed | timed_out | unjudged

A wrong result is inaccurate if the model states this itself, and silent if it gives no warning.
interpreter/verification/error_estimate.py defines which warnings count as a statement of a model about its
own error.
"""

from __future__ import annotations

import re

from softmark.interpreter.results.error_statements import StatedError
from softmark.interpreter.results.state_results import LEFT_OUT
from softmark.interpreter.study.configurations.task_outcome import PointError, PointSummary, TruthStatement
from softmark.interpreter.study.robustness.reference_uncertainty import LeanOutcome
from softmark.interpreter.study.robustness.robustness_record import ClassifiedPoint
from softmark.interpreter.verification.error_estimate import DOUBTS, is_doubt

ABOUT_REFERENCES = ("E503", "E531", "E532", "W332", "W333")
CODE = re.compile(r"([EW]\d{3}): ")
NOTHING = PointError(None, "1", None)


def classify(
    outcome: LeanOutcome, metric: str, within: float, uncertainty: float | None, doubt: str | None = None
) -> ClassifiedPoint:
    """Return the class of the outcome of a task, as one of the nine classes of this module.

    A result is right if its error `metric` is at most `within` plus the relative `uncertainty` of the reference.
    `doubt` is the reason why the reference is invalid for this scene, or None.
    """
    point = outcome.point
    codes = tuple(dict.fromkeys(w.code for w in point.warnings))
    status, message = point.status, point.message
    code = match[1] if (match := CODE.match(message or "")) else None
    if status == "failed" and (truth := _reason_reference_model_failed(outcome)) is not None:
        return ClassifiedPoint("unjudged", message=truth, code=code, warnings=codes)
    if status == "failed" and code is not None:
        word = "unjudged" if code in ABOUT_REFERENCES else "refused"
        return ClassifiedPoint(word, message=message, code=code, warnings=codes)
    if status in ("not_converged", "diverged", "failed", "timed_out"):
        return ClassifiedPoint(status, message=message, code=code, warnings=codes, status=status)
    if status in LEFT_OUT:
        return ClassifiedPoint("unjudged", message=message or "it was not computed", warnings=codes, status=status)
    return _classify_answer(outcome, metric, within, uncertainty, doubt, codes)


def _classify_answer(
    outcome: LeanOutcome, metric: str, within: float, uncertainty: float | None, doubt: str | None,
    codes: tuple[str, ...],
) -> ClassifiedPoint:  # fmt: skip
    """Return the class of an outcome with a solution: right, inaccurate, silent or unjudged.

    The arguments are those of `classify`; `codes` are the codes of the warnings of the model.
    """
    point = outcome.point
    stated, status = stated_of(point, metric), point.status
    entry = point.errors.get(metric, NOTHING)
    blind = doubt or _reason_unjudged(outcome, entry, within, uncertainty)
    if blind is not None or entry.value is None:
        return ClassifiedPoint("unjudged", entry.value, stated, uncertainty, blind, None, codes, status)
    if entry.value <= within + (uncertainty or 0.0):
        return ClassifiedPoint("right", entry.value, stated, uncertainty, point.message, None, codes, status)
    said = find_admission(point, stated, entry.value - (uncertainty or 0.0))
    word = "silent" if said is None else "inaccurate"
    return ClassifiedPoint(word, entry.value, stated, uncertainty, said or point.message, None, codes, status)


def _reason_unjudged(outcome: LeanOutcome, entry: PointError, within: float, uncertainty: float | None) -> str | None:
    """Return the reason why a solution cannot be judged, or None if it can."""
    against = entry.against or ""
    reference, truth = outcome.references.get(against), (outcome.truths or {}).get(against)
    if reference is not None and reference.status != "converged":
        return f"the reference has no result: {reference.message}"
    if truth is not None and (reason := _reason_no_reference(against, truth)) is not None:
        return reason
    if entry.against is not None and reference is None and truth is None:
        return f"the accuracy of `{against}` is unknown"
    if entry.value is None:
        return entry.reason or "the metric has no value"
    if uncertainty is not None and uncertainty > within:
        return f"the uncertainty of the reference, {uncertainty:.2g}, exceeds the limit {within:g} for a right result"
    return None


def _reason_reference_model_failed(outcome: LeanOutcome) -> str | None:
    """Return the reason why the reference model failed, or None if no reference model failed."""
    failed = ((n, t) for n, t in (outcome.truths or {}).items() if t.status == "failed")
    return next((_reason_no_reference(n, t) for n, t in failed), None)


def _reason_no_reference(name: str, truth: TruthStatement) -> str | None:
    """Return the reason why a model cannot serve as the reference, or None if it can.

    It must have converged and must state an error without doubts.
    """
    stated = truth.stated or StatedError()
    if truth.status != "converged":
        return f"the reference model `{name}` has no result: {truth.message or truth.status}"
    if stated.doubts:
        said = (f"{code}, {DOUBTS[code]}" if code in DOUBTS else code for code in stated.doubts)
        return f"the reference model `{name}` has warnings ({'; '.join(said)})"
    if stated.value is None:
        reason = stated.reason or "none could be estimated"
        return f"the reference model `{name}` has no error estimate: {reason}"
    return None


def stated_of(point: PointSummary, metric: str) -> StatedError | None:
    """Return the error that a model states for a metric; None if no error statement was requested."""
    said = point.stated
    if said is None:
        return None
    return (said.of or {}).get(metric) or StatedError(said.value, said.unit, said.parts, said.reason, said.doubts)


def find_admission(point: PointSummary, stated: StatedError | None, error: float) -> str | None:
    """Return the text in which a model admits an error as large as `error`, or None if it does not."""
    if point.status == "capped":
        return "it was stopped by `max_iterations` and reports that"
    for warning in point.warnings:
        if is_doubt(warning.code):
            return f"{warning.code}: {warning.message}"
    if stated is None:
        return None
    if stated.doubts:
        return f"it has warnings ({', '.join(stated.doubts)})"
    if stated.value is None:
        return f"it has no error estimate: {stated.reason or 'none could be estimated'}"
    return f"the model estimates an error of {100 * stated.value:.2g} %" if stated.value >= error else None
