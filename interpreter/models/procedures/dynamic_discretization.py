"""Interface of the static models of all discretizations that a dynamic analysis integrates in time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Any, Protocol

from softmark.interpreter.models.shared.prepared_model import BuiltModel
from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.models.shared.prepared_model import DeformedMesh
    from softmark.solvers.dynamics.dynamic_problem import Dynamics
    from softmark.solvers.dynamics.integrator import Motion
    from softmark.solvers.model_reduction.reduction_error import ReductionError

DisplacementField = Callable[[Floats], Floats]  # material points (n, 3), m -> displacements, m


@dataclass(frozen=True)
class MotionFields:
    """Displacement fields of a dynamic analysis, and what the discretization adds to the solution.

    `history` returns the displacements (t, n, 3), m, of material points X (n, 3), m, at all stored times.
    `displacement` and `mesh` have the last state.
    """

    history: DisplacementField
    displacement: DisplacementField
    mesh: DeformedMesh | None = None
    reduction_error: Callable[[], ReductionError] | None = None
    facts: dict[str, Any] = field(default_factory=dict)  # of the report
    notes: tuple[Diagnostic, ...] = ()


class DynamicDiscretization(BuiltModel, Protocol):
    """Static model that a dynamic analysis can integrate in time."""

    @property
    def model_facts(self) -> Mapping[str, Any]:
        """Part of the report that describes the model and not its solution."""

    def stored_state(self, problem: Dynamics, motion: Motion) -> Floats:
        """Return the variables of a motion that are stored at a time."""

    def motion_fields(self, times: Floats, states: Floats) -> MotionFields:
        """Return the displacement fields of stored states (t, ...) at `times` (t,), s."""

    @property
    def mode_field(self) -> Callable[[Dynamics, Floats], DisplacementField] | None:
        """Function from a vibration mode (dofs,) to its field; None if modes do not determine time-step errors."""
