"""CPU times of the phases of a solution, measured by clocks that are added to solver functions at run time.

A clock that starts while another runs pauses the other, so that times are exclusive. Time outside all clocks is called
"other". Clocks take up to a tenth of the time of a small model, so a run with clocks never counts as a timing. To time
another function, add a line in FUNCTIONS with its dotted name. To time a method of every class of some modules, add a
line in METHODS.
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
    "softmark.solvers.dynamics.dynamic_forces.DynamicForces.inertia": "assembly",
    "softmark.solvers.dynamics.dynamic_forces.DynamicForces.value": "assembly",
    "softmark.solvers.dynamics.dynamic_forces.DynamicForces.strain": "assembly",
    "softmark.solvers.dynamics.dynamic_forces.DynamicForces.at": "assembly",
    "softmark.solvers.dynamics.dynamic_forces.DynamicForces.rounding": "assembly",
    "softmark.solvers.dynamics.dynamic_forces.DynamicForces.drag": "assembly",
    "softmark.solvers.dynamics.dynamic_forces.DynamicForces.tangent": "assembly",
    "softmark.solvers.dynamics.dynamic_forces.DynamicForces.add_mass": "assembly",
    "softmark.solvers.linear.factorisations.factor": "factorisation",
    "softmark.solvers.linear.symbolic_cache.cached_plan": "factorisation",
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
        "move": "assembly",  # update of a state, which for rods costs as much as their forces
    },
    "softmark.solvers.linear.factorisations": {"solve": "solution"},
    "softmark.solvers.linear.recycled_solves": {"solve": "solution"},
    "softmark.solvers.sparse": {"factorise": "factorisation", "solve": "solution"},
}


class PhaseClock:
    """Clock that measures the CPU time, s, of each phase of a solution, such as assembly, for every timed solution."""

    def __init__(self) -> None:
        self.solutions: list[dict[str, float]] = []
        self._spent: dict[str, float] = {}
        self._open: list[str] = []
        self._since = 0.0

    def around(self, solve: Callable[[], Result]) -> Result:
        """Run `solve` with clocks in all loaded modules, remove them afterwards, and return the result."""
        self._spent, self._open = {}, [OTHER]
        undo: list[tuple[Any, str, Any]] = []
        try:
            undo.extend(_install_clocks(self._with_clock))
            self._since = time.process_time()
            return solve()
        finally:
            self._add_elapsed_time()
            self.solutions.append(self._spent)
            for owner, name, original in undo:
                setattr(owner, name, original)

    def _add_elapsed_time(self) -> None:
        """Add the CPU time since the last call to the current phase."""
        now, name = time.process_time(), self._open[-1]
        self._spent[name] = self._spent.get(name, 0.0) + now - self._since
        self._since = now

    def _with_clock(self, function: Callable[..., Any], phase: str) -> Callable[..., Any]:
        @functools.wraps(function)
        def clocked(*args: Any, **kwargs: Any) -> Any:
            if self._open[-1] == phase:  # counted already
                return function(*args, **kwargs)
            self._add_elapsed_time()
            self._open.append(phase)
            try:
                return function(*args, **kwargs)
            finally:
                self._add_elapsed_time()
                self._open.pop()

        return clocked


def _install_clocks(
    clocked: Callable[[Callable[..., Any], str], Callable[..., Any]],
) -> Iterator[tuple[Any, str, Any]]:
    """Add clocks to all functions in FUNCTIONS and METHODS, wherever modules refer to them.

    Yield owner, name and original of each replaced function, so that it can be restored.
    """
    ours = [m for n, m in sorted(sys.modules.items()) if n.startswith("softmark.") and m is not None]
    for owner, name, phase in find_timed_functions():
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


def find_timed_functions() -> Iterator[tuple[Any, str, str]]:
    """Yield owner (class or module), name and phase of every function in FUNCTIONS and METHODS in loaded modules."""
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
    """Return the class or module that a dotted name belongs to (None if not loaded), and the last part of the name."""
    path, _, name = dotted.rpartition(".")
    if path in sys.modules:
        return sys.modules[path], name
    module, _, cls = path.rpartition(".")
    return getattr(sys.modules.get(module), cls, None), name


def _classes(prefix: str) -> Iterator[type]:
    """Yield the classes, except protocols, of a module or of the modules of a package."""
    for name, module in sorted(sys.modules.items()):
        if (name == prefix or name.startswith(prefix + ".")) and isinstance(module, ModuleType):
            for value in vars(module).values():
                if inspect.isclass(value) and not getattr(value, "_is_protocol", False):
                    yield value
