"""Tubes: hollow circular cylinders, for solid and beam models."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

from softmark.records import dataclass
from softmark.solvers.mesh.cell_counts import count_divisions
from softmark.solvers.mesh.conforming_planes import Cut, count_cells, cuts_along
from softmark.solvers.mesh.curved_boundary import CylinderSide, cylinders_of_cuts
from softmark.solvers.mesh.shape import CircularSection, Plane, RoundPrism, Vector3, place_mesh

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.mesh.mesh import Floats, Mesh
else:
    from softmark.solvers.runtime.lazy_modules import np


INSIDE_OUT = "`inner`, the radius of the cavity, must be less than `radius`"


@dataclass(frozen=True)
class Annulus(CircularSection):
    """A circular ring as cross-section, radii in m."""

    radius: float
    inner: float

    @property
    def area(self) -> float:
        """Area, m^2."""
        return math.pi * (self.radius - self.inner) * (self.radius + self.inner)

    @property
    def moments(self) -> tuple[float, float]:
        """Second moments of area about the two axes of the section, m^4."""
        both = self.area * (self.radius**2 + self.inner**2) / 4
        return both, both

    def shear_factor(self, poisson: float) -> float:
        """Return the shear correction factor of a ring, with the ratio m of the inner to the outer radius.

        It is 6 (1 + nu) (1 + m^2)^2 / ((7 + 6 nu) (1 + m^2)^2 + (20 + 12 nu) m^2).
        Source: Cowper (1966).
        """
        m2 = (self.inner / self.radius) ** 2
        return 6 * (1 + poisson) * (1 + m2) ** 2 / ((7 + 6 * poisson) * (1 + m2) ** 2 + (20 + 12 * poisson) * m2)

    def samples(self) -> list[tuple[float, float]]:
        """Sample points of the section, m: three rings."""
        turns = [2 * math.pi * i / 16 for i in range(16)]
        radii = (self.inner, 0.5 * (self.inner + self.radius), self.radius)
        return [(r * math.cos(t), r * math.sin(t)) for r in radii for t in turns]

    def contains(self, u: float, v: float, slack: float) -> bool:
        """Return whether a point of the section's plane lies inside, within `slack` (m)."""
        return self.inner - slack <= math.hypot(u, v) <= self.radius + slack

    def outside(self, u: Floats, v: Floats) -> Floats:
        """Return how far points (u, v) of the section's plane lie outside the section, shape (n,), m."""
        r = np.hypot(u, v)
        far: Floats = np.maximum(np.maximum(r - self.radius, self.inner - r), 0.0)
        return far

    @property
    def hole_radius(self) -> float:
        """Radius of the hole, m."""
        return self.inner

    def hole(self, around: int) -> Floats:
        """Return points of the inner border (around, 2), m, counter-clockwise."""
        circle: Floats = self.outline(around) * (self.inner / self.radius)
        return circle


@dataclass(frozen=True)
class Tube(RoundPrism):
    """A straight hollow circular cylinder, whose axis starts at `origin`.

    It is meshed with rings of hexahedra, or of tetrahedra made of them. The mesh is inscribed in both circles, so that
    a coarse mesh of linear elements has less volume (the report gives the difference). Beam models use a ring as
    section; their stated error includes the flattening of thin walls in bending (Brazier 1927).
    """

    has_signed_distance = True
    has_mass_properties = True

    length: Annotated[float, "m in (0, inf)", "length along the axis"]
    radius: Annotated[float, "m in (0, inf)", "outer radius"]
    inner: Annotated[float, "m in (0, inf)", "inner radius"]
    axis: Annotated[Vector3, "direction", "direction of the axis, from the end at `origin`"] = (1.0, 0.0, 0.0)
    origin: Annotated[Vector3, "m", "centre of the end where the axis starts"] = (0.0, 0.0, 0.0)

    @property
    def fault(self) -> str:
        """Return an error if the wall has no thickness; "" if valid."""
        return "" if self.inner < self.radius else INSIDE_OUT

    @property
    def section(self) -> Annulus:
        """The cross-section."""
        return Annulus(self.radius, self.inner)

    def cut_at_plane(self, plane: Plane) -> Cut | None:
        """Return the cut in the plane a x + b y + c z + d = 0, given by (a, b, c, d).

        Return None unless the plane contains the axis.
        """
        cut = super().cut_at_plane(plane)
        return None if cut is None or abs(cut.at) >= 1e-9 * self.radius else replace(cut, at=0.0)

    def counts(self, size: float, cuts: tuple[Cut, ...] = ()) -> tuple[int, ...]:
        """Return the numbers of cells for a cell `size` (m): around, across the wall and along the axis."""
        wall = count_cells(
            self.inner, self.radius, count_divisions(self.radius - self.inner, size), cuts_along(cuts, "radius")
        )
        return (
            count_cells_around(self.radius, size),
            wall,
            count_cells(0.0, self.length, count_divisions(self.length, size), cuts_along(cuts, "along")),
        )

    def mesh(self, kind: str, size: float, cuts: tuple[Cut, ...] = ()) -> Mesh:
        """Return a mesh of an element with edges of about `size` (m), nodes on cuts. Raises UnknownElement."""
        from softmark.solvers.mesh.structured_meshes import mesh_extrusion, mesh_ring, project_midside_nodes

        section = mesh_ring(self.inner, self.radius, count_cells_around(self.radius, size), size, cuts)
        mesh = place_mesh(mesh_extrusion(section, self.length, size, kind, cuts), self.axis, self.origin)
        return project_midside_nodes(mesh, self.sides, cylinders_of_cuts(self, cuts))

    @property
    def sides(self) -> tuple[CylinderSide, ...]:
        """Outer and inner curved side."""
        return tuple(CylinderSide(self.axis, self.origin, self.length, r) for r in (self.radius, self.inner))


def count_cells_around(radius: float, size: float) -> int:
    """Return the number of cells around a circle of a `radius` (m): a multiple of eight."""
    return 8 * count_divisions(math.pi * radius / 4, size)
