"""Interface of the static models of all discretizations that a dynamic analysis integrates in time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol

from softmark.interpreter.models.shared.prepared_model import BuiltModel

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.motion_fields import DisplacementField, MotionFields
    from softmark.solvers.dynamics.dynamic_problem import Dynamics
    from softmark.solvers.dynamics.integrator import Motion
    from softmark.solvers.energies.energy import Floats


class DynamicDiscretization(BuiltModel, Protocol):
    """Static model that a dynamic analysis can integrate in time; `DynamicDefaults` has the usual answers."""

    @property
    def model_facts(self) -> Mapping[str, Any]:
        """Part of the report that describes the model and not its solution."""

    @property
    def has_vibration_modes(self) -> bool:
        """True if vibration modes determine the error of a time step."""

    def stored_state(self, problem: Dynamics, motion: Motion) -> Floats:
        """Return the variables of a motion that are stored at a time."""

    def motion_fields(self, times: Floats, states: Floats) -> MotionFields:
        """Return the displacement fields of stored states (t, ...) at `times` (t,), s."""

    def mode_field(self, problem: Dynamics, shape: Floats) -> DisplacementField:
        """Return the displacement field of a vibration mode `shape` (dofs,)."""


class DynamicDefaults:
    """Answers of most static models."""

    @property
    def model_facts(self) -> Mapping[str, Any]:
        """Nothing: all results depend on the solution."""
        return {}

    @property
    def has_vibration_modes(self) -> bool:
        """True: vibration modes determine the error of a time step."""
        return True
