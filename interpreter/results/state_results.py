"""Results of a model or a reference in several states: one result for each state, and one that combines them.

The combined result has the values of the last state, the total time, and the status of the first failed state. Its
`states` are the values of the states, and `each` holds the result in each state. A metric over the states is a `Curve`:

    curve = report.models["finite"].curve("pull")
    curve.states, curve.values  # (0.05, 0.125), (1.2, 3.4); None where a state has no answer

`curve_of(results, states, name)` makes the same curve from the results of single states, while a run is in progress.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from softmark.records import dataclass

SOLVED = ("converged", "capped")  # solved by us, or by a program that we ran
ANSWERED = (*SOLVED, "read")
LEFT_OUT = ("skipped", "unsupported")  # not tried: neither failed nor solved


class TimeState(float):
    """Value of a state that is a point in time, s."""


@dataclass(frozen=True)
class Curve:
    """Values of a metric over the states, in its SI unit; None for a state without a value."""

    states: tuple[float, ...]
    values: tuple[float | None, ...]
    unit: str

    @property
    def known(self) -> tuple[tuple[float, float], ...]:
        """Pairs (state, value) of the states in which the metric has a value."""
        pairs = zip(self.states, self.values, strict=True)
        return tuple((state, value) for state, value in pairs if value is not None)


def curve_of(each: Sequence[Any], states: Sequence[float], name: str) -> Curve:
    """Return the values of a model's or reference's metric over the states. Raises KeyError if no state has it."""
    if not states:
        raise KeyError(f"there is no curve of `{name}`: the analysis has no states")
    found = [result.metrics.get(name) for result in each]
    unit = next((metric.unit for metric in found if metric is not None), None)
    if unit is None:
        raise KeyError(name)
    return Curve(tuple(states), tuple(None if metric is None else metric.value for metric in found), unit)


def join_states(each: Sequence[Any], states: Sequence[float]) -> Any:
    """Return the results of a model or reference in all states (at least one) combined into one result."""
    last, known = each[-1], {}
    for name, metric in last.metrics.items():
        known[name] = replace(metric, states=curve_of(each, states, name).values)
    more: dict[str, Any] = {"metrics": known, "states": tuple(states), "each": tuple(each)}
    if hasattr(last, "time"):
        more["solve"] = {**last.solve, **_collect_iterations(each)}
        more["time"] = {name: _sum_timings(name, each) for name in last.time | each[0].time}
    return replace(last, **more, **_combined_status(each, states))


def _combined_status(each: Sequence[Any], states: Sequence[float]) -> dict[str, Any]:
    """Return the status and the number of the first failed state, as fields of the combined result."""
    wrong = next((i for i, r in enumerate(each) if r.status not in ANSWERED), None)
    if wrong is None:
        capped = any(r.status == "capped" for r in each)
        return {"status": "capped"} if capped else {}
    if len({(r.status, r.message) for r in each}) == 1:  # for instance if a file cannot be read
        return {}
    before = f"; the {_format_state_count(wrong)} before it have solutions" if wrong > 1 else ""
    before = "; the state before it has a solution" if wrong == 1 else before
    left = len(each) - wrong - 1
    after = f"; {_format_state_count(left)} after it {'was' if left == 1 else 'were'} not tried" if left else ""
    told = f"in the state {format_state(states[wrong])}: {each[wrong].message}{before}{after}"
    return {"status": each[wrong].status, "message": told}


def _format_state_count(number: int) -> str:
    return "one state" if number == 1 else f"{number} states"


def format_state(value: float) -> str:
    """Return the value of a state as text: `12.5 %`, or `2.5 s` for a time."""
    return f"{value:.6g} s" if isinstance(value, TimeState) else f"{100.0 * value:.6g} %"


def _collect_iterations(each: Sequence[Any]) -> dict[str, int]:
    """Return the numbers of iterations over all states, by kind."""
    known = [r.solve["iterations"] for r in each if "iterations" in r.solve]
    return {"iterations": sum(known)} if known else {}


def _sum_timings(name: str, each: Sequence[Any]) -> Any:
    """Return the computing time summed over all states, for every repetition; None if a state has none."""
    times: list[Any] = [r.time.get(name) for r in each if r.status in ANSWERED]
    if not times or None in times:
        return None
    return replace(times[0], seconds=tuple(map(sum, zip(*(t.seconds for t in times), strict=True))))
