"""What models say of their own answers: the errors that they state, and that their forces were found again."""

from __future__ import annotations

from collections.abc import Iterator

from softmark.interpreter.report.quantities import quantity
from softmark.interpreter.results import ModelResult, Report


def words(model: ModelResult) -> str | None:
    """`states an error of at most 3 %`, of its first metric; None where it was not asked."""
    if not model.stated:
        return None
    first = next((n for n in model.metrics if n in model.stated), next(iter(model.stated)))
    said = model.stated[first]
    doubts = f" (and doubts it: {', '.join(said['doubts'])})" if said.get("doubts") else ""
    if said.get("value") is None:
        return f"states no error of `{first}`: {said.get('reason') or 'no reason was given'}{doubts}"
    return f"states an error of at most {amount(float(said['value']))} in `{first}`{doubts}"


def amount(value: float) -> str:
    """A relative error, at two digits."""
    shown: str = quantity(max(value, 1e-12), "1", 2, percent=True)
    return shown


def checked(report: Report) -> str | None:
    """One quiet line about the forces that were found again; None where there were none."""
    checks = (m.solve.get("checks") or {} for m in report.models.values())
    found = [c["residual"] for c in checks if c.get("residual") is not None]
    if not found:
        return None
    return (
        f"Forces of {len(found)} solution{'s' if len(found) > 1 else ''} were found again by other formulas than those "
        f"that solved: at most {max(found):.0e} of the loads is left over."
    )


def lines(report: Report) -> Iterator[str]:
    """What each model states."""
    for name, model in report.models.items():
        if (said := words(model)) is not None:
            yield f"{name} {said}"
