"""Base class of prepared models whose unknowns are displacements of mesh nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.shared.deformed_mesh import NodalDisplacementField, fields_on_mesh
from softmark.interpreter.models.shared.load_setup import nodal_forces_at_rest
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.mesh.element_interpolation import locate_points
from softmark.solvers.mesh.mesh import Mesh

if TYPE_CHECKING:
    from softmark.interpreter.models.procedures.dynamic_discretization import MotionFields
    from softmark.solvers.dynamics.dynamic_problem import Dynamics
    from softmark.solvers.dynamics.integrator import Motion
    from softmark.solvers.mesh.shape import Shape


class MeshBasedModel:
    """Prepared model on a mesh: the `shape` of the body, its `mesh`, and the loads `applied`.

    `applied` has each load separately, at full size.
    """

    shape: Shape
    mesh: Mesh
    applied: tuple[tuple[Declared, Energy], ...]

    @property
    def model_facts(self) -> dict[str, Any]:
        """Part of the report that describes the model: empty."""
        return {}

    @property
    def points(self) -> Floats:
        """Nodes (n, 3), m."""
        return self.mesh.points

    def forces(self) -> list[tuple[Declared, Floats]]:
        """Return each load with its nodal forces (n, 3), N, on the undeformed body."""
        return [(load, nodal_forces_at_rest(energy, self.points)) for load, energy in self.applied]

    def outside(self, X: Floats) -> float:
        """Return the largest distance, m, by which points X (n, 3), m, lie outside a mesh read from a file; else 0."""
        return float(locate_points(self.mesh, X).outside.max(initial=0.0)) if self.shape.file else 0.0

    def stored_state(self, problem: Dynamics, motion: Motion) -> Floats:
        """Return the nodal displacements (3 n,), m, of a motion."""
        return motion.x.copy()

    def motion_fields(self, times: Floats, states: Floats) -> MotionFields:
        """Return the displacement fields of nodal displacements (t, 3 n), m, at `times` (t,), s."""
        return fields_on_mesh(self.mesh, times, states.reshape(len(states), -1, 3))

    def mode_field(self, problem: Dynamics, shape: Floats) -> NodalDisplacementField:
        """Return the displacement field of a vibration mode `shape` (3 n,)."""
        return NodalDisplacementField(self.mesh, shape.reshape(-1, 3))
