"""Errors that models state of their own results, and whether their forces were verified."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from softmark.interpreter.language import units
from softmark.interpreter.language.number_formatting import format_quantity
from softmark.interpreter.results.run_report import MetricResult, ModelResult, Report

SEVERAL = 5  # largest number of names listed in a line


def error_statement(model: ModelResult) -> str | None:
    """Return a phrase on the first metric, `estimates an error of at most 3 %`; None if no error was estimated."""
    if not model.stated or has_no_estimate(model):
        return None
    first = next((n for n in model.metrics if n in model.stated), next(iter(model.stated)))
    said = model.stated[first]
    doubts = f" (with warnings: {', '.join(said.doubts)})" if said.doubts else ""
    if said.value is None:
        return f"has no error estimate for `{first}`: {said.reason or 'no reason given'}{doubts}"
    found = model.metrics.get(first)
    value = amount(said.value, said.unit or "1", found.value if found else None)
    return f"estimates an error of at most {value} in `{first}`{doubts}"


def amount(value: float, unit: str = "1", of: float | None = None) -> str:
    """Return an error as text with two digits.

    It is raised to at least DIGITS times `of`, the value of the metric that has this error.
    """
    shown: str = format_quantity(max(value, DIGITS * abs(of or 0.0)), unit, 2, percent=True)
    return shown


def has_no_estimate(model: ModelResult) -> bool:
    """Return whether a model states no error because no estimate was requested."""
    each = model.stated.values()
    return all(s.value is None and NOT_ASKED in (s.reason or "") for s in each)


NOT_ASKED = "`--stated` does"  # part of the reason if an estimate was skipped because of its cost


def stated_error(value: float, found: MetricResult) -> str:
    """Return the stated error of a metric as text, `± 0.05`, in the unit in which the metric is shown."""
    dimension = units.parse_unit(found.unit).dimension
    if dimension == units.NONE:
        return f"± {_format_two_digits(100.0 * value)}"
    unit = units.format_value(float(f"{found.value or 0.0:.6g}"), dimension).partition(" ")[2]
    shown = value / units.parse_unit(unit).factor if unit else 0.0
    return f"± {_format_two_digits(shown)}" if LEAST <= shown < MOST else f"± {amount(value, found.unit, found.value)}"


DIGITS = 1e-9  # smallest relative error shown, far below the six digits of a number
LEAST, MOST = 1e-3, 1e3  # range of numbers shown without powers of ten


def _format_two_digits(value: float) -> str:
    """Return a number with two digits as text, without a power of ten for whole numbers from 1 to 1e6."""
    shown = f"{value:.2g}"
    return f"{float(shown):.0f}" if 1.0 <= value < 1e6 and float(shown) == round(float(shown)) else shown


def verified_forces_sentence(report: Report) -> str | None:
    """Return a sentence on forces that were verified by independent formulas; None if there are none."""
    solved = (own for m in report.models.values() for own in m.each or (m,))
    checks = (own.solve.get("checks") or {} for own in solved)
    found = [c["residual"] for c in checks if c.get("residual") is not None]
    if not found:
        return None
    return (
        f"Forces of {len(found)} solution{'s' if len(found) > 1 else ''} were verified by independent formulas: the "
        f"imbalance is at most {max(found):.0e} of the loads."
    )


def missing_estimates_sentence(report: Report) -> str | None:
    """Return a sentence on models whose errors were not requested; None if there are none."""
    names = [f"`{n}`" for n, m in report.models.items() if m.stated and has_no_estimate(m)]
    if not names:
        return None
    who = ", ".join(names) if len(names) <= SEVERAL else f"{len(names)} models"
    return (
        f"no error estimate for {who}: an estimate of the mesh error costs about as much as the solution; request "
        f"it with `--stated`"
    )


def lines(report: Report) -> Iterator[str]:
    """Yield a line with the stated error of each model; if many models have equal statements, one line for all."""
    said = {n: w for n, m in report.models.items() if (w := error_statement(m)) is not None}
    alike, first = Counter(said.values()), {w: n for n, w in reversed(said.items())}
    for name, own in said.items():
        if alike[own] <= SEVERAL:
            yield f"{name} {own}"
        elif first[own] == name:
            plural = own.replace("estimates", "estimate", 1).replace("has no", "have no", 1)
            yield f"{alike[own]} models {plural}"
    if (quiet := missing_estimates_sentence(report)) is not None:
        yield quiet
