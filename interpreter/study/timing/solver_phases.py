"""Where the time of a solution goes: functions of the solvers with a clock around them, put there from outside.

A clock that is entered while another runs stops the other (exclusive time); what no clock counts is "other". Clocks
cost time themselves, up to a tenth of a solution of a small model, so a run with clocks is never one that counts.
To have a function counted: a line in FUNCTIONS, by its dotted name; a method that every class of some modules has:
a line in METHODS.
"""

from __future__ import annotations

import functools
import inspect
import sys
import time
from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any, TypeVar

Result = TypeVar("Result")

OTHER = "other"

FUNCTIONS: dict[str, str] = {
    "softmark.solvers.assembly.assembly.Assembly.value": "assembly",
    "softmark.solvers.assembly.assembly.Assembly.gradient": "assembly",
    "softmark.solvers.assembly.assembly.Assembly.rounding": "assembly",
    "softmark.solvers.assembly.assembly.Assembly.tangent": "assembly",
    "softmark.solvers.dynamics.dynamic_forces.Forces.inertia": "assembly",
    "softmark.solvers.dynamics.dynamic_forces.Forces.value": "assembly",
    "softmark.solvers.dynamics.dynamic_forces.Forces.strain": "assembly",
    "softmark.solvers.dynamics.dynamic_forces.Forces.at": "assembly",
    "softmark.solvers.dynamics.dynamic_forces.Forces.rounding": "assembly",
    "softmark.solvers.dynamics.dynamic_forces.Forces.drag": "assembly",
    "softmark.solvers.dynamics.dynamic_forces.Forces.tangent": "assembly",
    "softmark.solvers.dynamics.dynamic_forces.Forces.add_mass": "assembly",
    "softmark.solvers.linear.factorisations.factor": "factorisation",
    "softmark.solvers.linear.symbolic_cache.plan_of": "factorisation",
}

# methods that every class of a module, or of the modules of a package, may have
METHODS: dict[str, dict[str, str]] = {
    "softmark.solvers.energies": {
        "F": "assembly",
        "value": "assembly",
        "add_gradient": "assembly",
        "add_hessian": "assembly",
        "add_both_lagged": "assembly",
        "add_gradient_kept": "assembly",
        "rounding": "assembly",
        "move": "assembly",  # of a state: for rods, which turn, as costly as their forces
    },
    "softmark.solvers.linear.factorisations": {"solve": "solution"},
    "softmark.solvers.linear.recycled_solves": {"solve": "solution"},
    "softmark.solvers.sparse": {"factorise": "factorisation", "solve": "solution"},
}


class Phases:
    """CPU seconds of each solution by phases."""

    def __init__(self) -> None:
        self.solutions: list[dict[str, float]] = []
        self._spent: dict[str, float] = {}
        self._open: list[str] = []
        self._since = 0.0

    def around(self, solve: Callable[[], Result]) -> Result:
        """Run `solve` with clocks in all modules that are loaded; afterwards everything is as it was."""
        self._spent, self._open = {}, [OTHER]
        undo: list[tuple[Any, str, Any]] = []
        try:
            undo.extend(_replaced(self._clocked))
            self._since = time.process_time()
            return solve()
        finally:
            self._turn()
            self.solutions.append(self._spent)
            for owner, name, original in undo:
                setattr(owner, name, original)

    def _turn(self) -> None:
        """Book the time since the last turn."""
        now, name = time.process_time(), self._open[-1]
        self._spent[name] = self._spent.get(name, 0.0) + now - self._since
        self._since = now

    def _clocked(self, function: Callable[..., Any], phase: str) -> Callable[..., Any]:
        @functools.wraps(function)
        def clocked(*args: Any, **kwargs: Any) -> Any:
            if self._open[-1] == phase:  # counted already
                return function(*args, **kwargs)
            self._turn()
            self._open.append(phase)
            try:
                return function(*args, **kwargs)
            finally:
                self._turn()
                self._open.pop()

        return clocked


def _replaced(
    clocked: Callable[[Callable[..., Any], str], Callable[..., Any]],
) -> Iterator[tuple[Any, str, Any]]:
    """Put clocks around what the tables name, wherever it is bound; owner, name and original of each place."""
    ours = [m for n, m in sorted(sys.modules.items()) if n.startswith("softmark.") and m is not None]
    for owner, name, phase in places():
        original = vars(owner)[name]
        replacement = clocked(original, phase)
        if inspect.isclass(owner):
            setattr(owner, name, replacement)
            yield owner, name, original
            continue
        for module in ours:  # a function may have been imported by name
            for bound in [n for n, v in vars(module).items() if v is original]:
                setattr(module, bound, replacement)
                yield module, bound, original


def places() -> Iterator[tuple[Any, str, str]]:
    """Owner (class or module), name and phase of everything that the tables name, in modules that are loaded."""
    for dotted, phase in FUNCTIONS.items():
        owner, name = owner_of(dotted)
        if owner is not None:
            yield owner, name, phase
    for prefix, methods in METHODS.items():
        for cls in dict.fromkeys(_classes(prefix)):
            for name, phase in methods.items():
                if inspect.isfunction(vars(cls).get(name)):
                    yield cls, name, phase


def owner_of(dotted: str) -> tuple[Any, str]:
    """The class or module that holds what a dotted name means, and its last part; no owner if it is not loaded."""
    path, _, name = dotted.rpartition(".")
    if path in sys.modules:
        return sys.modules[path], name
    module, _, cls = path.rpartition(".")
    return getattr(sys.modules.get(module), cls, None), name


def _classes(prefix: str) -> Iterator[type]:
    """Classes of a module or of the modules of a package, protocols left out."""
    for name, module in sorted(sys.modules.items()):
        if (name == prefix or name.startswith(prefix + ".")) and isinstance(module, ModuleType):
            for value in vars(module).values():
                if inspect.isclass(value) and not getattr(value, "_is_protocol", False):
                    yield value
