"""Elastic solid: a mesh, a material, and a strain measure."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import MISSING, fields
from functools import cached_property
from typing import Any, Literal, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from softmark.ranges import Range
from softmark.records import dataclass
from softmark.solvers.assembly.elastic_energy_factory import elastic_energy
from softmark.solvers.dynamics.mass_matrices import consistent_mass, lumped_mass, mass_shapes_and_volumes
from softmark.solvers.elements import ELEMENTS
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.materials import MATERIALS, STRAINS, Isotropic, law_for
from softmark.solvers.mesh.element_interpolation import IntegrationPoints, integrate_cells, locate_points
from softmark.solvers.mesh.mesh import Mesh, jacobians

Where = Callable[[Floats], NDArray[np.bool_]]  # returns the mask (n,) of the selected points (n, 3), m


def material(name: str, **constants: Any) -> Isotropic:
    """Return the material that MATERIALS lists under this name, with the given constants in SI units.

    The constants are `young`, `poisson` and `density`, or those that the law itself has. Of alternative constants, such
    as `poisson` and `bulk`, give one. Lists of constants are tuples. Raises ValueError for an unknown name or constant,
    a missing constant, and a value out of its range.
    """
    if name not in MATERIALS:
        raise ValueError(f"unknown material {name!r}; available: {', '.join(MATERIALS)}")
    cls = MATERIALS[name]
    known = {f.name for f in fields(cls) if f.init}
    needed = {f.name for f in fields(cls) if f.init and f.default is MISSING}
    wrong = (constants.keys() - known) | (needed - constants.keys())
    for both in getattr(cls, "either", ()):
        if len(constants.keys() & set(both)) != 1:
            wrong |= set(both)
    if wrong:
        raise ValueError(f"{name} has the constants {', '.join(sorted(known))}; check {', '.join(sorted(wrong))}")
    hints = get_type_hints(cls, include_extras=True)
    for constant, value in constants.items():
        _require_in_range(constant, value, hints[constant])
    return cls(**constants)


def _require_in_range(constant: str, value: Any, hint: Any) -> None:
    """Raise ValueError if the value of a constant is outside the range that its type annotation `hint` gives."""
    kind, *said = get_args(hint)
    if get_origin(kind) is Literal:
        if value not in get_args(kind):
            raise ValueError(f"{constant} = {value!r} is not one of {', '.join(get_args(kind))}")
        return
    unit, meaning = said
    range = Range.read(unit)
    for one in value if isinstance(value, tuple) else (value,):
        if not (math.isfinite(one) if range is None else one in range):
            raise ValueError(f"{constant} = {one} is outside the range {unit} ({meaning})")


@dataclass(frozen=True)
class Solid:
    """An elastic solid: a mesh with a material and a strain measure.

    `strain` is `finite` (the material law for finite strain), `corotational` or `small` (both with the elastic moduli
    at zero strain). Cells have displacement unknowns only. Linear cells (`tet4`, `hex8`) lock near a Poisson's ratio of
    0.5 and are then too stiff; quadratic cells lock only closer to 0.5. `hex8` with `integration` `selective`, which
    computes the volume change from the mean gradient of a cell, does not lock. Raises ValueError for an invalid mesh,
    an unknown strain or integration, and an incompressible material. Raises NoFiniteLaw for a material without a law of
    finite strain.
    """

    mesh: Mesh
    material: Isotropic
    strain: Literal["small", "corotational", "finite"] = "finite"
    integration: Literal["full", "selective"] = "full"

    def __post_init__(self) -> None:
        if self.strain not in STRAINS:
            raise ValueError(f"unknown strain {self.strain!r}; available: {', '.join(STRAINS)}")
        if self.integration not in ("full", "selective"):
            raise ValueError(f"integration must be full or selective, not {self.integration!r}")
        fit = [name for name, element in ELEMENTS.items() if self.integration in element.integrations]
        if self.mesh.element.name not in fit:
            raise ValueError(f"selective integration is available only for {', '.join(fit)}, not for {self.mesh.kind}")
        if self.material.incompressible:
            raise ValueError(
                "a Poisson's ratio of 0.5 has an infinite bulk modulus, but displacement elements need a smaller one"
            )
        _require_valid_mesh(self.mesh)
        law_for(self.material, self.strain)

    @property
    def points(self) -> Floats:
        """Nodes of the undeformed mesh (n, 3), m."""
        return self.mesh.points

    def nodes(self, where: Where) -> Ints:
        """Return the numbers (k,) of the nodes that `where` selects. Raises ValueError if it selects none."""
        found = np.flatnonzero(_select_points(where, self.points))
        if not len(found):
            raise ValueError(f"no node is selected; {self._spans}")
        return found

    def facets(self, where: Where) -> Ints:
        """Return the boundary facets (f, k) all of whose nodes are selected by `where`, with normals outward.

        Facets are selected whole, so the mesh should have edges along the border of the selection. Raises ValueError if
        there is no such facet.
        """
        facets = self.mesh.facets
        found: Ints = facets[_select_points(where, self.points)[facets].all(axis=1)]
        if not len(found):
            raise ValueError(f"no facet of the boundary is selected; {self._spans}")
        return found

    def at(self, X: Any, values: Floats, beyond: float = 0.0) -> Floats:
        """Return nodal values (n, 3) interpolated at points X (p, 3), m, of the undeformed body, shape (p, 3).

        Raises ValueError for a point that lies more than `beyond`, m, outside the mesh. Points on a curved surface may
        lie slightly outside, because the facets are inscribed in it.
        """
        place = locate_points(self.mesh, np.array(X, dtype=np.float64).reshape(-1, 3))
        if (farthest := float(place.outside.max(initial=0.0))) > beyond:
            raise ValueError(f"a point lies {farthest:.3g} m outside the mesh; {self._spans}")
        return place.interpolate(values)

    @property
    def _spans(self) -> str:
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        return "the mesh spans " + ", ".join(f"{a:.6g} to {b:.6g} m" for a, b in zip(low, high, strict=True))

    @cached_property
    def parts(self) -> IntegrationPoints:
        """Gradients of the shape functions and volumes at the integration points."""
        return integrate_cells(self.mesh)

    @cached_property
    def elastic(self) -> Elastic:
        """Elastic energy of the solid: the material law at all integration points, in the strain measure `strain`."""
        return Elastic(self.mesh.cells, self.parts.dNdX, self.parts.w, law_for(self.material, self.strain))

    def energy(self, strain: str) -> Energy:
        """Return the elastic energy of the solid with a strain measure, in the form that is solved fastest."""
        selective = self.integration == "selective"
        return elastic_energy(self.mesh, self.elastic, self.material, strain, selective)

    def mass(self, lumped: bool = False) -> Any:
        """Return the mass matrix, kg: sparse (3n, 3n), or its diagonal (3n,) if `lumped`."""
        N, w = mass_shapes_and_volumes(self.points, self.mesh.cells, self.mesh.element)
        form = lumped_mass if lumped else consistent_mass
        return form(self.mesh.cells, N, w, self.material.density, len(self.points))

    def sound(self, x: Floats) -> bool:
        """Return whether no cell is inverted at displacements x (3n,), m; always True for small strain."""
        return self.strain == "small" or bool(np.all(np.linalg.det(self.elastic.F(x)) > 0.0))


def _select_points(where: Where, points: Floats) -> NDArray[np.bool_]:
    found = np.asarray(where(points))
    if found.shape != (len(points),) or found.dtype != np.bool_:
        raise ValueError(
            f"a selection must return True or False for each of {len(points)} points, not {found.dtype} {found.shape}"
        )
    return found


def _require_valid_mesh(mesh: Mesh) -> None:
    """Raise ValueError if the arrays do not form a valid mesh, or a cell is inverted."""
    points, cells, nodes = mesh.points, mesh.cells, mesh.element.nodes
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise ValueError(f"points must be finite numbers (n, 3) in m, not {points.shape}")
    if cells.ndim != 2 or cells.shape[1] != nodes or not len(cells):
        raise ValueError(f"cells of {mesh.kind} must be node numbers (m, {nodes}), not {cells.shape}")
    if not np.array_equal(np.unique(cells), np.arange(len(points))):
        raise ValueError(f"cells must refer to each of the {len(points)} points, counted from 0, and to no others")
    if not np.all(least := jacobians(mesh, mesh.element.quadrature()[0]).min(axis=1) > 0.0):
        raise ValueError(f"{np.count_nonzero(~least)} of {len(cells)} cells are flat or inverted")
