"""Displacement fields of a dynamic analysis."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.models.shared.prepared_model import DeformedMesh
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


def fields_of_each_time(each: Sequence[DisplacementField]) -> MotionFields:
    """Return the fields of a model without a mesh, from its displacement field at each time."""
    return MotionFields(lambda X: np.array([at_time(X) for at_time in each]), each[-1])
