"""Base class of prepared models that are derived from a static model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Self

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.models.shared.prepared_model import BuiltModel, DeformedMesh
    from softmark.solvers.energies.energy import Floats
    from softmark.solvers.mesh.mesh import Mesh


class DerivedModel:
    """Prepared model with the mesh, the loads and the warnings of another model, `static`."""

    static: BuiltModel

    @property
    def size(self) -> Mapping[str, int]:
        """Numbers of nodes, elements and degrees of freedom, by name."""
        return self.static.size

    @property
    def notes(self) -> tuple[Diagnostic, ...]:
        """Warnings found while the static model was built."""
        return self.static.notes

    @property
    def mesh(self) -> Mesh | None:
        """Mesh of the body; None for a model without a mesh."""
        return self.static.mesh

    @property
    def assembly(self) -> Any:
        """Energies in terms of nodal displacements: None, because they differ at every time."""
        return None

    @property
    def points(self) -> Floats:
        """Undeformed points (n, 3), m, at which loads act."""
        return self.static.points

    def forces(self) -> Sequence[tuple[Declared, Floats]]:
        """Return each load at full size with its forces (n, 3), N, on the undeformed body."""
        return self.static.forces()

    def outside(self, X: Floats) -> float:
        """Return the largest distance, m, by which points X (n, 3), m, lie outside a mesh read from a file; else 0."""
        return self.static.outside(X)

    def warm(self) -> None:
        """Compile the code that the static model needs, before timing starts."""
        self.static.warm()

    def after(self, before: DeformedMesh) -> Self:
        """Return the model itself, because it is not a sequence of states."""
        return self
