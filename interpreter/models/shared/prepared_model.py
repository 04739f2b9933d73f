"""Interfaces of a prepared model, that is a model built for a case and ready to solve, and of its solution."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any, Literal, Protocol, Self

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.results.motion_history import History
from softmark.interpreter.results.reaction_results import EquilibriumForces
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.interpreter.language.compiled_scene import Declared, Scene
    from softmark.interpreter.models.postprocessing.contact_history_results import ContactHistoryResults
    from softmark.interpreter.models.postprocessing.nodal_forces import NodalForces
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.assembly.assembly import Assembly
    from softmark.solvers.contact.interaction_state import InteractionState
    from softmark.solvers.dynamics.time_step_error import StepError
    from softmark.solvers.mesh.mesh import Mesh
    from softmark.solvers.model_reduction.reduction_error import ReductionError
    from softmark.solvers.statics.static_equilibrium import Watch
    from softmark.solvers.stress_recovery.stress_field import Stresses

    Floats = NDArray[np.float64]

# capped: computed as the scene requests, with steps that were accepted before they converged
Status = Literal["converged", "capped", "read", "not_converged", "diverged", "failed", "skipped", "unsupported"]


class DeformedMesh(Protocol):
    """Interface of a mesh with nodal displacements and interaction states, for exported files and for the next state.

    `shared/deformed_mesh.py: DeformedBody` implements it.
    """

    @property
    def mesh(self) -> Mesh:
        """Undeformed mesh."""

    @property
    def points(self) -> Floats:
        """Undeformed nodes (n, 3), m."""

    @property
    def cells(self) -> Any:
        """Indices of the nodes of each cell (m, a)."""

    @property
    def kind(self) -> str:
        """Name of the element type, such as `hex8`."""

    @property
    def displacement(self) -> Floats:
        """Nodal displacements (n, 3), m."""

    @property
    def times(self) -> Floats | None:
        """Times (t,), s, of the stored states of a dynamic analysis; None for a static analysis."""

    @property
    def frames(self) -> Floats | None:
        """Nodal displacements (t, n, 3), m, at the stored times; None for a static analysis."""

    @property
    def pressures(self) -> Floats | None:
        """Pressures of mixed elements (m, b), Pa, positive in tension: at four corners of a cell, or one per cell."""

    @property
    def left(self) -> Floats | None:
        """Nodal displacements (n, 3), m, of the next Newton step, if known."""

    @property
    def interactions(self) -> Mapping[str, InteractionState]:
        """States of the contacts that the next state continues from, by name."""


@dataclass(frozen=True)
class ElapsedTime:
    """Wall and CPU time, s, that an external program took for its solution; upper bounds if `most` is true."""

    wall_s: float
    cpu_s: float
    most: bool

    @property
    def basis(self) -> str:
        """Description of how the time was measured."""
        return "of the whole process, an upper bound" if self.most else "measured by the program itself"


@dataclass(frozen=True)
class ModalErrors:
    """Time-step error of a dynamic analysis, as a sum over vibration modes with the displacement field of each mode."""

    modes: StepError
    shapes: tuple[Callable[[Floats], Floats], ...]

    def at(self, X: Floats, times: Floats) -> Floats:
        """Return the displacement errors (t, n, 3), m, of material points X (n, 3), m, at `times` (t,), s."""
        import numpy as np

        found = np.zeros((len(times), *X.shape))
        for shape, error in zip(self.shapes, self.modes.error.T, strict=True):
            found += np.interp(times, self.modes.times, error)[:, None, None] * np.asarray(shape(X))
        return found


@dataclass(frozen=True)
class Solution:
    """Solution of a model: a displacement field and its report, or the reason why there is none."""

    status: Status
    message: str | None
    facts: dict[str, Any]  # iterations, steps, residual, solver
    displacement: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None = None  # (n, 3) -> (n, 3), m
    notes: tuple[Diagnostic, ...] = ()
    history: History | None = None  # of a dynamic analysis, whose `displacement` is that at the end
    mesh: DeformedMesh | None = None  # None for a model without a mesh
    stress: Callable[[], Stresses] | None = (
        None  # of a model on a mesh (`postprocessing/mesh_stress.py`); raises StressUnavailable
    )
    carried: Callable[[], NodalForces] | None = None  # nodal forces of a static state, computed on first use
    followed: ContactHistoryResults | None = None  # contact history of a motion with contacts
    at_rest: EquilibriumForces | None = None  # forces and energies, if computed already for an error estimate
    spent: ElapsedTime | None = None  # time that an external program took
    reduction_error: Callable[[], ReductionError] | None = None  # error of a reduced model in the full equations
    step_errors: Callable[[], ModalErrors | None] | None = None  # time-step error of a motion, computed on first use
    vibrations: Callable[[int], Floats] | None = None  # the lowest frequencies, Hz, about a static equilibrium


class BuiltModel(Protocol):
    """Interface of a model built for a case: its mesh, its loads and the warnings."""

    @property
    def size(self) -> Mapping[str, int]:
        """Numbers of nodes, elements and degrees of freedom, by name."""

    @property
    def notes(self) -> tuple[Diagnostic, ...]:
        """Warnings found while the model was built."""

    @property
    def mesh(self) -> Mesh | None:
        """Mesh of the body, on which supports and loads were evaluated; None for a model without a mesh."""

    @property
    def assembly(self) -> Assembly | None:
        """Energies and loads in terms of nodal displacements; None if the model has other unknowns."""

    @property
    def points(self) -> Floats:
        """Undeformed points (n, 3), m, at which loads act."""

    def forces(self) -> Sequence[tuple[Declared, Floats]]:
        """Return each load with its forces (n, 3), N, at `points`, on the undeformed body."""

    def outside(self, X: Floats) -> float:
        """Return the largest distance, m, by which points X (n, 3), m, lie outside a mesh read from a file; else 0."""

    def warm(self) -> None:
        """Compile or load the code that the solution needs, before timing starts."""


class Prepared(BuiltModel, Protocol):
    """Interface of a built model that is ready to solve; `Meshless` has defaults for a model without a mesh."""

    def after(self, before: DeformedMesh) -> Prepared:
        """Return the model with the previous state as its start; the model itself if it always starts from rest."""

    def solve(self, watch: Watch) -> Solution:
        """Return the solution, starting from rest or from the previous state. Repeated calls repeat the same work."""


class Meshless:
    """Defaults of a prepared model without a mesh."""

    @property
    def notes(self) -> tuple[Diagnostic, ...]:
        """Warnings found while the model was built: none."""
        return ()

    @property
    def mesh(self) -> None:
        """Mesh of the body: None."""
        return

    @property
    def assembly(self) -> None:
        """Energies in terms of nodal displacements: None."""
        return

    @property
    def model_facts(self) -> dict[str, Any]:
        """Part of the report that describes the model: empty."""
        return {}

    def outside(self, X: Floats) -> float:
        """Return 0, because validation has checked the points against the declared shape."""
        return 0.0

    def after(self, before: DeformedMesh) -> Self:
        """Return the model itself, because it always starts from rest."""
        return self

    def warm(self) -> None:
        """Do nothing: there is nothing to compile."""


@dataclass
class BuildContext:
    """Resources for building models of one run: shared meshes, and the scene with the metrics that assess a model."""

    meshes: dict[tuple[Any, ...], Any] = field(default_factory=dict)
    seconds: dict[tuple[Any, ...], tuple[float, float]] = field(default_factory=dict)  # wall and CPU, s
    borrowed: tuple[float, float] = (0.0, 0.0)  # wall and CPU time, s, of meshes that other models had made already
    scene: Scene | None = None
    build: Callable[[Declared, Case, BuildContext], Prepared] | None = None  # builds another model
    measured: Mapping[str, Any] = field(default_factory=dict)  # data of measured references, by name
