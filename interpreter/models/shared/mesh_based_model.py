"""What a prepared model says that solves over the nodes of a mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.shared.load_setup import at_nodes
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.mesh.element_interpolation import locate
from softmark.solvers.mesh.mesh import Mesh

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.prepared_model import Moved
    from softmark.solvers.mesh.shape import Shape


class OnMesh:
    """A body's `shape`, its `mesh`, and every load that is `applied` by itself, at full size."""

    shape: Shape
    mesh: Mesh
    applied: tuple[tuple[Declared, Energy], ...]

    def after(self, before: Moved) -> Self:
        """It starts from rest."""
        return self

    @property
    def points(self) -> Floats:
        """Nodes (n, 3), m."""
        return self.mesh.points

    def forces(self) -> list[tuple[Declared, Floats]]:
        """Of every load by itself at the nodes (n, 3), N, at rest."""
        return [(load, at_nodes(energy, self.points)) for load, energy in self.applied]

    def outside(self, X: Floats) -> float:
        """How far, in m, the farthest of the points X (n, 3) lies outside a mesh that was read from a file."""
        return float(locate(self.mesh, X).outside.max(initial=0.0)) if self.shape.file else 0.0
