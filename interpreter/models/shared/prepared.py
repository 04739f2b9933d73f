"""A model made ready to solve, and what solving it gives."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Any, Literal, Protocol

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.results.history import History
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.interpreter.language.scene import Declared, Scene
    from softmark.interpreter.problem.case import Case
    from softmark.solvers.statics.equilibrium import Watch

# capped: computed as the scene asks, with steps that were accepted unsolved
Status = Literal["converged", "capped", "not_converged", "diverged", "failed", "skipped"]


@dataclass(frozen=True)
class Solution:
    """What a model found: displacements of material points, or a message that says why there are none."""

    status: Status
    message: str | None
    facts: dict[str, Any]  # iterations, steps, residual, solver
    displacement: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None = None  # (n, 3) -> (n, 3), m
    notes: tuple[Diagnostic, ...] = ()
    history: History | None = None  # of a dynamic analysis; `displacement` is then that of its end
    mesh: Any = None  # points, cells, kind and nodal displacements, for files that other programs read


class Prepared(Protocol):
    """A model built for a case."""

    @property
    def size(self) -> dict[str, int]:
        """nodes, elements, dofs."""

    @property
    def notes(self) -> tuple[Diagnostic, ...]:
        """Warnings about what was built."""

    def warm(self) -> None:
        """Compile or load whatever the solution needs, outside the clock."""

    def solve(self, watch: Watch) -> Solution:
        """Solve from rest; calling it again repeats the same work."""


class Model(Protocol):
    """A model as a scene declares it."""

    def doubts(self, declared: Declared, case: Case) -> list[Diagnostic]:
        """Errors and warnings that need no arrays."""

    def outline(self, case: Case) -> str:
        """What will be built, on one line."""


@dataclass
class Workshop:
    """Meshes that models of one run share, and the scene for a model that must know what it is judged by."""

    meshes: dict[tuple[Any, ...], Any] = field(default_factory=dict)
    seconds: dict[tuple[Any, ...], tuple[float, float]] = field(default_factory=dict)  # wall, CPU
    borrowed: tuple[float, float] = (0.0, 0.0)  # what the meshes cost that the present model found made
    scene: Scene | None = None
    build: Callable[[Declared, Case, Workshop], Prepared] | None = None  # another model: builders.build
    measured: Mapping[str, Any] = field(default_factory=dict)  # what references of measured data hold
