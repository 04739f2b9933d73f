"""A model made ready to solve, and what solving it gives: all that is asked of either stands here."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any, Literal, Protocol, Self

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.results.motion_history import History
from softmark.interpreter.results.reaction_results import AtRest
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.interpreter.language.compiled_scene import Declared, Scene
    from softmark.interpreter.models.postprocessing.contact_history_results import Followed
    from softmark.interpreter.models.postprocessing.nodal_forces import Carried
    from softmark.interpreter.models.shared.friction_history import Past
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.assembly.assembly import Assembly
    from softmark.solvers.contact.signed_distance.distance_function import Gap
    from softmark.solvers.contact.surface_points import Joined
    from softmark.solvers.dynamics.time_step_error import StepError
    from softmark.solvers.mesh.mesh import Mesh
    from softmark.solvers.model_reduction.reduction_error import ReductionError
    from softmark.solvers.statics.static_equilibrium import Watch
    from softmark.solvers.stress_recovery.stress_field import Stresses

    Floats = NDArray[np.float64]

# capped: computed as the scene asks, with steps that were accepted unsolved
Status = Literal["converged", "capped", "read", "not_converged", "diverged", "failed", "skipped", "unsupported"]


class Moved(Protocol):
    """A mesh and the displacements of its nodes: for files that other programs read, and for who looks at them again.

    `shared/deformed_mesh.py` has it ready made.
    """

    @property
    def mesh(self) -> Mesh:
        """The mesh itself."""

    @property
    def points(self) -> Floats:
        """Undeformed nodes (n, 3), m."""

    @property
    def cells(self) -> Any:
        """Nodes of each cell (m, a)."""

    @property
    def kind(self) -> str:
        """The element."""

    @property
    def displacement(self) -> Floats:
        """Of the nodes (n, 3), m."""

    @property
    def times(self) -> Floats | None:
        """Of a motion, some (t,), s."""

    @property
    def frames(self) -> Floats | None:
        """Displacements of the nodes at these times (t, n, 3), m."""

    @property
    def pressures(self) -> Floats | None:
        """Unknown ones (m, b), Pa, positive in tension: at four corners of each cell, or one in it."""

    @property
    def left(self) -> Floats | None:
        """The Newton step that would come next (n, 3), m, where it is known."""

    @property
    def rubbed(self) -> Past:
        """What friction remembers of the states so far, by contact."""

    @property
    def beside(self) -> Mapping[str, Gap]:
        """Rigid bodies where they are, by the name of the contact."""

    @property
    def stiffer(self) -> float:
        """How many times as stiff as they were begun with barriers before rigid bodies are."""

    @property
    def joined(self) -> Mapping[str, Joined]:
        """Points of the surface that are kept clear of rigid bodies besides those which always are, by contact."""


@dataclass(frozen=True)
class Spent:
    """What a solution took by another's clock, wall and CPU, s; `most` says that it is an upper bound of that."""

    wall_s: float
    cpu_s: float
    most: bool

    @property
    def basis(self) -> str:
        """By whose clock, in words."""
        return "of its whole process: an upper bound" if self.most else "by the program's own clock"


@dataclass(frozen=True)
class ModalErrors:
    """Error of the time step of a motion as a sum of vibration modes, and displacements of points in each mode."""

    modes: StepError
    shapes: tuple[Callable[[Floats], Floats], ...]

    def at(self, X: Floats, times: Floats) -> Floats:
        """Displacement error (t, n, 3), m, of material points X (n, 3), m, at `times` (t,), s."""
        import numpy as np

        found = np.zeros((len(times), *X.shape))
        for shape, error in zip(self.shapes, self.modes.error.T, strict=True):
            found += np.interp(times, self.modes.times, error)[:, None, None] * np.asarray(shape(X))
        return found


@dataclass(frozen=True)
class Solution:
    """What a model found: displacements of material points, or a message that says why there are none."""

    status: Status
    message: str | None
    facts: dict[str, Any]  # iterations, steps, residual, solver
    displacement: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None = None  # (n, 3) -> (n, 3), m
    notes: tuple[Diagnostic, ...] = ()
    history: History | None = None  # of a dynamic analysis; `displacement` is then that of its end
    mesh: Moved | None = None  # of a model that has one
    stress: Callable[[], Stresses] | None = (
        None  # of a model on a mesh (`postprocessing/mesh_stress.py`); it raises NoStress
    )
    carried: Callable[[], Carried] | None = None  # what acts at its nodes, of a state of rest; found when asked for
    followed: Followed | None = None  # of a motion with contacts: what these do
    at_rest: AtRest | None = None  # what that comes to: of solutions that an error is stated from
    spent: Spent | None = None  # of one that another program solved: our clock knows nothing of it
    reduction_error: Callable[[], ReductionError] | None = None  # of a reduced model, against the full equations
    step_errors: Callable[[], ModalErrors | None] | None = None  # of a motion, made when asked for: costs little
    vibrations: Callable[[int], Floats] | None = None  # the lowest frequencies, Hz, about a static equilibrium


class Prepared(Protocol):
    """A model built for a case. `Meshless` has what a model without a mesh says."""

    @property
    def size(self) -> Mapping[str, int]:
        """nodes, elements, dofs."""

    @property
    def notes(self) -> tuple[Diagnostic, ...]:
        """Warnings about what was built."""

    @property
    def mesh(self) -> Mesh | None:
        """What its supports and loads were found on; None of a model without a mesh."""

    @property
    def assembly(self) -> Assembly | None:
        """Energies and loads over the displacements of all nodes of the mesh; None where its unknowns are others."""

    @property
    def points(self) -> Floats:
        """Undeformed points that its loads act at (n, 3), m."""

    def forces(self) -> Sequence[tuple[Declared, Floats]]:
        """Of every load by itself at these points (n, 3), N, at rest."""

    def outside(self, X: Floats) -> float:
        """How far, in m, the farthest of the points X (n, 3) lies outside a mesh that was read from a file; or 0."""

    def warm(self) -> None:
        """Compile or load whatever the solution needs, outside the clock."""

    def after(self, before: Moved) -> Prepared:
        """The same, to start from what it has found in the state before; itself where it starts from rest."""

    def solve(self, watch: Watch) -> Solution:
        """Solve from rest, or from the state before; calling it again repeats the same work."""


class Meshless:
    """What a prepared model says that has no mesh."""

    @property
    def notes(self) -> tuple[Diagnostic, ...]:
        """None."""
        return ()

    @property
    def mesh(self) -> None:
        """None."""
        return

    @property
    def assembly(self) -> None:
        """None."""
        return

    def outside(self, X: Floats) -> float:
        """Shapes of our own are checked before."""
        return 0.0

    def after(self, before: Moved) -> Self:
        """It starts from rest."""
        return self

    def warm(self) -> None:
        """Nothing to compile."""


@dataclass
class Workshop:
    """Meshes that models of one run share, and the scene for a model that must know what it is judged by."""

    meshes: dict[tuple[Any, ...], Any] = field(default_factory=dict)
    seconds: dict[tuple[Any, ...], tuple[float, float]] = field(default_factory=dict)  # wall, CPU
    borrowed: tuple[float, float] = (0.0, 0.0)  # what the meshes cost that the present model found made
    scene: Scene | None = None
    build: Callable[[Declared, Case, Workshop], Prepared] | None = None  # another model: builders.build
    measured: Mapping[str, Any] = field(default_factory=dict)  # what references of measured data hold
