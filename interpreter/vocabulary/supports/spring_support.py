"""Base class of supports by springs, and the operations by which they act on the surface of a solid."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from softmark.interpreter.vocabulary.supports.support import OFF_NODES, Support

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.vocabulary.supports.support import Floats
else:
    from softmark.solvers.runtime.lazy_modules import np

Result = TypeVar("Result", covariant=True)


class Springs(Protocol[Result]):
    """Operations by which springs act on the surface of a solid mesh.

    For the solver they return energies (models/shared/foundation_setup.py). For verification they return nodal forces
    (n, 3), N, and their uncertainty, N, by other formulas (verification/foundation_forces.py).
    """

    def distributed_springs(self, where: Any, stiffness: float, damping: float, normal: bool) -> Result:
        """Return springs, Pa/m, and dashpots, Pa s/m, per undeformed area; with `normal` only along the normal."""

    def plane_keeping_springs(self, where: Any) -> Result:
        """Return stiff springs that keep the selected plane face parallel to itself."""


class SpringSupport(Support):
    """Support by springs on a part of the surface; it prescribes no displacement."""

    role = "springs"
    export_fault = OFF_NODES
    components = ()

    where: Any

    def springs(self, surface: Springs[Result]) -> Result:
        """Return the springs on the surface of a solid, made by the operations of `surface`."""
        raise NotImplementedError(f"{type(self).__name__} has no springs")  # each kind overrides it

    def resisted_motions(self, X: Floats, normal: Floats) -> Floats:
        """Return how the springs at points X (p, 3), m, with unit normals (p, 3), restrict rigid motions (p, r, 6).

        Each row gives a displacement in terms of three translations and three rotations about the origin.
        """
        raise NotImplementedError(f"{type(self).__name__} resists no motion")  # each kind overrides it


def rigid_motions_along(X: Floats, directions: Floats) -> Floats:
    """Return the displacements of points X (p, 3), m, along `directions` (p, r, 3) in six unit rigid motions (p, r, 6).

    The motions are three translations followed by three rotations about the origin.
    """
    return np.concatenate([directions, np.cross(X[:, None], directions)], axis=2)
