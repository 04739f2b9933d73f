"""What is known of a model or a reference in several states: a result of each, and one of all.

The one of all is that of the last state, with the time of all and the status of the first state without an answer; its
`states` are the values of the states and `each` the result in each. A number over states is a `Curve`, of every metric:

    curve = report.models["finite"].curve("pull")
    curve.states, curve.values  # (0.05, 0.125), (1.2, 3.4); None where a state has no answer

`curve_of(results, states, name)` makes the same of the results of single states, while a run is under way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from softmark.records import dataclass

SOLVED = ("converged", "capped")  # here: by us, or by a program that we ran
ANSWERED = (*SOLVED, "read")
LEFT_OUT = ("skipped", "unsupported")  # nothing was tried: no failure, and no answer


class Moment(float):
    """The value of a state that is a time, s."""


@dataclass(frozen=True)
class Curve:
    """A metric from state to state: values in its unit (SI), None in a state of which there is no number."""

    states: tuple[float, ...]
    values: tuple[float | None, ...]
    unit: str

    @property
    def known(self) -> tuple[tuple[float, float], ...]:
        """(state, value) where there is one."""
        pairs = zip(self.states, self.values, strict=True)
        return tuple((state, value) for state, value in pairs if value is not None)


def curve_of(each: Sequence[Any], states: Sequence[float], name: str) -> Curve:
    """A metric of the results of a model, or of a reference, in each state. Raises KeyError where none has it."""
    if not states:
        raise KeyError(f"there is no curve of `{name}`: the analysis has no states")
    found = [result.metrics.get(name) for result in each]
    unit = next((metric.unit for metric in found if metric is not None), None)
    if unit is None:
        raise KeyError(name)
    return Curve(tuple(states), tuple(None if metric is None else metric.value for metric in found), unit)


def joined(each: Sequence[Any], states: Sequence[float]) -> Any:
    """One result, of a model or a reference, of those in each state (k > 0)."""
    last, known = each[-1], {}
    for name, metric in last.metrics.items():
        known[name] = replace(metric, states=curve_of(each, states, name).values)
    more: dict[str, Any] = {"metrics": known, "states": tuple(states), "each": tuple(each)}
    if hasattr(last, "time"):
        more["solve"] = {**last.solve, **_counted(each)}
        more["time"] = {name: _summed(name, each) for name in last.time | each[0].time}
    return replace(last, **more, **_ended(each, states))


def _ended(each: Sequence[Any], states: Sequence[float]) -> dict[str, Any]:
    """The status of the first state without an answer, and which it is."""
    wrong = next((i for i, r in enumerate(each) if r.status not in ANSWERED), None)
    if wrong is None:
        capped = any(r.status == "capped" for r in each)
        return {"status": "capped"} if capped else {}
    if len({(r.status, r.message) for r in each}) == 1:  # as of a file that cannot be read
        return {}
    before = f"; the {_count(wrong)} before it have answers" if wrong > 1 else ""
    before = "; the state before it has an answer" if wrong == 1 else before
    left = len(each) - wrong - 1
    after = f"; {_count(left)} after it {'was' if left == 1 else 'were'} not tried" if left else ""
    told = f"in the state {percent(states[wrong])}: {each[wrong].message}{before}{after}"
    return {"status": each[wrong].status, "message": told}


def _count(number: int) -> str:
    return "one state" if number == 1 else f"{number} states"


def percent(value: float) -> str:
    """`12.5 %`, or of a time `2.5 s`: the value of a state, in words."""
    return f"{value:.6g} s" if isinstance(value, Moment) else f"{100.0 * value:.6g} %"


def _counted(each: Sequence[Any]) -> dict[str, int]:
    """Iterations of all states."""
    known = [r.solve["iterations"] for r in each if "iterations" in r.solve]
    return {"iterations": sum(known)} if known else {}


def _summed(name: str, each: Sequence[Any]) -> Any:
    """Seconds over all states, of every repetition; None where one has none."""
    times: list[Any] = [r.time.get(name) for r in each if r.status in ANSWERED]
    if not times or None in times:
        return None
    return replace(times[0], seconds=tuple(map(sum, zip(*(t.seconds for t in times), strict=True))))
