"""Deformed mesh: displacement fields interpolated from nodal displacements, and mesh data for exported files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.models.procedures.dynamic_discretization import MotionFields
from softmark.interpreter.results.even_thinning import pick_evenly
from softmark.records import dataclass
from softmark.solvers.mesh.element_interpolation import locate_points
from softmark.solvers.mesh.mesh import Floats, Mesh

if TYPE_CHECKING:
    from softmark.solvers.contact.interaction_state import InteractionState

FRAMES = 40  # largest number of stored states for exported files


@dataclass(frozen=True)
class NodalDisplacementField:
    """Displacement field interpolated from nodal displacements.

    `nodes` (n, 3), m, are the displacements of the nodes of `mesh`.
    """

    mesh: Mesh
    nodes: Floats

    def __call__(self, X: Floats) -> Floats:
        """Return the displacements (n, 3), m, of material points X (n, 3), m."""
        return locate_points(self.mesh, X).interpolate(self.nodes)


def displacement_of(mesh: Mesh, u: Floats) -> NodalDisplacementField:
    """Return the displacement field that is interpolated from nodal displacements u (n, 3), m."""
    return NodalDisplacementField(mesh, u)


@dataclass(frozen=True)
class MeshData:
    """Points, cells and element of a mesh in the form that file writers need."""

    mesh: Mesh

    @property
    def points(self) -> Floats:
        """Undeformed nodes (n, 3), m."""
        return self.mesh.points

    @property
    def cells(self) -> Any:
        """Indices of the nodes of each cell (m, a)."""
        return self.mesh.cells

    @property
    def kind(self) -> str:
        """Name of the element type, such as `hex8`."""
        return self.mesh.kind


@dataclass(frozen=True)
class DeformedBody(MeshData):
    """Mesh with nodal displacements and, if known, its time history, pressures and interaction states."""

    displacement: Floats  # (n, 3) m
    times: Floats | None = None  # (t,) s
    frames: Floats | None = None  # (t, n, 3) m: displacements at these times
    pressures: Floats | None = None  # (m, b) Pa, positive in tension: at four corners of each cell, or one in it
    left: Floats | None = None  # (n, 3) m: displacements of the next Newton step, if known
    interactions: Mapping[str, InteractionState] = field(default_factory=dict)  # states of the contacts, by name


def fields_on_mesh(mesh: Mesh, times: Floats, u: Floats) -> MotionFields:
    """Return the fields of nodal displacements u (t, n, 3), m, at `times` (t,), s."""

    def history(X: Floats) -> Floats:
        """Return the displacements (t, n, 3), m, of material points X (n, 3), m, at all times."""
        place = locate_points(mesh, X)
        return np.array([place.interpolate(one) for one in u])

    some = pick_evenly(len(times), FRAMES)
    return MotionFields(history, displacement_of(mesh, u[-1]), DeformedBody(mesh, u[-1], times[some], u[some]))
